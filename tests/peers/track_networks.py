"""Tracks the readings with a trained network and writes its estimates; prints the time of a step.

    python track_networks.py gru|gain READINGS.csv FLIGHTS.npz OUT.csv LEVEL=WEIGHTS.npz ...

LEVEL is low, medium, high, or all. The time is the processor's for one flight after another in one compiled loop over the
steps, one thread, the fastest of five repetitions.
"""

import importlib
import json
import sys
import time

import jax
import jax.numpy as jnp
import numpy as np

import likelihood
import tables
import train
import whole


def as_flights(cell):
    dt = np.diff(cell["t"], prepend=cell["t"][:, :1])
    return {name: jnp.asarray(value) for name, value in (("dt", dt), ("z", cell["z"]), ("sigma", cell["sigma"]), ("there", cell["there"]))}


def step_us(track, flight, steps):
    """Microseconds of the processor a step."""
    run = jax.jit(track)
    jax.block_until_ready(run(flight))
    times = []
    for _ in range(5):
        began = time.process_time()
        for _ in range(20):
            jax.block_until_ready(run(flight))
        times.append((time.process_time() - began) / 20)
    return 1e6 * min(times) / steps


def main():
    peer, path, flights, out = sys.argv[1:5]
    weights = dict(entry.split("=", 1) for entry in sys.argv[5:])
    module = importlib.import_module(train.MODULES[peer])
    known = jnp.asarray(np.load(flights)["population"])
    cells, estimates, spent = tables.readings(path), {}, {}
    for (noise, rate), cell in cells.items():
        file = weights.get(noise, weights.get("all"))
        if file is None:
            continue
        params, seen = train.restored(module, np.load(file)), as_flights(cell)
        track = lambda flight: module.track(params, known, flight)
        answer = jax.jit(jax.vmap(track))(seen)
        covariance = np.asarray(likelihood.covariance(jax.tree.map(lambda x: np.asarray(x, float), answer)))
        mean = np.asarray(answer["mean"], float)
        estimates[noise, rate] = mean, covariance
        spent.setdefault(noise, step_us(track, jax.tree.map(lambda x: x[0], seen), mean.shape[1]))
        error = np.linalg.norm(mean - cell["truth"], axis=-1)[:, 1:]
        print(f"{peer}, {noise} noise, rate {rate}: {error.mean():.4f} m, {spent[noise]:.1f} us a step", flush=True)
    with whole.writing(f"{out}.json") as file:
        seconds = {noise: float(np.load(file)["seconds"]) for noise, file in weights.items()}
        json.dump({"step_us": spent, "training_s": seconds}, file)
    tables.write_estimates(out, cells, estimates)


if __name__ == "__main__":
    main()
