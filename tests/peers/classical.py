"""Tunes a filter of another library on training flights, tracks the readings with the best setting, writes its estimates.

    python classical.py NAME READINGS.csv FLIGHTS.npz OUT.csv      # NAME: ekf, ukf (Stone Soup), imm (FilterPy)

A setting is the one of its grid with the least mean distance on thirty training flights at the same noise level and rate
1.0. All start from the first reading fused with the population's range and elevation, at no speed with the population's
spread of velocities, as our tuned filters do.
"""

import importlib
import json
import sys
import time

import numpy as np

import polar
import tables
import whole

MODULES = {"ekf": "stonesoup_filter", "ukf": "stonesoup_filter", "imm": "filterpy_imm"}
TUNING, SEED = 30, 5
SIGMA = np.array([1.0, 0.001, 0.001, 0.01])


def start(known, z, sigma):
    """Position, velocity and their covariance (6, 6) after the first reading, angles to first order."""
    r, sr = polar.fused(z[0], sigma[0], known[0], known[1])
    el, se = polar.fused(z[1], sigma[1], known[2], known[3])
    frame = polar.axes(el, z[2])
    spread = np.array([sr, r * np.cos(el) * sigma[2], r * se])
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = frame @ np.diag(spread**2) @ frame.T
    covariance[3:, 3:] = np.diag(known[[4, 4, 5]] ** 2)
    return np.concatenate([polar.cartesian(r, el, z[2]), np.zeros(3)]), covariance


def tuning_cell(data, noise):
    """Readings of TUNING training flights at this level."""
    rng = np.random.default_rng(SEED)
    position, velocity = data["position"][:TUNING], data["velocity"][:TUNING]
    sigma = SIGMA * 10.0 ** ("low", "medium", "high").index(noise)
    z = np.stack(polar.polar(position, velocity), axis=-1)
    z = z + sigma * rng.standard_normal(z.shape)
    z[..., 2] = polar.wrapped(z[..., 2])
    there = np.ones(z.shape[:2], bool)
    t = np.broadcast_to(0.1 * np.arange(z.shape[1]), there.shape)
    return {"t": t, "z": z, "sigma": np.broadcast_to(sigma, z.shape), "there": there, "truth": position}


def track_all(module, name, setting, known, cell):
    """Means and covariances of all flights; a flight that ends in an error keeps its last estimate."""
    means, covariances, failed = [], [], 0
    for t, z, sigma, there in zip(cell["t"], cell["z"], cell["sigma"], cell["there"]):
        answers = []
        try:
            for mean, covariance in module.track(name, setting, start(known, z[0], sigma[0]), t, z, sigma, there):
                covariance = 0.5 * (covariance + covariance.T)
                if not (np.isfinite(mean).all() and np.linalg.eigvalsh(covariance).min() > 0):
                    raise np.linalg.LinAlgError("not finite or not positive definite")
                answers.append((mean, covariance))
        except (np.linalg.LinAlgError, ValueError, ZeroDivisionError):
            failed += 1
        answers += answers[-1:] * (len(t) - len(answers))
        means.append([mean for mean, _ in answers])
        covariances.append([covariance for _, covariance in answers])
    return np.array(means), np.array(covariances), failed


def distance(mean, cell):
    return float(np.linalg.norm(mean - cell["truth"], axis=-1)[:, 1:].mean())


def main():
    name, path, flights, out = sys.argv[1:5]
    module = importlib.import_module(MODULES[name])
    data = dict(np.load(flights))
    cells, estimates, chosen, spent, tuning = tables.readings(path), {}, {}, {}, {}
    for noise in dict.fromkeys(noise for noise, _ in cells):
        began, practice = time.process_time(), tuning_cell(data, noise)
        scores = [(distance(track_all(module, name, setting, data["population"], practice)[0], practice), setting) for setting in module.GRID]
        best, chosen[noise] = min(scores)
        tuning[noise] = time.process_time() - began
        print(f"{name}, {noise} noise: {module.WHAT} {chosen[noise]}, {best:.4f} m on training flights, {tuning[noise]:.0f} s", flush=True)
    for (noise, rate), cell in cells.items():
        began = time.process_time()
        mean, covariance, failed = track_all(module, name, chosen[noise], data["population"], cell)
        each = 1e6 * (time.process_time() - began) / cell["t"].size
        spent[noise] = min(each, spent.get(noise, each))
        estimates[noise, rate] = mean, covariance
        print(f"{name}, {noise} noise, rate {rate}: {distance(mean, cell):.4f} m, {failed} flights failed, {each:.0f} us a step", flush=True)
    with whole.writing(f"{out}.json") as file:
        json.dump({"step_us": spent, "training_s": tuning, "chosen": chosen, "what": module.WHAT}, file)
    tables.write_estimates(out, cells, estimates)


if __name__ == "__main__":
    main()
