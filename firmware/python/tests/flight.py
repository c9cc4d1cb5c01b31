"""A target that circles the radar, and what the radar says of it."""

import numpy as np

SIGMAS = [0.1, 0.005, 0.005, 0.05]


def readings(samples=60, seed=1):
    """Rows of bnkf.COLUMNS without the sensor's, ten a second; every fifth is a gap."""
    random = np.random.default_rng(seed)
    time_s = 0.1 * np.arange(samples)
    turn = 0.1 * time_s
    height = 10 + 2 * np.sin(turn)
    range_m = np.hypot(30, height)
    rate = height * 0.2 * np.cos(turn) / range_m
    azimuth = np.arctan2(np.sin(turn), np.cos(turn))
    values = np.stack([range_m, np.arctan2(height, 30), azimuth, rate], axis=1)
    values += random.normal(size=values.shape) * SIGMAS
    values[4::5] = np.nan
    sigmas = np.broadcast_to(SIGMAS, values.shape)
    return np.column_stack([1e6 + 1e5 * np.arange(samples), values, sigmas])


def channels(row):
    """The arguments of Tracker.step for a row."""
    names = ["range", "elevation", "azimuth", "range_rate"]
    return {name: (row[1 + i], row[5 + i]) for i, name in enumerate(names)}
