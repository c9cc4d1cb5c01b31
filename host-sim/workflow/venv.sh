#!/usr/bin/env bash
# Makes an environment with Snakemake: venv.sh DIR. One that is there already is left as it is.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
[ $# -eq 1 ] || { echo "venv.sh DIR" >&2; exit 2; }
if [ ! -x "$1/bin/snakemake" ]; then
    python3 -m venv "$1"
    "$1/bin/pip" install --quiet --disable-pip-version-check -r "$here/requirements.txt"
fi
