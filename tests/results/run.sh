#!/usr/bin/env bash
# Makes the tables of docs/results anew, each when its evaluation is done:
#   bash tests/results/run.sh runs|scenarios|counter-uas|doubt|evaluation ...
#   bash tests/results/run.sh gazebo=FOLDER ansfl=FOLDER        (folders of recordings, which are not in this repository)
# On two free cores runs and scenarios take 8 minutes each, doubt 6, evaluation and both recorded sets 25 each, the counter-UAS radar one.
set -euo pipefail
here=$PWD
self=$(realpath "$0")
cd "$(dirname "$self")/../.."

filters=ekf-tuned,imm5
more_filters=$filters,imm10,particle
common=(cells.csv comparisons.csv)
ahead=(forecasts.csv forecast_comparisons.csv)
sorted=(bins.csv bounds.csv phases.csv)

[ $# -gt 0 ] || { sed -n '2,5s/^# *//p' "$self"; exit 2; }
# A folder is named from where the command is given.
asked=()
for what; do
    case $what in
        *=/* | *=) ;;
        *=*) what=${what%%=*}=$here/${what#*=} ;;
    esac
    asked+=("$what")
done
set -- "${asked[@]}"

for what; do
    case $what in
        runs | scenarios | counter-uas | doubt | evaluation) ;;
        gazebo=?* | ansfl=?*) [ -d "${what#*=}" ] || { echo "${what#*=}: no such folder" >&2; exit 2; } ;;
        *) echo "$what: not one of runs, scenarios, counter-uas, doubt, evaluation, gazebo=FOLDER, ansfl=FOLDER" >&2; exit 2 ;;
    esac
done

cargo build --quiet --release --locked -p bnkf-host-sim
# A later build must not change what is running.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "${CARGO_TARGET_DIR:-target}/release/host-sim" "$work"

# evaluate FOLDER FILES -- ARGUMENTS: evaluates, then puts the named files into the folder.
evaluate() {
    local folder=docs/results/$1 files=()
    shift
    while [ "$1" != -- ]; do files+=("$1"); shift; done
    shift
    echo "$folder: host-sim evaluate $*" >&2
    rm -rf "$work/out"
    "$work/host-sim" evaluate "$@" --out "$work/out" >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }
    mkdir -p "$folder"
    cp "${files[@]/#/$work/out/}" "$folder"
}

recorded() {
    local folder=recorded/$1
    shift
    evaluate "$folder" "${common[@]}" "${ahead[@]}" "${sorted[@]}" tunings.csv -- --folds 3 "$@" --place --runs 5 \
        --noise-table radians --methods ekf-tuned,ukf-tuned,imm5,imm10,particle,recursive,recursive-tuned
}

for what; do
    case $what in
        runs)
            evaluate runs "${common[@]}" "${ahead[@]}" "${sorted[@]}" -- --folds 5 --runs 5 --noise-table radians \
                --methods "ekf,ekf-tuned,ukf-tuned,ckf-tuned,imm5,imm10,particle,recursive"
            ;;
        scenarios)
            for folder in docs/results/scenarios/*/; do
                name=$(basename "$folder")
                files=()
                case $name in
                    agile) methods=$more_filters files=(bins.csv) ;;
                    darts | falls | bursts | outliers) methods=$more_filters ;;
                    *) methods=$filters ;;
                esac
                evaluate "scenarios/$name" "${common[@]}" "${ahead[@]}" "${files[@]}" -- --scenario "$name" --folds 5 \
                    --methods "$methods,recursive"
            done
            ;;
        counter-uas)
            evaluate counter-uas "${common[@]}" phases.csv variations.csv -- --scenario counter-uas --quick --runs 3 \
                --methods "$filters,imm10,converted,recursive"
            ;;
        doubt)
            python3 tests/ablation/without.py models/recursive.bnkf burst jump outlier --out "$work/alone.bnkf"
            for world in paper fast darts bursts falls outliers; do
                flown=(--scenario "$world" --folds 5 --noise-table radians)
                evaluate "doubt/$world" cells.csv comparisons.csv -- "${flown[@]}" --methods "$more_filters,recursive,recursive-moments"
                evaluate "doubt/$world/passes" cells.csv -- "${flown[@]}" --methods recursive --passes 16
                evaluate "doubt/$world/alone" cells.csv -- "${flown[@]}" --methods recursive --model "$work/alone.bnkf"
            done
            ;;
        evaluation)
            evaluate evaluation "${common[@]}" "${ahead[@]}" "${sorted[@]}" tunings.csv variations.csv reliability.csv \
                runtime.csv runtime.json report.html acceleration-radians.svg comparison-radians.svg forecasts.svg \
                metrics-printed.svg metrics-radians.svg phases-radians.svg reliability-radians.svg speed-radians.svg \
                suspicion.svg variations-medium.svg -- --folds 5 --epochs 60
            ;;
        gazebo=*) recorded gazebo --flights "${what#*=}" ;;
        ansfl=*) recorded ansfl --flights "${what#*=}" --segment-s 8 ;;
    esac
done
