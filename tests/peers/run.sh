#!/usr/bin/env bash
# Makes docs/results/peers.md; run.py says how.
exec python3 "$(dirname "$0")/run.py" "$@"
