#!/usr/bin/env python3
"""Makes docs/results/peers.md: trackers of other kinds beside ours on the same readings.

    python3 tests/peers/run.py

Needs Python 3.11 or later; it makes a virtual environment with the pinned packages. Networks are trained with JAX, whose
wheels for processors are 100 MB; torch from PyPI would bring 2.5 GB for graphics cards, and small recurrent networks are
no faster there. A stage whose output is in target/peers is not run again; `--fresh` begins anew. Two stages run at a time,
each on one thread.
"""

import argparse
import os
import resource
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

# Beside the folder of this script.
sys.path.append(str(Path(__file__).resolve().parent.parent))
import environment

PACKAGES = ["jax==0.10.2", "optax==0.2.8", "numpy==2.4.6", "scipy==1.17.1", "stonesoup==1.9.1", "filterpy==2.0.0"]
HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
WORK, VENV = ROOT / "target" / "peers", ROOT / "target" / "peers-venv"
RATES = {"full": "[1.0]", "gaps": "[0.75, 0.5]"}
FLIGHTS, FLIGHTS_SEED = 6000, 424242
# Updates for all noise levels, then for each.
UPDATES = {"gru": (5000, 2500), "gain": (3000, 1500), "forecast": (1500, 600)}
ESTIMATES = {
    "GRU": ("gru", ["low", "medium", "high"]),
    "GRU of all levels": ("gru", ["all"]),
    "KalmanNet": ("gain", ["low", "medium", "high"]),
}
CLASSICAL = {"Stone Soup EKF": "ekf", "Stone Soup UKF": "ukf", "FilterPy IMM": "imm"}
# What the rest rests on; its examples are run before everything else.
CHECKED = ["polar", "simulated", "whole"]
ONE_THREAD = {
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1", "JAX_PLATFORMS": "cpu",
    "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "RAYON_NUM_THREADS": "1",
    "JAX_COMPILATION_CACHE_DIR": str(WORK / "compiled"),
}


def call(*command):
    subprocess.run([str(part) for part in command], check=True, cwd=ROOT, env=os.environ | ONE_THREAD)


def python(script, *arguments):
    call(VENV / "bin" / "python", HERE / f"{script}.py", *arguments)


def stage(outputs, work):
    """Runs `work` unless all its outputs are there, and says how long it took."""
    missing = [output for output in outputs if not output.exists()]
    if not missing:
        return
    began = time.time()
    names = ", ".join(str(output.relative_to(ROOT)) for output in missing)
    print(f"{names} ...", flush=True)
    work()
    lost = [output for output in missing if not output.exists()]
    if lost:
        raise SystemExit(f"not made: {lost}")
    print(f"{names}: {time.time() - began:.0f} s", flush=True)


def make_scenario(name):
    """The paper's scenario with some of its rates; flights and readings are the same."""
    lines = (ROOT / "host-sim" / "scenarios" / "paper.toml").read_text().splitlines()
    swap = {"rates": RATES[name], "noise_tables": '["radians"]'}
    lines = [next((f"{key} = {value}" for key, value in swap.items() if line.startswith(f"{key} =")), line) for line in lines]
    (WORK / f"{name}.toml").write_text("\n".join(lines) + "\n")


def make_flights(model_export):
    shutil.rmtree(WORK / "flights", ignore_errors=True)
    call(model_export, "flights", "--builtin", FLIGHTS, "--builtin-seed", FLIGHTS_SEED, "--out", WORK / "flights")
    python("flights", WORK / "flights", WORK / "flights.npz")
    shutil.rmtree(WORK / "flights")


def estimates(part, name, work=WORK):
    return work / "estimates" / part / f"{name.replace(' ', '-')}.csv"


def weights(peer):
    levels = ["all", "low", "medium", "high"] + (["clean"] if peer == "forecast" else [])
    return [WORK / "weights" / f"{peer}-{level}.npz" for level in levels]


def train(peer):
    stage(weights(peer), lambda: python("train", peer, WORK / "flights.npz", WORK / "weights", *UPDATES[peer]))


def track(part, name):
    peer, levels = ESTIMATES[name]
    pairs = [f"{level}={WORK / 'weights' / f'{peer}-{level}.npz'}" for level in levels]
    out = estimates(part, name)
    stage([out], lambda: python("track_networks", peer, WORK / part / "readings.csv", WORK / "flights.npz", out, *pairs))


def classical(name):
    out = estimates("full", name)
    stage([out], lambda: python("classical", CLASSICAL[name], WORK / "full" / "readings.csv", WORK / "flights.npz", out))


def score(host_sim, part):
    names = [*ESTIMATES, *(CLASSICAL if part == "full" else [])]
    entries = [text for name in names for text in ("--estimates", f"{name}={estimates(part, name)}")]
    arguments = ["--folds", 5, "--scenario", WORK / f"{part}.toml", "--methods", "ekf-tuned,imm5,recursive"]
    out = WORK / "score" / part
    stage([out / "runtime.csv"], lambda: call(host_sim, "score", *arguments, *entries, "--out", out))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fresh", action="store_true", help="begin anew")
    parser.add_argument("--binaries", type=Path, help="folder of host-sim and model-export; otherwise cargo builds them")
    options = parser.parse_args()
    if options.fresh:
        shutil.rmtree(WORK, ignore_errors=True)
    for folder in ("weights", "estimates/full", "estimates/gaps"):
        (WORK / folder).mkdir(parents=True, exist_ok=True)
    binaries = options.binaries
    if binaries is None:
        call("cargo", "build", "--release", "--locked", "--bin", "host-sim", "--bin", "model-export")
        # Cargo, which ran in ROOT, takes a relative folder from there.
        binaries = ROOT / os.environ.get("CARGO_TARGET_DIR", "target") / "release"
    host_sim, model_export = (binaries.resolve() / name for name in ("host-sim", "model-export"))
    environment.made(VENV, PACKAGES)
    for module in CHECKED:
        call(VENV / "bin" / "python", "-m", "doctest", HERE / f"{module}.py")
    stage([WORK / "flights.npz"], lambda: make_flights(model_export))
    for part in RATES:
        make_scenario(part)
        readings = ["readings", "--folds", 5, "--scenario", WORK / f"{part}.toml", "--out", WORK / part]
        stage([WORK / part / "readings.csv"], lambda: call(host_sim, *readings))
    with ThreadPoolExecutor(2) as pool:
        jobs = [pool.submit(train, peer) for peer in UPDATES] + [pool.submit(classical, name) for name in CLASSICAL]
        for job in jobs:
            job.result()
    # One after another: the times of a step are measured here.
    for part in RATES:
        for name in ESTIMATES:
            track(part, name)
        score(host_sim, part)
    forecasts = WORK / "forecasts.csv"
    arguments = [WORK / "full" / "readings.csv", WORK / "flights.npz", WORK / "weights", host_sim, forecasts]
    stage([forecasts], lambda: python("forecast_score", *arguments))
    python("page", WORK, ROOT / "docs" / "results")
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"docs/results/peers.md; {(used.ru_utime + used.ru_stime) / 60:.0f} minutes of one core in this run")


if __name__ == "__main__":
    main()
