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
FLIGHTS, SAMPLES, ROUNDS = 1_000, 150, 3

sys.path.append(str(HERE / "tests"))
from flight import readings  # noqa: E402


def tracked(model, flights):
    """Seconds that it took, and the positions."""
    start = time.perf_counter()
    positions = [bnkf.track(model, rows).position_m for rows in flights]
    return time.perf_counter() - start, np.array(positions)


def stepped(model, flights):
    """The same, one call a reading."""
    start = time.perf_counter()
    positions = []
    for rows in flights:
        tracker = bnkf.Tracker(model)
        for t, r, e, a, d, sr, se, sa, sd in rows.tolist():
            gap = r != r
            estimate = tracker.coast(int(t)) if gap else tracker.step(int(t), (r, sr), (e, se), (a, sa), (d, sd))
            positions.append(estimate.position_m)
    return time.perf_counter() - start, np.array(positions).reshape(len(flights), -1, 3)


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
            seconds["rust"].append(float(said.stdout))
            expected = np.fromfile(answer, "<f4").reshape(FLIGHTS, SAMPLES, 3)
            for name, way in [("track", tracked), ("step", stepped)]:
                taken, positions = way(model, flights)
                assert np.array_equal(positions, expected), f"{name}: other positions than Rust's"
                seconds[name].append(taken)
    rust = min(seconds["rust"])
    print(f"{FLIGHTS} flights of {SAMPLES} samples, the best of {ROUNDS} rounds, the same positions to the bit")
    for name, taken in seconds.items():
        print(f"{name:6} {min(taken):6.2f} s, {100 * rust / min(taken):4.0f} % of Rust's speed")


if __name__ == "__main__":
    main()
