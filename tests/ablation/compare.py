#!/usr/bin/env python3
"""Compares evaluations of two or more models on the same readings, paired by flight.

    python3 tests/ablation/compare.py BASE OTHER [OTHER ...]

The arguments are --out folders of `host-sim evaluate --folds N --methods recursive --model BLOB`. For each OTHER: the change of
the mean distance in per cent of BASE's and of the negative log-likelihood of a step in nats (no step counts for more
than 50), means over the cells of noise and rate, with 95 % intervals from 2,000 draws of flights. Segments and runs of
a recording are drawn together. Needs pyarrow and numpy; without them it makes a virtual environment under target/.
"""

import re
import sys
from pathlib import Path

# Beside the folder of this script.
sys.path.append(str(Path(__file__).resolve().parent.parent))
import environment

PACKAGES = ["numpy==2.4.6", "pyarrow==22.0.0"]
VENV = Path(__file__).resolve().parent.parent.parent / "target" / "ablation-venv"
NLL_MAX = 50.0
DRAWS = 2000


try:
    import numpy as np
    import pyarrow as pa
    import pyarrow.parquet as pq
except ImportError:
    if environment.is_in(VENV):
        raise SystemExit(f"{VENV} lacks a package; remove it") from None
    environment.enter(VENV, PACKAGES)


def means(folder: str) -> dict:
    """Mean distance and negative log-likelihood by cell and flight."""
    names = ["noise", "rate", "flight", "error_m", "det_p_m6", "mahalanobis_squared"]
    steps = Path(folder) / "steps.parquet"
    try:
        table = pq.read_table(steps, columns=names).to_pydict()
    except (OSError, pa.ArrowInvalid) as error:
        raise SystemExit(f"{steps}: not the steps of an evaluation: {error}") from None
    log_determinant = np.log(np.maximum(table["det_p_m6"], 1e-300))
    square = np.array(table["mahalanobis_squared"])
    nll = np.minimum(0.5 * (3 * np.log(2 * np.pi) + log_determinant + square), NLL_MAX)
    sums = {}
    keys = zip(table["noise"], table["rate"], table["flight"], strict=True)
    for key, error, loss in zip(keys, table["error_m"], nll, strict=True):
        entry = sums.setdefault(key, [0.0, 0.0, 0])
        entry[0] += error
        entry[1] += loss
        entry[2] += 1
    return {key: (error / count, loss / count) for key, (error, loss, count) in sums.items()}


def main() -> None:
    if len(sys.argv) < 3:
        raise SystemExit(__doc__)
    base_folder, *folders = sys.argv[1:]
    base = means(base_folder)
    cells = {key[:2] for key in base}
    in_cell = {cell: np.mean([v[0] for k, v in base.items() if k[:2] == cell]) for cell in cells}
    recording = {key: re.split("[~#@]", key[2])[0] for key in base}
    recordings = sorted(set(recording.values()))
    draws = np.random.default_rng(1).integers(0, len(recordings), (DRAWS, len(recordings)))
    for folder in folders:
        other = means(folder)
        if other.keys() != base.keys():
            raise SystemExit(f"{folder}: other flights than {base_folder}")
        changes = []
        for name in recordings:
            keys = [key for key in base if recording[key] == name]
            distance = np.mean([(other[k][0] - base[k][0]) / in_cell[k[:2]] for k in keys])
            changes.append((100 * distance, np.mean([other[k][1] - base[k][1] for k in keys])))
        changes = np.array(changes)
        low, high = np.quantile(changes[draws].mean(1), [0.025, 0.975], axis=0)
        mean = changes.mean(0)
        print(
            f"{folder}: {len(recordings)} recordings, distance {mean[0]:+.2f} % [{low[0]:+.2f}, {high[0]:+.2f}], "
            f"likelihood {mean[1]:+.3f} nats [{low[1]:+.3f}, {high[1]:+.3f}]"
        )


if __name__ == "__main__":
    main()
