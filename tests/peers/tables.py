"""Readings of `host-sim readings` as arrays, and estimates as `host-sim score` reads them."""

import csv

import numpy as np

import whole

CHANNELS = ("range_m", "elevation_rad", "azimuth_rad", "range_rate_mps")
COVARIANCE = {"xx_m2": (0, 0), "xy_m2": (0, 1), "xz_m2": (0, 2), "yy_m2": (1, 1), "yz_m2": (1, 2), "zz_m2": (2, 2)}


def readings(path):
    """By (noise, rate): flights' names, times in seconds, readings, sigmas, whether measured, true positions."""
    cells = {}
    with open(path, newline="") as source:
        for row in csv.DictReader(source):
            cells.setdefault((row["noise"], row["rate"]), {}).setdefault(row["flight"], []).append(row)
    return {cell: arrays(flights) for cell, flights in cells.items()}


def arrays(flights):
    """Arrays of one cell, all flights equally long; what was not measured is 0 with the flight's first sigma."""
    rows = list(flights.values())
    value = lambda columns: np.array([[[float(row[c] or "nan") for c in columns] for row in flight] for flight in rows])
    z, sigma = value(CHANNELS), value([f"sigma_{channel}" for channel in CHANNELS])
    there = ~np.isnan(z[..., 0])
    return {
        "flight": list(flights),
        "t": value(["time_us"])[..., 0] * 1e-6,
        "z": np.nan_to_num(z),
        "sigma": np.where(there[..., None], sigma, sigma[:, :1]),
        "there": there,
        "truth": value(["true_x_m", "true_y_m", "true_z_m"]),
    }


def write_estimates(path, cells, estimates):
    """Means (flights, steps, 3) and covariances (flights, steps, 3, 3) of every cell that `estimates` has."""
    with whole.writing(path) as file:
        out = csv.writer(file)
        out.writerow(["flight", "noise", "rate", "step", "x_m", "y_m", "z_m", *COVARIANCE])
        for (noise, rate), (mean, covariance) in estimates.items():
            entries = [covariance[..., i, j] for i, j in COVARIANCE.values()]
            numbers = np.concatenate([mean, np.stack(entries, axis=-1)], axis=-1)
            for name, flight in zip(cells[noise, rate]["flight"], numbers):
                out.writerows([name, noise, rate, k, *(f"{x:.9g}" for x in row)] for k, row in enumerate(flight))
