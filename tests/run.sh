#!/usr/bin/env bash
# Runs every test there is: installs what they need, then all of the host's tests and the image in
# QEMU. Extra arguments go to the test runner.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

bash tests/setup.sh
export CARGO_TERM_COLOR="${CARGO_TERM_COLOR:-never}"

# Of what is named, or of everything.
packages=(--workspace)
for argument in "$@"; do
    case "$argument" in -p | --package | -p=* | --package=*) packages=() ;; esac
done

if cargo nextest --version >/dev/null 2>&1; then
    failed=0
    cargo nextest run --locked "${packages[@]}" --no-fail-fast "$@" || failed=1
    if (($# == 0)); then
        # nextest leaves the examples in the documentation out.
        cargo test --locked --workspace --doc --no-fail-fast || failed=1
    fi
    exit "$failed"
else
    cargo test --locked "${packages[@]}" --no-fail-fast "$@"
fi
