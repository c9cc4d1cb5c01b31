#!/usr/bin/env bash
# The first stage of tests/mutants.sh a hundred times faster: all changes go into one copy of the
# sources, each behind a question at run time, so that one build serves all of them. Needs
# `cargo install cargo-mutants --locked`, which lists the changes. Arguments choose what is changed:
#
#     bash tests/mutants_at_once.sh -f 'firmware/src/recursive/**'
#
# BNKF_SHARD=1/6 runs every sixth change only. Results: target/mutants-at-once/results.txt, a line a
# change. "not-made" are changes of constants, which `tests/mutants.sh --re` tries one by one.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

out=$PWD/target/mutants-at-once
build=${CARGO_TARGET_DIR:-$out/build}
mkdir -p "$out"
cargo mutants --config tests/mutants.toml --package bnkf --list --json "$@" >"$out/list.json"
nice cargo build --quiet --release --locked --manifest-path tests/mutants/Cargo.toml --target-dir "$out/tool"
tool=$out/tool/release/mutants-at-once

# What does not compile is left out and counted as unviable.
: >"$out/unviable"
while :; do
    rm -rf "$out/tree"
    mkdir "$out/tree"
    git ls-files -z --cached --others --exclude-standard | tar -cf - --null -T - | tar -xf - -C "$out/tree"
    "$tool" rewrite "$out/list.json" "$out/tree" "$out/unviable"
    if nice cargo test --manifest-path "$out/tree/Cargo.toml" --target-dir "$build" --locked \
        --package bnkf --lib --no-run >"$out/build.log" 2>&1; then
        break
    fi
    # Every change stands in a line of its own; the compiler may quote less of it than its number.
    refused=$(grep -A 1 '^error' "$out/build.log" | grep -oE '[^ ]+\.rs:[0-9]+' |
        while IFS=: read -r file line; do sed -n "${line}p" "$out/tree/$file"; done |
        grep -oE 'mutant :: on \([0-9]+usize' | grep -oE '[0-9]+' | sort -un) || true
    if [ -z "$refused" ]; then
        echo "mutants: the copy does not build: $out/build.log" >&2
        exit 1
    fi
    printf '%s\n' $refused >>"$out/unviable"
done
binary=$(sed -n 's/.*Executable unittests src\/lib.rs (\(.*\))/\1/p' "$out/build.log")
case $binary in /*) ;; *) binary=$PWD/$binary ;; esac

nice "$tool" run "$out/list.json" "$out/tree" "$out/unviable" "$binary" "$out/results.txt" \
    ${BNKF_SHARD:+"$BNKF_SHARD"}
cut -d ' ' -f 2 "$out/results.txt" | sort | uniq -c
