"""Tracks 1,000 flights from Python and in Rust (`speed.rs`), by turns, and compares times and positions.

    python3 firmware/python/examples/speed.py
"""

import pathlib
import subprocess
import sys
import tempfile
import time

import bnkf
import numpy as np

HERE = pathlib.Path(__file__).resolve().parents[1]
MODEL = HERE.parents[1] / "models" / "recursive.bnkf"
FLIGHTS, SAMPLES, ROUNDS = 1_000, 150, 7

sys.path.append(str(HERE / "tests"))
from flight import readings  # noqa: E402


def tracked(model, rows):
    """Positions of a flight in one call."""
    return bnkf.track(model, rows).position_m


def stepped(model, rows):
    """The same, one call a reading."""
    tracker = bnkf.Tracker(model)
    positions = []
    for t, r, e, a, d, sr, se, sa, sd in rows.tolist():
        gap = r != r
        estimate = tracker.coast(int(t)) if gap else tracker.step(int(t), (r, sr), (e, se), (a, sa), (d, sd))
        positions.append(estimate.position_m)
    return positions


def timed(way, model, flights):
    """Seconds that each flight took, and all positions."""
    seconds, positions = [], []
    for rows in flights:
        start = time.perf_counter()
        positions.append(way(model, rows))
        seconds.append(time.perf_counter() - start)
    return seconds, np.array(positions)


def main():
    model = bnkf.Model(MODEL)
    flights = [readings(SAMPLES, seed) for seed in range(FLIGHTS)]
    manifest = str(HERE / "Cargo.toml")
    command = ["cargo", "run", "--quiet", "--release", "--locked", "--manifest-path", manifest, "--example", "speed"]
    seconds = {"rust": [], "track": [], "step": []}
    with tempfile.TemporaryDirectory() as folder:
        table, answer = pathlib.Path(folder, "readings"), pathlib.Path(folder, "positions")
        np.array(flights).astype("<f8").tofile(table)
        for _ in range(ROUNDS):
            said = subprocess.run(
                [*command, "--", MODEL, table, answer, str(SAMPLES)], check=True, capture_output=True, text=True
            )
            seconds["rust"].append([float(line) for line in said.stdout.split()])
            expected = np.fromfile(answer, "<f4").reshape(FLIGHTS, SAMPLES, 3)
            for name, way in [("track", tracked), ("step", stepped)]:
                taken, positions = timed(way, model, flights)
                assert np.array_equal(positions, expected), f"{name}: other positions than Rust's"
                seconds[name].append(taken)
    # Of every flight the quickest round: what else the machine did is left out.
    best = {name: np.min(rounds, axis=0).sum() for name, rounds in seconds.items()}
    print(f"{FLIGHTS} flights of {SAMPLES} samples, each the best of {ROUNDS} rounds, the same positions to the bit")
    for name, taken in best.items():
        print(f"{name:6} {taken:6.2f} s, {100 * best['rust'] / taken:4.0f} % of Rust's speed")


if __name__ == "__main__":
    main()
