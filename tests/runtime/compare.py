#!/usr/bin/env python3
"""Makes docs/results/runtime.md: our filters' times beside Stone Soup's and torchbnn's.

Run it with any Python 3.10 or later on a machine that does nothing else:
`python3 tests/runtime/compare.py`. It makes a virtual environment under target/ with the pinned
packages (a gigabyte with torch; `--venv DIR` or BNKF_RUNTIME_VENV names one that has them), runs
itself there, and runs `host-sim evaluate` on the same flights.

The flights are analytic: level circles of 144 steps at 10 Hz, seen at the paper's high noise. All
is the processor time of one thread, one after another; of five repetitions the fastest counts, of two flights
the slower; for ours the upper median of four. Stone Soup's filters are set up as tests/golden/stonesoup_filters.py does. The network
is the published code's: torchbnn, 17-64-64-64-64-6 with GELU, 100 passes, weights untrained,
which does not matter to time; each pass draws all weights anew. "One step at a time" is how a tracker must
use it; "whole flight at once" is how published runtimes were taken.
"""

import argparse
import csv
import json
import math
import os
import platform
import shutil
import subprocess
import sys
import time
from pathlib import Path

# Beside the folder of this script.
sys.path.append(str(Path(__file__).resolve().parent.parent))
import environment

PACKAGES = ["stonesoup==1.9.1", "numpy==2.4.6", "torchbnn==1.2"]
TORCH = "torch==2.5.1"
TORCH_INDEX = "https://download.pytorch.org/whl/cpu"
ROOT = Path(__file__).resolve().parent.parent.parent
VENV = ROOT / "target" / "runtime-venv"
WORK = ROOT / "target" / "runtime"
STEPS = 144
REPEATS = 5
FLIGHTS = 4  # two folds need as many
PASSES = 100
SIGMAS = (100.0, 0.1, 0.1, 1.0)  # range m, elevation rad, azimuth rad, range-rate m/s


def enter_venv(named):
    """Runs this file again in the environment, once. A named one is somebody's: it is taken as it is."""
    if not named:
        environment.enter(VENV, ["--extra-index-url", TORCH_INDEX, TORCH], PACKAGES)
    elif not environment.is_in(Path(named)):
        environment.run_again(Path(named) / "bin" / "python")


def flight(number):
    """Times, positions and velocities of a level circle; x east, y north, z up, metres."""
    rate, radius = -0.3, 8.0
    rows = []
    for k in range(STEPS + 1):
        t = 0.1 * k
        angle = rate * t + number
        p = (10.0 + radius * math.cos(angle), -27.0 + radius * math.sin(angle), 15.0)
        v = (-radius * rate * math.sin(angle), radius * rate * math.cos(angle), 0.0)
        rows.append((t, p, v))
    return rows


def fastest(work):
    """Processor seconds of the fastest of REPEATS runs."""
    times = []
    for _ in range(REPEATS):
        start = time.thread_time()
        work()
        times.append(time.thread_time() - start)
    return min(times)


def stone_soup(rows):
    """Seconds a flight of Stone Soup's EKF and UKF."""
    sys.path.insert(0, str(ROOT / "tests" / "golden"))
    import numpy as np
    from stonesoup_filters import polar, run

    rng = np.random.default_rng(1)
    p = np.array([row[1] for row in rows])
    v = np.array([row[2] for row in rows])
    sr, se, sa, sd = SIGMAS
    z = polar(p, v) + rng.standard_normal((len(rows), 4)) * [se, sa, sr, sd]
    z[:, 1] = (z[:, 1] + np.pi) % (2 * np.pi) - np.pi
    mean = np.concatenate([p[0], v[0]]).tolist()
    variance = [sr**2] * 3 + [sd**2] * 3
    return {
        f"Stone Soup {kind.upper()}": fastest(lambda kind=kind: run(kind, SIGMAS, mean, variance, z[1:]))
        for kind in ("ekf", "ukf")
    }


