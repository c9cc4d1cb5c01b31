#!/usr/bin/env python3
"""Compares evaluations of two or more models on the same readings, paired by flight.

    python3 tests/ablation/compare.py BASE OTHER [OTHER ...]

The arguments are --out folders of `host-sim evaluate --folds N --noise-table radians --methods recursive --model BLOB --steps`. For each OTHER: the change of
the mean distance in per cent of BASE's and of the negative log-likelihood of a step in nats (no step counts for more
than 60), means over the cells of noise and rate, with 95 % intervals from 2,000 draws of recordings with their segments and
runs, of segments with their runs where there are fewer than ten recordings. Needs pyarrow and numpy; without them it makes a virtual environment under target/.
"""

import re
import sys
from pathlib import Path

# Beside the folder of this script.
sys.path.append(str(Path(__file__).resolve().parent.parent))
import environment

PACKAGES = ["numpy==2.4.6", "pyarrow==22.0.0"]
VENV = Path(__file__).resolve().parent.parent.parent / "target" / "ablation-venv"
NLL_MAX = 60.0
RECORDINGS_MIN = 10
DRAWS = 2000


try:
    import numpy as np
    import pyarrow as pa
    import pyarrow.parquet as pq
except ImportError:
    if environment.is_in(VENV):
        raise SystemExit(f"{VENV} lacks a package; remove it") from None
    environment.enter(VENV, PACKAGES)


def sums(folder: str) -> dict:
    """Sum of distances and of negative log-likelihoods, and the number of steps, by cell and flight."""
    names = ["noise_table", "noise", "rate", "flight", "error_m", "det_p_m6", "mahalanobis_squared"]
    steps = Path(folder) / "steps.parquet"
    try:
        table = pq.read_table(steps, columns=names).to_pydict()
    except (OSError, pa.ArrowInvalid) as error:
        raise SystemExit(f"{steps}: not the steps of an evaluation: {error}") from None
    if len(set(table["noise_table"])) > 1:
        raise SystemExit(f"{steps}: two noise tables, which are two worlds: evaluate with --noise-table")
    log_determinant = np.log(np.maximum(table["det_p_m6"], 1e-300))
    square = np.array(table["mahalanobis_squared"])
    nll = np.minimum(0.5 * (3 * np.log(2 * np.pi) + log_determinant + square), NLL_MAX)
    found = {}
    keys = zip(table["noise"], table["rate"], table["flight"], strict=True)
    for key, error, loss in zip(keys, table["error_m"], nll, strict=True):
        entry = found.setdefault(key, np.zeros(3))
        entry += (error, loss, 1)
    return found


def units(flights: set) -> dict:
    """What is drawn together: recordings with their segments and runs, or segments with their runs if they are too few."""
    recordings = {flight: re.split("[~#]", flight)[0] for flight in flights}
    if len(set(recordings.values())) >= RECORDINGS_MIN:
        return recordings
    return {flight: flight.split("~")[0] for flight in flights}


def main() -> None:
    if len(sys.argv) < 3:
        raise SystemExit(__doc__)
    base_folder, *folders = sys.argv[1:]
    base = sums(base_folder)
    cells = sorted({key[:2] for key in base})
    unit = units({key[2] for key in base})
    names = sorted(set(unit.values()))

    def by_unit(found: dict) -> np.ndarray:
        """Units x cells x sums."""
        array = np.zeros((len(names), len(cells), 3))
        for (noise, rate, flight), entry in found.items():
            array[names.index(unit[flight]), cells.index((noise, rate))] += entry
        return array

    def change(weights: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Means over cells: of the mean distance in per cent, of a step's likelihood in nats; for each row of weights."""
        was, is_now = (np.tensordot(weights, array, 1) for array in (before, other))
        was, is_now = (totals[..., :2] / totals[..., 2:] for totals in (was, is_now))
        distance = 100 * (is_now[..., 0] / was[..., 0] - 1)
        return np.stack([distance, is_now[..., 1] - was[..., 1]], -1).mean(-2)

    before = by_unit(base)
    draws = np.random.default_rng(1).multinomial(len(names), np.full(len(names), 1 / len(names)), DRAWS)
    for folder in folders:
        found = sums(folder)
        if found.keys() != base.keys():
            raise SystemExit(f"{folder}: other flights than {base_folder}")
        other = by_unit(found)
        mean = change(np.ones((1, len(names))), other)[0]
        low, high = np.quantile(change(draws.astype(float), other), [0.025, 0.975], axis=0)
        print(
            f"{folder}: {len(names)} drawn, distance {mean[0]:+.2f} % [{low[0]:+.2f}, {high[0]:+.2f}], "
            f"likelihood {mean[1]:+.3f} nats [{low[1]:+.3f}, {high[1]:+.3f}]"
        )


if __name__ == "__main__":
    main()
