"""Tracks what `host-sim readings` wrote and says how far every target's estimates are from the truth.

    host-sim readings --quick --out out/readings
    python3 firmware/python/examples/track.py out/readings/readings.csv --plot out/track.png

Readings that came late (`late_s`) are refused where the tracker is already past their time. The plot, of the first
target, needs matplotlib.
"""

import argparse
import csv

import bnkf
import numpy as np

TRUTH = ["true_x_m", "true_y_m", "true_z_m"]


def read(path):
    """Readings and truth of every target: two arrays with a row for every sample."""
    targets = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            name = " ".join(row[key] for key in ("flight", "noise_table", "noise", "rate"))
            readings, truth = targets.setdefault(name, ([], []))
            # What is empty was not measured.
            readings.append([float(row[column] or "nan") for column in bnkf.COLUMNS])
            truth.append([float(row[column]) for column in TRUTH])
    return {name: (np.array(readings), np.array(truth)) for name, (readings, truth) in targets.items()}


def plot(path, name, estimates, truth):
    """The target from above, with the truth beside the estimates."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(7, 7))
    axes.plot(truth[:, 0], truth[:, 1], color="0.6", label="truth")
    axes.plot(estimates.position_m[:, 0], estimates.position_m[:, 1], ".-", label="estimates")
    axes.set(title=name, xlabel="east (m)", ylabel="north (m)", aspect="equal")
    axes.legend()
    figure.savefig(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("readings", help="readings.csv of host-sim readings")
    parser.add_argument("--model", default="models/recursive.bnkf", help="a blob [%(default)s]")
    parser.add_argument("--plot", metavar="FILE", help="a picture of the first target, .png or .svg")
    arguments = parser.parse_args()
    model = bnkf.Model(arguments.model)
    first = True
    for name, (readings, truth) in read(arguments.readings).items():
        estimates = bnkf.track(model, readings)
        distance_m = np.linalg.norm(estimates.position_m - truth, axis=1)
        refused = len(estimates.refused)
        print(f"{name}: {np.nanmean(distance_m):.3f} m from the truth, {len(estimates)} rows, {refused} refused")
        if first and arguments.plot:
            plot(arguments.plot, name, estimates, truth)
        first = False


if __name__ == "__main__":
    main()
