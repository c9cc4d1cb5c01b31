"""Forecasts of networks and of the recursive tracker at the same samples, scored; writes forecasts.csv.

    python forecast_score.py READINGS.csv FLIGHTS.npz WEIGHTS_FOLDER HOST_SIM OUT.csv

After every fifth sample from 2 s on, half a second and one second ahead. The recursive tracker is `host-sim track` on
readings that end there and two rows in a gap. Intervals: 95 %, a bootstrap over flights.
"""

import csv
import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

import forecast
import polar
import tables
import train
import whole

ENDS = np.arange(forecast.HISTORY, 140, 5)


def interval(by_flight):
    rng = np.random.default_rng(1)
    drawn = rng.integers(0, len(by_flight), (2000, len(by_flight)))
    return np.quantile(by_flight[drawn].mean(1), (0.025, 0.975))


def network(folder, level, known, z, sigma):
    params = train.restored(forecast, np.load(folder / f"forecast-{level}.npz"))
    run = jax.jit(jax.vmap(lambda z, sigma: forecast.windows(params, known, z, sigma, jnp.asarray(ENDS))))
    return np.asarray(run(jnp.asarray(z), jnp.asarray(sigma)), float)


def recursive(host_sim, cell, folder):
    """Forecasts (flights, ends, horizons, 3) of the recursive tracker."""
    plots, out = folder / "plots.csv", folder / "track"
    with whole.writing(plots) as file:
        table = csv.writer(file)
        table.writerow(["flight", "time_us", *tables.CHANNELS, *(f"sigma_{name}" for name in tables.CHANNELS)])
        for name, t, z, sigma in zip(cell["flight"], cell["t"], cell["z"], cell["sigma"]):
            for end in ENDS:
                for k in [*range(end + 1), *(end + np.array(forecast.AHEAD))]:
                    seen = [*z[k], *sigma[k]] if k <= end else [""] * 8
                    table.writerow([f"{name}@{end}", round(1e6 * t[k]), *seen])
    subprocess.run([host_sim, "track", "--readings", str(plots), "--out", str(out)], check=True, stdout=subprocess.DEVNULL)
    found = {}
    with open(out / "estimates.csv", newline="") as file:
        for row in csv.DictReader(file):
            found.setdefault(row["flight"], []).append(row)
    ahead = lambda rows: [[float(row[f"{axis}_m"]) for axis in "xyz"] for row in rows[-len(forecast.AHEAD) :]]
    plots.unlink()
    return np.array([[ahead(found[f"{name}@{end}"]) for end in ENDS] for name in cell["flight"]])


def main():
    path, flights, folder, host_sim, out = sys.argv[1:]
    known, folder = jnp.asarray(np.load(flights)["population"]), Path(folder)
    rows = []

    def score(noise, name, answer, truth):
        error = np.linalg.norm(answer - truth, axis=-1).mean(1)
        for horizon, each in zip(forecast.AHEAD, error.T):
            low, high = interval(each)
            rows.append([noise, name, horizon / 10, f"{each.mean():.4f}", f"{low:.4f}", f"{high:.4f}"])
            print(*rows[-1], flush=True)

    clean = None
    for (noise, rate), cell in tables.readings(path).items():
        if rate != "1.00":
            continue
        truth = cell["truth"][:, ENDS[:, None] + np.array(forecast.AHEAD)]
        if clean is None:
            here, before = cell["truth"][:, ENDS], cell["truth"][:, ENDS - 1]
            straight = here[:, :, None] + (here - before)[:, :, None] * np.array(forecast.AHEAD)[:, None]
            score("clean", "straight on", straight, truth)
            with open(path, newline="") as file:
                velocity = {(row["flight"], int(row["step"])): [float(row[f"true_v{axis}_mps"]) for axis in "xyz"] for row in csv.DictReader(file)}
            velocity = np.array([[velocity[name, k] for k in range(cell["t"].shape[1])] for name in cell["flight"]])
            clean = np.stack(polar.polar(cell["truth"], velocity), axis=-1), np.full_like(cell["sigma"], 1e-3) * [1, 1e-3, 1e-3, 1e-2]
            score("clean", "GRU of clean positions", network(folder, "clean", known, *clean), truth)
        z, sigma, fused = cell["z"], cell["sigma"], cell["z"].copy()
        for channel in (0, 1):
            mean, sd = np.asarray(known)[2 * channel : 2 * channel + 2]
            fused[..., channel] = polar.fused(z[..., channel], sigma[..., channel], mean, sd)[0]
        score(noise, "recursive", recursive(host_sim, cell, folder), truth)
        score(noise, "GRU of readings", network(folder, noise, known, z, sigma), truth)
        score(noise, "GRU of clean positions", network(folder, "clean", known, fused, clean[1]), truth)
    with whole.writing(out) as file:
        table = csv.writer(file)
        table.writerow(["noise", "method", "horizon_s", "ed_mean_m", "ed_low_m", "ed_high_m"])
        table.writerows(rows)


if __name__ == "__main__":
    main()
