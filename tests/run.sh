#!/usr/bin/env bash
# Runs every test there is: installs what they need, then all of the host's tests and the image in
# QEMU. Extra arguments go to the test runner.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

bash tests/setup.sh
export CARGO_TERM_COLOR="${CARGO_TERM_COLOR:-never}"

if cargo nextest --version >/dev/null 2>&1; then
    cargo nextest run --locked --workspace --no-fail-fast "$@"
    # nextest leaves the examples in the documentation out.
    cargo test --locked --workspace --doc
else
    cargo test --locked --workspace --no-fail-fast "$@"
fi
