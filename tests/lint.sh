#!/usr/bin/env bash
# Checks what no test sees: formatting, clippy, the documentation's links, and the oldest compiler
# that Cargo.toml names if it is installed. Warnings are errors. Runs all checks, then says which
# failed. Licences are checked by tests/licences.rs.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export CARGO_TERM_COLOR="${CARGO_TERM_COLOR:-never}"

failed=()

check() {
    local name=$1
    shift
    printf 'lint: %s: %s\n' "$name" "$*"
    "$@" || failed+=("$name")
}

check format cargo fmt --all --check
check clippy cargo clippy --quiet --keep-going --locked --workspace --all-targets -- -D warnings
# No workspace build has them.
check features cargo clippy --quiet --locked -p bnkf --features defmt,serde -- -D warnings
check "nothing but the core" cargo clippy --quiet --locked -p bnkf --no-default-features --features c -- -D warnings
# Not members of the workspace.
check "format of Python's crate" cargo fmt --manifest-path firmware/python/Cargo.toml --check
check "clippy of Python's crate" cargo clippy --quiet --locked --manifest-path firmware/python/Cargo.toml \
    --target-dir "${CARGO_TARGET_DIR:-target}/python" --all-targets -- -D warnings
check "format of mutation tests" cargo fmt --manifest-path tests/mutants/Cargo.toml --check
check "clippy of mutation tests" cargo clippy --quiet --locked --manifest-path tests/mutants/Cargo.toml \
    --target-dir "${CARGO_TARGET_DIR:-target}/mutants-at-once/tool" --all-targets -- -D warnings
# No clippy: it would build libFuzzer, and all that the targets call is in a test of the workspace.
check "format of fuzzing" cargo fmt --manifest-path tests/fuzz/Cargo.toml --check
check documentation env RUSTDOCFLAGS="-D warnings" \
    cargo doc --quiet --keep-going --locked --workspace --no-deps

oldest=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)
if command -v rustup >/dev/null && rustup toolchain list | grep -q "^$oldest[.-]"; then
    check "Rust $oldest" rustup run "$oldest" \
        cargo check --quiet --locked --workspace --all-targets
else
    printf 'lint: Rust %s: not checked here; rustup toolchain install %s --profile minimal\n' \
        "$oldest" "$oldest"
fi

if [ ${#failed[@]} -gt 0 ]; then
    printf 'lint: failed: %s\n' "${failed[*]}" >&2
    exit 1
fi
printf 'lint: all passed\n'
