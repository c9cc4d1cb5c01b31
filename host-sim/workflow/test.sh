#!/usr/bin/env bash
# Trains, tunes and evaluates through Snakemake in four shards, one of which is killed on its way and run again, and
# compares every file of the results with those of a single run: test.sh [FOLDER WITH host-sim AND model-export].
# Without a folder they are built. Exits with 1 at the first difference.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
target=${CARGO_TARGET_DIR:-$here/../../target}
mkdir -p "$target"
target=$(cd "$target" && pwd)
if [ $# -eq 0 ]; then
    (cd "$here/../.." && cargo build --release --locked -p bnkf-host-sim -p bnkf-model-export)
    programs=$target/release
else
    programs=$(cd "$1" && pwd)
fi
bash "$here/venv.sh" "$target/workflow-venv"
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
start=$SECONDS

# The same relative paths in both: results name them.
mkdir -p "$place/single/out" "$place/divided"
"$programs/model-export" flights --builtin 8 --out "$place/divided/flights" >"$place/log"
cp -r "$place/divided/flights" "$place/single/flights"
evaluate="--folds 2 --flights flights --methods ekf,recursive --noise-table radians --steps --no-times"

# host-sim as Snakemake runs it: the second shard is killed once, when the first of its pieces is there.
cat >"$place/host-sim" <<WRAPPER
#!/usr/bin/env bash
set -u
if [[ " \$* " == *" --shard 2/4 "* ]] && mkdir "$place/killed" 2>/dev/null; then
    "$programs/host-sim" "\$@" &
    until [ -e out/work/unit-000-000001 ]; do
        kill -0 \$! 2>/dev/null || exit 1
        sleep 0.002
    done
    kill -9 \$!
    wait \$!
    status=\$?
    ls out/work | grep -c '^unit-' >"$place/killed/pieces"
    exit \$status
fi
exec "$programs/host-sim" "\$@"
WRAPPER
chmod +x "$place/host-sim"

"$target/workflow-venv/bin/snakemake" --snakefile "$here/Snakefile" --directory "$place/divided" \
    --workflow-profile "$here/profiles/local" --cores 2 --quiet rules --config \
    host_sim="$place/host-sim" model_export="$programs/model-export" out=out shards=4 threads=1 model="" \
    train="--builtin 8 --episodes 2" tune="--flights flights --episodes 2" evaluate="$evaluate" \
    >"$place/log" 2>&1 || { cat "$place/log" >&2; exit 1; }
[ -e "$place/killed/pieces" ] || { echo "no shard was killed" >&2; exit 1; }
echo "shard 2/4 killed with $(cat "$place/killed/pieces") of 72 units made by all, and run again"

cp "$place/divided/out/tuned.bnkf"* "$place/single/out/"
# shellcheck disable=SC2086  # words
(cd "$place/single" && "$programs/host-sim" evaluate $evaluate --out out/results --model out/tuned.bnkf >"$place/log")

files=0
for file in "$place/single/out/results"/*; do
    cmp "$file" "$place/divided/out/results/$(basename "$file")"
    files=$((files + 1))
done
extra=$(diff <(ls "$place/single/out/results") <(ls "$place/divided/out/results")) || { echo "$extra" >&2; exit 1; }
echo "$files files, the same bytes as of a single run; $((SECONDS - start)) s"
