"""Training flights: a folder of CSV files as positions and velocities in one NPZ file.

    python flights.py FOLDER OUT.npz

`timestamp,tx,ty,tz` at 10 Hz without noise; velocities are the slopes of a cubic spline, 2 mm/s from the generator's own
on average, a fifth of the range-rate's sigma at low noise.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

import polar
import whole

STEP_S = 0.1


def read(folder):
    """Positions (flights, samples, 3), in the order of the files' numbers, which end their names."""
    paths = sorted(Path(folder).glob("*.csv"), key=lambda path: int(path.stem.rsplit("-", 1)[1]))
    tables = [np.loadtxt(path, delimiter=",", skiprows=1) for path in paths]
    times = np.stack([table[:, 0] for table in tables])
    if not np.allclose(times, STEP_S * np.arange(times.shape[1])):
        raise SystemExit(f"{folder}: samples are not {STEP_S} s apart")
    return np.stack([table[:, 1:] for table in tables])


def main():
    position = read(sys.argv[1])
    times = STEP_S * np.arange(position.shape[1])
    velocity = CubicSpline(times, position, axis=1)(times, 1)
    whole.save(sys.argv[2], position=position, velocity=velocity, population=polar.population(position, velocity))
    print(f"{len(position)} flights of {position.shape[1]} samples; population {polar.population(position, velocity).round(3)}")


if __name__ == "__main__":
    main()
