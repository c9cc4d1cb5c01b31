"""Writes peers.md, and its tables as CSV files beside it.

    python page.py WORK_FOLDER RESULTS_FOLDER
"""

import csv
import datetime
import importlib.metadata
import json
import shutil
import sys
from pathlib import Path

import numpy as np

import run
import whole

OURS = ["recursive", "EKF tuned", "IMM5"]
PACKAGES = ["jax", "jaxlib", "optax", "numpy", "scipy", "stonesoup", "filterpy"]
LEVELS, RATES = ["low", "medium", "high"], ["1.00", "0.75", "0.50"]


def read(*paths):
    rows = []
    for path in paths:
        with open(path, newline="") as file:
            rows += csv.DictReader(file)
    return rows


def notes(work, name, part="full"):
    """Times that were written beside estimates."""
    path = run.estimates(part, name, work)
    return json.loads(path.with_name(f"{path.name}.json").read_text())


def number(text, digits=3):
    value = float(text)
    return f"{value:.{digits}g}" if abs(value) < 100 else f"{value:.0f}"


def table(header, rows):
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def by_method(cells, rate):
    """Rows of the table of one rate."""
    methods = list(dict.fromkeys(row["method"] for row in cells if row["rate"] == rate))
    rows = []
    for method in [*OURS, *(name for name in methods if name not in OURS)]:
        line = [f"**{method}**" if method == "recursive" else method]
        for noise in LEVELS:
            row = next(r for r in cells if (r["method"], r["rate"], r["noise"]) == (method, rate, noise))
            line.append(
                f"{number(row['ed_mean_m'])} ({number(row['ed_low_m'])} to {number(row['ed_high_m'])}) / "
                f"{float(row['nees_mean']):.1f} / {100 * float(row['coverage90']):.0f} %"
            )
        rows.append(line)
    return table(["", *(f"{noise} noise" for noise in LEVELS)], rows)


def differences(comparisons, rate):
    """Distances of the recursive tracker minus the peer's, paired by flight."""
    names = [name for name in [*run.ESTIMATES, *run.CLASSICAL, *OURS[1:]]]
    rows = []
    for name in names:
        line = [name]
        for noise in LEVELS:
            found = [r for r in comparisons if (r["rate"], r["noise"]) == (rate, noise) and {r["a"], r["b"]} == {"recursive", name}]
            if not found:
                break
            low, middle, high = (float(found[0][key]) for key in ("low_m", "ed_difference_m", "high_m"))
            if found[0]["b"] == "recursive":
                low, middle, high = -high, -middle, -low
            said, digits = "**" if low > 0 else "", 4 if noise == "low" else 3
            line.append(f"{said}{middle:+.{digits}f} ({low:+.{digits}f} to {high:+.{digits}f}){said}")
        else:
            rows.append(line)
    return table(["recursive minus", *(f"{noise} noise" for noise in LEVELS)], rows)


def nearer(comparisons):
    """Cells in which a peer is nearer than the recursive tracker, or not told from it."""
    said = {"nearer": [], "equal": []}
    for row in comparisons:
        if "recursive" not in (row["a"], row["b"]):
            continue
        name, sign = (row["b"], 1) if row["a"] == "recursive" else (row["a"], -1)
        if name in OURS:
            continue
        low, high = sorted((sign * float(row["low_m"]), sign * float(row["high_m"])))
        where = f"{name} ({row['noise']} noise, rate {row['rate']})"
        if low > 0:
            said["nearer"].append(where)
        elif high > 0:
            said["equal"].append(where)
    return {key: ", ".join(where) or "nobody" for key, where in said.items()}


def times(work):
    ours = {row["method"]: float(row["step_us"]) for row in read(work / "score" / "full" / "runtime.csv")}
    rows = [[name, number(ours[name]), ""] for name in OURS]
    for name in [*run.ESTIMATES, *run.CLASSICAL]:
        found = notes(work, name)
        rows.append([name, number(np.mean(list(found["step_us"].values()))), f"{sum(found['training_s'].values()) / 60:.1f}"])
    return table(["", "us a step", "minutes of training or tuning"], rows)


def forecasts(work):
    rows = read(work / "forecasts.csv")
    lines = []
    for noise, method in dict.fromkeys((row["noise"], row["method"]) for row in rows):
        found = [row for row in rows if (row["noise"], row["method"]) == (noise, method)]
        cells = [f"{number(r['ed_mean_m'])} ({number(r['ed_low_m'])} to {number(r['ed_high_m'])})" for r in found]
        lines.append([f"{noise} noise" if noise != "clean" else "clean positions", method, *cells])
    return table(["seen", "", "0.5 s ahead", "1 s ahead"], lines)


def chosen(work):
    lines = []
    for name in run.CLASSICAL:
        found = notes(work, name)
        settings = ", ".join(f"{noise} {' / '.join(str(x) for x in found['chosen'][noise])}" for noise in LEVELS)
        lines.append(f"- {name}, {found['what']} {settings}")
    return "\n".join(lines)


def main():
    work, results = Path(sys.argv[1]), Path(sys.argv[2])
    folder = results / "peers"
    folder.mkdir(exist_ok=True)
    scores = [work / "score" / part for part in run.RATES]
    cells = read(*(score / "cells.csv" for score in scores))
    comparisons = read(*(score / "comparisons.csv" for score in scores))
    for name, rows in (("cells", cells), ("comparisons", comparisons)):
        with whole.writing(folder / f"{name}.csv") as file:
            out = csv.DictWriter(file, rows[0])
            out.writeheader()
            out.writerows(rows)
    shutil.copyfile(work / "forecasts.csv", folder / "forecasts.csv")
    shutil.copyfile(work / "score" / "full" / "runtime.csv", folder / "runtime.csv")
    said = nearer(comparisons)
    entries = {
        "date": datetime.date.today().isoformat(),
        "versions": ", ".join(f"{name} {importlib.metadata.version(name)}" for name in PACKAGES),
        "flights": f"{run.FLIGHTS} generated flights of seed {run.FLIGHTS_SEED}",
        "nearer": said["nearer"], "equal": said["equal"],
        "full": by_method(cells, "1.00"), "three_quarters": by_method(cells, "0.75"), "half": by_method(cells, "0.50"),
        "differences": "\n\n".join(f"Rate {rate}:\n\n{differences(comparisons, rate)}" for rate in RATES),
        "times": times(work), "forecasts": forecasts(work), "chosen": chosen(work),
    }
    text = (Path(__file__).parent / "page.md").read_text()
    for key, value in entries.items():
        text = text.replace(f"{{{key}}}", value)
    with whole.writing(results / "peers.md") as file:
        file.write(text)


if __name__ == "__main__":
    main()
