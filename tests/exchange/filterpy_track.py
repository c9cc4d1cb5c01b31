"""Tracks what `host-sim readings` wrote with FilterPy; writes what `host-sim score` reads.

    python3 filterpy_track.py readings.csv estimates.csv     # needs numpy, scipy, filterpy

A constant-velocity Kalman filter on readings converted to Cartesian coordinates.
"""

import csv
import sys

import numpy as np
from filterpy.common import Q_discrete_white_noise
from filterpy.kalman import KalmanFilter

NAMES = ("range", "elevation", "azimuth")
KEYS = ("flight", "noise_table", "noise", "rate", "step")
COVARIANCE = {"xx_m2": (0, 0), "xy_m2": (0, 2), "xz_m2": (0, 4), "yy_m2": (2, 2), "yz_m2": (2, 4), "zz_m2": (4, 4)}


def place(row):
    """Position and its covariance, to first order."""
    r, el, az = (float(row[f"{name}_{'m' if name == 'range' else 'rad'}"]) for name in NAMES)
    sigmas = [float(row[f"sigma_{name}_{'m' if name == 'range' else 'rad'}"]) for name in NAMES]
    ce, se, ca, sa = np.cos(el), np.sin(el), np.cos(az), np.sin(az)
    slopes = np.array([[ce * ca, -r * se * ca, -r * ce * sa], [ce * sa, -r * se * sa, r * ce * ca], [se, r * ce, 0]])
    return r * slopes[:, 0], slopes @ np.diag(np.square(sigmas)) @ slopes.T + 1e-9 * np.eye(3)


with open(sys.argv[1], newline="") as source, open(sys.argv[2], "w", newline="") as target:
    out = csv.writer(target)
    out.writerow([*KEYS, "x_m", "y_m", "z_m", *COVARIANCE])
    for row in csv.DictReader(source):
        now_s = int(row["time_us"]) * 1e-6
        if row["step"] == "0":
            kf, then_s = KalmanFilter(dim_x=6, dim_z=3), now_s
            kf.x, kf.P, kf.H = np.zeros(6), 25.0 * np.eye(6), np.eye(6)[::2]
            kf.x[::2], kf.P[::2, ::2] = place(row)
        elif (dt := now_s - then_s) > 0:
            kf.F = np.kron(np.eye(3), [[1.0, dt], [0.0, 1.0]])
            kf.Q, then_s = Q_discrete_white_noise(2, dt, 4.0, block_size=3) + 1e-9 * np.eye(6), now_s
            kf.predict()
            if row["range_m"]:
                kf.update(*place(row))
        out.writerow([*(row[key] for key in KEYS), *kf.x[::2], *(kf.P[at] for at in COVARIANCE.values())])
