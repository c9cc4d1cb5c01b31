#!/usr/bin/env python3
"""Splits the flights of a scenario into eight to tune on and up to 48 to judge by.

    host-sim readings --scenario darts --folds 5 --seed 4242 --noise-table radians --out READINGS
    python3 tests/ablation/own_flights.py READINGS OUT

Writes the true positions of every twelfth flight, eight of them, into OUT/own and those of the first 48 others into
OUT/others, one CSV file each, as `model-export tune --flights` and `host-sim evaluate --flights` read them.
"""

import csv
import sys
from pathlib import Path

OWN = 8
OTHERS = 48


def tracks(readings: Path) -> dict[str, list[str]]:
    """The lines of every flight's file."""
    lines: dict[str, list[str]] = {}
    with readings.open(newline="") as file:
        for row in csv.DictReader(file):
            # Every noise and rate has the same truth.
            if (row["noise"], row["rate"]) == ("low", "1.00"):
                position = (row[f"true_{axis}_m"] for axis in "xyz")
                line = ",".join([f"{float(row['time_us']) * 1e-6:.6f}", *position])
                lines.setdefault(row["flight"], []).append(line)
    return lines


def write(folder: Path, names: list[str], lines: dict[str, list[str]]) -> None:
    folder.mkdir(parents=True)
    for name in names:
        text = "\n".join(["timestamp,tx,ty,tz", *lines[name]])
        (folder / f"{name}.csv").write_text(text + "\n")


def main() -> None:
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    readings, out = Path(sys.argv[1]) / "readings.csv", Path(sys.argv[2])
    lines = tracks(readings)
    names = list(lines)
    if len(names) < 2 * OWN:
        raise SystemExit(f"{readings}: {len(names)} flights, {2 * OWN} are needed")
    own = names[:: len(names) // OWN][:OWN]
    others = [name for name in names if name not in own][:OTHERS]
    write(out / "own", own, lines)
    write(out / "others", others, lines)
    print(f"{out}: {len(own)} to tune on, {len(others)} to judge by")


if __name__ == "__main__":
    main()
