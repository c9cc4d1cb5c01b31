#!/usr/bin/env bash
# Builds the wheel, installs it in a fresh environment and tests it there, beside what the Rust tracker said:
# test.sh DIR, where readings.csv and estimates.csv of `host-sim readings` and `host-sim track` are. Without
# DIR the test of the workspace makes them and comes back.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
if [ $# -eq 0 ]; then
    cd "$here/../.."
    exec cargo test --locked --test python
fi
twin=$(cd "$1" && pwd)
target=${CARGO_TARGET_DIR:-$here/../../target}/python
mkdir -p "$target"
target=$(cd "$target" && pwd)
export CARGO_TARGET_DIR=$target

rm -rf "$target/venv" "$target/wheels"
python3 -m venv "$target/venv"
bin=$target/venv/bin
"$bin/pip" install --quiet --disable-pip-version-check -r "$here/requirements.txt"
"$bin/maturin" build --release --locked --manifest-path "$here/Cargo.toml" \
    --interpreter "$bin/python" --out "$target/wheels"
"$bin/pip" install --quiet --disable-pip-version-check --no-index "$target"/wheels/bnkf-*.whl

cd "$target"
BNKF_TWIN=$twin "$bin/python" -m pytest -q -p no:cacheprovider "$here/tests"
# bnkf.bnkf is the library inside the package, whose names the package has.
"$bin/python" -m mypy.stubtest bnkf --ignore-disjoint-bases --allowlist <(echo bnkf.bnkf)
