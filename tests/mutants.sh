#!/usr/bin/env bash
# Mutation tests of the firmware crate: changes one operator or function at a time and says which
# changes no test notices. Needs `cargo install cargo-mutants --locked`; not part of CI, since all
# files take hours. Arguments choose what is changed:
#
#     bash tests/mutants.sh -f firmware/src/gaussian.rs
#
# tests/mutants_at_once.sh does the first stage in minutes; what it leaves can be tried here (--re).
#
# First the crate's own unit tests run against every change, seconds each; then the whole-system
# tests against those that were left, minutes each (BNKF_MUTANTS=unit stops before them). Results:
# target/mutants/mutants.out.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

if ! cargo mutants --version >/dev/null 2>&1; then
    echo "mutants: cargo install cargo-mutants --locked" >&2
    exit 1
fi
mkdir -p target/mutants

mutants() {
    nice cargo mutants --config tests/mutants.toml --package bnkf --jobs 1 --output target/mutants "$@"
}

status=0
mutants --cargo-test-arg=--lib "$@" || status=$?
# 2: some change was not noticed; 3: some tests ran out of time, which counts as noticed.
if [ "$status" -eq 3 ]; then
    status=0
fi
if [ "$status" -ne 2 ] || [ "${BNKF_MUTANTS:-}" = unit ]; then
    exit "$status"
fi

system=()
for name in bayesian_network blob_format tracker recursive_twin training_step; do
    system+=(--cargo-test-arg=--test --cargo-test-arg="$name")
done
mutants --iterate --test-package bnkf-system "${system[@]}" "$@"