def torchbnn_network():
    """Seconds a flight of the network, one step at a time and over the whole flight at once."""
    import torch
    import torchbnn

    torch.set_num_threads(1)
    torch.manual_seed(1)
    layers = []
    sizes = [17, 64, 64, 64, 64, 6]
    for inputs, outputs in zip(sizes, sizes[1:]):
        layers += [
            torchbnn.BayesLinear(prior_mu=0, prior_sigma=0.01, in_features=inputs, out_features=outputs),
            torch.nn.GELU(),
        ]
    network = torch.nn.Sequential(*layers[:-1])
    features = torch.randn(STEPS, 17)

    def moments(batch):
        with torch.no_grad():
            answers = torch.stack([network(batch) for _ in range(PASSES)])
            away = answers - answers.mean(0)
            return torch.einsum("sni,snj->nij", away, away) / (PASSES - 1)

    def step_by_step():
        for k in range(STEPS):
            moments(features[k : k + 1])

    return {
        "torchbnn, whole flight at once": fastest(lambda: moments(features)),
        "torchbnn, one step at a time": fastest(step_by_step),
    }


def host_sim():
    """Microseconds a step of every method of ours, and the command."""
    shutil.rmtree(WORK, ignore_errors=True)
    flights = WORK / "flights"
    flights.mkdir(parents=True)
    for number in range(FLIGHTS):
        with open(flights / f"circle-{number}.csv", "w", newline="") as file:
            table = csv.writer(file)
            table.writerow(["timestamp", "tx", "ty", "tz"])
            table.writerows([f"{t:.1f}", *(f"{x:.9f}" for x in p)] for t, p, _ in flight(number))
    command = "cargo run --release --locked --bin host-sim -- evaluate --quick --folds 2 --epochs 1 --segment-s 0"
    paths = ["--flights", str(flights), "--out", str(WORK / "out")]
    subprocess.run([*command.split(), *paths], check=True, cwd=ROOT, stdout=subprocess.DEVNULL)
    return json.loads((WORK / "out" / "runtime.json").read_text())


def machine():
    """Processor, cores and load."""
    name = platform.processor() or platform.machine()
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            name = line.split(":", 1)[1].strip()
            break
    return name, os.cpu_count()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--venv", default=os.environ.get("BNKF_RUNTIME_VENV"))
    enter_venv(parser.parse_args().venv)
    os.environ["OMP_NUM_THREADS"] = "1"
    name, cores = machine()
    ours = {row["method"]: row["step_us"] for row in host_sim()}
    loads = [os.getloadavg()[0]]
    theirs = {}
    for number in range(2):
        for method, seconds in {**stone_soup(flight(number)), **torchbnn_network()}.items():
            theirs[method] = max(theirs.get(method, 0.0), 1e6 * seconds / STEPS)
    loads.append(os.getloadavg()[0])
    against = {
        "EKF": "Stone Soup EKF",
        "UKF": "Stone Soup UKF",
        "BNN": "torchbnn, one step at a time",
        "BNKF": "torchbnn, one step at a time",
    }
    lines = [
        "# Run time beside Stone Soup and torchbnn",
        "",
        f"Made by `python3 tests/runtime/compare.py` on {name}, {cores} cores; load average {loads[0]:.1f} after",
        f"our runs and {loads[1]:.1f} after theirs (1 means that nothing else ran and disturbed the caches). Processor time of one",
        f"thread, a flight of {STEPS} steps at high noise, the fastest of five repetitions; the script says what is timed. BNN and",
        "BNKF here are the paper's network, 12-64-64-64-64-64-3; torchbnn's is the published code's, 17-64-64-64-64-6, a",
        "quarter smaller; both make 100 passes. Load slows large programs more than small ones: with a high average, ratios are rough.",
        "",
        "| method | us a step | ms a flight | times as fast as |",
        "|---|---|---|---|",
    ]
    def row(method, step_us, note):
        # Three digits: more than that is noise.
        digits = lambda x: f"{x:.3g}" if x < 999 else f"{x:.0f}"
        lines.append(f"| {method} | {digits(step_us)} | {digits(step_us * STEPS / 1000)} | {note} |")
    for method, step_us in theirs.items():
        row(method, step_us, "")
    for method, step_us in ours.items():
        other = against.get(method)
        row(method, step_us, f"{theirs[other] / step_us:.0f} x {other}" if other else "")
    out = ROOT / "docs" / "results" / "runtime.md"
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text("\n".join(lines) + "\n")
    print(out.read_text())


if __name__ == "__main__":
    main()
