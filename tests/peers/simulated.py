"""Readings of training flights, drawn by the radar model of `model-export` (radar/sampling.rs, radar/gaps.rs).

Normal errors with the sigmas that are stated. Of every 15 samples the first 15, 11 or 8 are measured, in half of the flights
from another place of that pattern, the first sample always; a tenth of the flights has one silence of 1 to 5 s.

>>> rng = np.random.default_rng(1)
>>> data = {"position": np.full((2, 150, 3), 20.0), "velocity": np.zeros((2, 150, 3))}
>>> cell = batch(rng, data, 400, 1)
>>> errors = (cell["z"] - [1200**0.5, np.arcsin(3**-0.5), 0.0, 0.0])[..., :2] / SIGMAS[1, :2]
>>> bool(abs(errors.mean()) < 0.02 and abs(errors.std() - 1) < 0.02)
True
>>> bool(cell["there"][:, 0].all()), bool(abs(cell["there"].mean() - (1 + 11 / 15 + 8 / 15) / 3) < 0.04)
(True, True)
"""

import numpy as np

import polar

STEP_S = 0.1
LOW = np.array([1.0, 0.001, 0.001, 0.01])
LEVELS = {"low": 0, "medium": 1, "high": 2, "clean": 3}
SIGMAS = np.array([LOW, 10 * LOW, 100 * LOW, 1e-3 * LOW])
PERIOD, KEPT = 15, np.array([15, 11, 8])


def measured(rng, size, samples):
    """Which samples of `size` flights are measured."""
    kept = rng.choice(KEPT, (size, 1))
    phase = rng.integers(0, PERIOD, (size, 1)) * rng.integers(0, 2, (size, 1))
    start, silence = rng.integers(10, samples, (size, 1)), rng.integers(10, 50, (size, 1)) * (rng.random((size, 1)) < 0.1)
    k = np.arange(samples)
    silent = (k >= start) & (k < start + silence)
    return (k == 0) | (((k + phase) % PERIOD < kept) & ~silent)


def batch(rng, data, size, level):
    """`size` flights, mirrored in half of the cases, seen at the level of this number, or each at any of the three if it is negative."""
    rows = rng.integers(0, len(data["position"]), size)
    mirror = np.where(rng.integers(0, 2, (size, 1, 1)), 1.0, [1.0, -1.0, 1.0])
    position, velocity = data["position"][rows] * mirror, data["velocity"][rows] * mirror
    samples = position.shape[1]
    levels = np.full(size, level) if level >= 0 else rng.integers(0, 3, size)
    sigma = np.broadcast_to(SIGMAS[levels][:, None], (size, samples, 4))
    z = np.stack(polar.polar(position, velocity), axis=-1) + sigma * rng.standard_normal((size, samples, 4))
    z[..., 2] = polar.wrapped(z[..., 2])
    dt = np.full((size, samples), STEP_S)
    dt[:, 0] = 0.0
    return {"dt": dt, "z": z, "sigma": sigma, "there": measured(rng, size, samples), "truth": position, "level": levels}
