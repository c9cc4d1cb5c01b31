#!/usr/bin/env python3
"""Where the error of a method lies: along the line of sight from a radar in the origin, and across it.

    python3 tests/ablation/along.py OUT [METHOD]

OUT is the --out folder of `host-sim evaluate --folds N --steps`; METHOD is `recursive` unless named. For each noise table, level
and rate: mean distance, mean of the error along without its sign, mean of the error across, metres. Takes its packages as
compare.py does.
"""

import sys
from pathlib import Path

from compare import np, pa, pq


def main() -> None:
    if len(sys.argv) not in (2, 3):
        raise SystemExit(__doc__)
    steps = Path(sys.argv[1]) / "steps.parquet"
    method = sys.argv[2] if len(sys.argv) == 3 else "recursive"
    places = ["true_x_m", "true_y_m", "true_z_m", "x_m", "y_m", "z_m"]
    try:
        table = pq.read_table(steps, columns=["noise_table", "noise", "rate", *places], filters=[("method", "==", method)])
    except (OSError, pa.ArrowInvalid, pa.ArrowKeyError) as error:
        raise SystemExit(f"{steps}: not the steps of an evaluation with --steps: {str(error).splitlines()[0]}") from None
    if table.num_rows == 0:
        raise SystemExit(f"{steps}: no method {method}")
    columns = np.stack([table[name].to_numpy() for name in places])
    truth, error = columns[:3], columns[3:] - columns[:3]
    along = np.abs((error * truth).sum(0)) / np.linalg.norm(truth, axis=0)
    distance = np.linalg.norm(error, axis=0)
    across = np.sqrt(np.maximum(distance**2 - along**2, 0.0))
    names = [table[name].to_numpy(zero_copy_only=False).astype(str) for name in ("noise_table", "noise", "rate")]
    for cell in dict.fromkeys(zip(*names, strict=True)):
        own = np.all([name == of for name, of in zip(names, cell, strict=True)], axis=0)
        means = [part[own].mean() for part in (distance, along, across)]
        print("{:<8}{:<7}{:<5} distance {:.3f}, along {:.3f}, across {:.3f} m".format(*cell, *means))


if __name__ == "__main__":
    main()
