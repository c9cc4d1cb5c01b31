#!/usr/bin/env python3
"""Writes the tables of README.md and docs/figures.md from the files of docs/results.

A table stands between `<!-- table: NAME -->` and `<!-- end of table -->`; what lies between is replaced.

    python3 tests/results/tables.py            writes them
    python3 tests/results/tables.py --check    fails if one is not what the files say
    python3 tests/results/tables.py --facts    prints what the sentences around them say: counts, ranges, changes
"""

import csv
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
RESULTS = ROOT / "docs/results"
PAGES = ["README.md", "docs/figures.md"]
NOISES = ["low", "medium", "high"]
RATES = ["1.00", "0.75", "0.50"]
CELLS = [(noise, rate) for noise in NOISES for rate in RATES]
HORIZONS = ["0.5", "1", "2"]
RIVALS = ["EKF tuned", "IMM5", "particle"]
RADARS = [
    "no-doppler", "no-elevation", "angles-only", "range-doppler", "range-doppler-apart", "two-radars", "moving-radar",
    "late", "quantised", "student-t", "glint", "ranged", "bias",
]


def rows(folder, name):
    """The rows of one file, of the noise table in radians where there are two."""
    with open(RESULTS / folder / name, encoding="utf-8", newline="") as file:
        found = list(csv.DictReader(file))
    radians = [row for row in found if row["noise_table"] == "radians"]
    return radians or found


def cells(folder):
    """Rows of the cells by method, noise and rate."""
    return {(row["method"], row["noise"], row["rate"]): row for row in rows(folder, "cells.csv")}


def forecasts(folder):
    """Rows of the forecasts by method, noise, rate and horizon."""
    return {(row["method"], row["noise"], row["rate"], row["horizon_s"]): row for row in rows(folder, "forecasts.csv")}


def comparisons(folder, ours, theirs, horizon=None):
    """How many cells `ours` is nearer, even and farther in, by interval."""
    name = "comparisons.csv" if horizon is None else "forecast_comparisons.csv"
    counts = [0, 0, 0]
    for row in rows(folder, name):
        if horizon is not None and row["horizon_s"] != horizon:
            continue
        low, high = float(row["low_m"]), float(row["high_m"])
        if (row["a"], row["b"]) == (theirs, ours):
            low, high = -high, -low
        elif (row["a"], row["b"]) != (ours, theirs):
            continue
        counts[0 if high < 0 else 2 if low > 0 else 1] += 1
    if sum(counts) != len(CELLS):
        raise SystemExit(f"{folder}/{name}: {ours} and {theirs} are compared in {sum(counts)} cells")
    return counts


def distance(row):
    return float(row["ed_mean_m"])


def three_digits(value):
    return f"{value:#.3g}".rstrip(".")


def metres(row):
    """The mean distance, three digits."""
    return three_digits(distance(row))


def nees(row):
    """The mean NEES: no more digits than mean something."""
    value = float(row["nees_mean"])
    return f"{value:.1f}" if value < 30 else f"{value:.0f}"


def covered(row):
    """Coverage of the 90 % ellipsoid, per cent."""
    return f"{100 * float(row['coverage90']):.0f}"


def values(found, method, value):
    """A value of a method in all its cells."""
    return [value(row) for key, row in found.items() if key[0] == method]


def mean_nees(row):
    return float(row["nees_mean"])


def coverage(row):
    return 100 * float(row["coverage90"])


def table(head, lines):
    """A table of Markdown."""
    return [f"| {' | '.join(head)} |", f"|{'---|' * len(head)}"] + [f"| {' | '.join(line)} |" for line in lines]


def headline():
    """README's: five runs, and the paper's network in one."""
    runs, once = cells("runs"), cells("evaluation")
    columns = [(noise, rate) for noise in NOISES for rate in ("1.00", "0.50")]
    methods = [
        ("EKF, paper's set-up", runs, "EKF"), ("BNKF (the paper), one run", once, "BNKF"),
        ("EKF tuned", runs, "EKF tuned"), ("IMM5 tuned", runs, "IMM5"), ("IMM10", runs, "IMM10"),
        ("particle filter", runs, "particle"), ("**recursive**", runs, "recursive"),
    ]
    lines = []
    for name, found, method in methods:
        bold = "**" if method == "recursive" else ""
        line = [found[method, *cell] for cell in columns]
        lines.append([name] + [f"{bold}{metres(row)}{bold} / {nees(row)}" for row in line])
    head = ["mean distance, m / NEES (ideal 3)", "low noise, rate 1.0", "rate 0.5", "medium, 1.0", "0.5", "high, 1.0", "0.5"]
    return table(head, lines)


def gazebo():
    """README's recorded flights."""
    folder = "recorded/gazebo"
    found = cells(folder)
    lines = []
    for noise in NOISES:
        for rate in ("1.00", "0.50"):
            line = [f"{noise} noise, rate {float(rate)}"]
            for method in ("EKF tuned", "IMM10", "particle", "recursive"):
                row = found[method, noise, rate]
                bold = "**" if method == "recursive" and nearest(folder, (noise, rate)) else ""
                line.append(f"{bold}{metres(row)}{bold} / {nees(row)} / {covered(row)} %")
            lines.append(line)
    return table(["", "EKF tuned", "IMM10", "particle filter", "recursive"], lines)


def nearest(folder, cell):
    """Whether the untuned tracker is nearer than every filter in one cell, by interval."""
    pairs = []
    for row in rows(folder, "comparisons.csv"):
        pair = {row["a"], row["b"]}
        if (row["noise"], row["rate"]) == cell and "recursive" in pair and "recursive tuned" not in pair:
            sign = -1 if row["b"] == "recursive" else 1
            pairs.append(max(sign * float(row["low_m"]), sign * float(row["high_m"])) < 0)
    if not pairs:
        raise SystemExit(f"{folder}/comparisons.csv: nothing is compared in {cell}")
    return all(pairs)


def unfamiliar():
    """Flights of other kinds, filters tuned on the kind."""
    lines = []
    for name in ("darts", "bursts", "falls", "outliers"):
        found = cells(f"scenarios/{name}")
        for noise in ("low", "medium"):
            line = [f"{name}, {noise}"]
            for method in ("EKF tuned", "IMM5", "particle", "recursive"):
                row = found[method, noise, "1.00"]
                line.append(f"{metres(row)} / {nees(row)} / {covered(row)} %")
            lines.append(line)
    return table(["", "EKF tuned", "IMM5", "particle filter", "recursive, not tuned on them"], lines)


def radars():
    """Other radars."""
    lines = []
    for name in RADARS:
        folder = f"scenarios/{name}"
        found = cells(folder)
        line = [name]
        for noise in NOISES:
            line.append(" / ".join(metres(found[m, noise, "1.00"]) for m in ("EKF tuned", "IMM5", "recursive")))
        ratios, parts = values(found, "recursive", mean_nees), values(found, "recursive", coverage)
        line.append(f"{min(ratios):.1f}-{max(ratios):.1f}, {min(parts):.0f}-{max(parts):.0f} %")
        line.append(", ".join("/".join(map(str, comparisons(folder, "recursive", m))) for m in ("EKF tuned", "IMM5")))
        lines.append(line)
    return table(["scenario", "low noise", "medium", "high", "tracker: NEES, coverage", "EKF, IMM5"], lines)


def ahead():
    """Forecasts of built-in flights."""
    found = forecasts("runs")
    rows_of = lambda method, noise: [found[method, noise, "1.00", horizon] for horizon in HORIZONS]
    text = lambda row: f"{metres(row)}/{covered(row)}"
    return table(["", "low noise", "medium", "high"], by_noise(RIVALS + ["recursive"], rows_of, text))


def ansfl():
    """The ANSFL recordings."""
    found = cells("recorded/ansfl")
    rows_of = lambda method, noise: [found[method, noise, rate] for rate in RATES]
    text = lambda row: f"{metres(row)}/{nees(row)}/{covered(row)}"
    return table(["", "low", "medium", "high"], by_noise(RIVALS + ["recursive", "recursive tuned"], rows_of, text))


def by_noise(methods, rows_of, text):
    """A line a method, a column a noise level, in which `text` says each of `rows_of` method and noise."""
    return [
        ["particle filter" if method == "particle" else method]
        + [", ".join(map(text, rows_of(method, noise))) for noise in NOISES]
        for method in methods
    ]


def counter_uas():
    """The counter-UAS radar."""
    found = cells("counter-uas")
    lines = []
    for method in ("EKF tuned", "IMM5", "recursive"):
        line = [method]
        for noise in NOISES:
            row = [found[method, noise, rate] for rate in ("1.00", "0.50", "0.10")]
            ratios = sorted(map(mean_nees, row))
            line.append(f"{' / '.join(map(metres, row))}, {ratios[0]:.1f} to {ratios[-1]:.1f}")
        lines.append(line)
    return table(["", "0.3 degrees, 10 / 5 / 1 Hz", "0.5 degrees", "0.7 degrees"], lines)


def doubt():
    """Doubt about weights and doubt that is updated in flight, behind the gate and the restarts of the firmware."""
    nll = lambda row: float(row["nll"])
    lines = []
    for world in ("paper", "fast", "darts", "bursts", "falls", "outliers"):
        found = cells(f"doubt/{world}")
        alone, passes = cells(f"doubt/{world}/alone"), cells(f"doubt/{world}/passes")
        columns = [(found, method) for method in ("EKF tuned", "IMM5", "IMM10", "particle")]
        columns += [(alone, "recursive"), (found, "recursive"), (passes, "recursive"), (found, "rec. moments")]
        for noise in NOISES:
            line = [f"{'as trained' if world == 'paper' else world}, {noise}"]
            for of, method in columns:
                mean = lambda value: sum(value(of[method, noise, rate]) for rate in RATES) / len(RATES)
                line.append(f"{three_digits(mean(distance))} / {mean(coverage):.0f} / {mean(nll):.2f}")
            lines.append(line)
    head = ["", "EKF tuned", "IMM5", "IMM10", "particle filter", "network's noise alone", "recursive", "16 passes", "moments"]
    return table(head, lines)


TABLES = {
    "headline": headline, "gazebo": gazebo, "unfamiliar": unfamiliar, "radars": radars, "forecasts": ahead,
    "ansfl": ansfl, "counter-uas": counter_uas, "doubt": doubt,
}
BLOCK = re.compile(r"(<!-- table: ([a-z-]+) -->\n).*?(\n<!-- end of table -->)", re.S)


def written(page):
    """A page with its tables as the files say, and their names."""
    names = []

    def block(match):
        names.append(match[2])
        return match[1] + "\n" + "\n".join(TABLES[match[2]]()) + "\n" + match[3]

    return BLOCK.sub(block, page), names


def span(numbers, digits):
    return f"{min(numbers):.{digits}f} to {max(numbers):.{digits}f}"


def facts():
    """What the sentences say."""
    runs, filters = cells("runs"), ["EKF", "EKF tuned", "UKF tuned", "CKF tuned", "IMM5", "IMM10", "particle"]
    print("built-in, five runs: NEES", span(values(runs, "recursive", mean_nees), 1), "coverage",
          span(values(runs, "recursive", coverage), 1))
    print("  nearer/even/farther:", {m: comparisons("runs", "recursive", m) for m in filters})
    for horizon in HORIZONS:
        print(f"  {horizon} s ahead:", {m: comparisons("runs", "recursive", m, horizon) for m in filters})
    found = forecasts("runs")
    print("  forecasts: NEES", span(values(found, "recursive", mean_nees), 1), "coverage",
          span(values(found, "recursive", coverage), 1))
    for name in ("gazebo", "ansfl"):
        folder = f"recorded/{name}"
        found, future = cells(folder), forecasts(folder)
        rivals = ["EKF tuned", "UKF tuned", "IMM5", "IMM10", "particle"]
        for ours in ("recursive", "recursive tuned"):
            print(f"{name}, {ours}: NEES", span(values(found, ours, mean_nees), 2), "coverage",
                  span(values(found, ours, coverage), 1))
            print("  nearer/even/farther:", {m: comparisons(folder, ours, m) for m in rivals})
            for horizon in HORIZONS:
                near = {key: row for key, row in future.items() if key[3] == horizon}
                print(f"  {horizon} s ahead: NEES", span(values(near, ours, mean_nees), 1), "coverage",
                      span(values(near, ours, coverage), 0), {m: comparisons(folder, ours, m, horizon) for m in rivals})
                print("    rate 1.0, ours and EKF tuned:",
                      [f"{noise} {metres(near[ours, noise, '1.00', horizon])} {metres(near['EKF tuned', noise, '1.00', horizon])}"
                       for noise in NOISES])
        print("  tuned beside untuned:", comparisons(folder, "recursive tuned", "recursive"))
        change = [(float(found["recursive tuned", *cell]["ed_mean_m"]) / float(found["recursive", *cell]["ed_mean_m"]) - 1) * 100
                  for cell in CELLS]
        nats = [float(found["recursive tuned", *cell]["nll"]) - float(found["recursive", *cell]["nll"]) for cell in CELLS]
        print("   ", span(change, 1), "%, mean", f"{sum(change) / 9:.1f};", span(nats, 2), "nats, mean", f"{sum(nats) / 9:.2f}")
        less = [(1 - float(found["recursive", *cell]["ed_mean_m"]) / float(found["EKF tuned", *cell]["ed_mean_m"])) * 100
                for cell in CELLS]
        print("    nearer than EKF tuned by", [f"{x:.0f}" for x in less], "%")
    wild = [row for row in rows("scenarios/agile", "bins.csv") if row["method"] == "recursive" and int(row["steps"]) > 2000]
    inside = [row for row in wild if float(row["high"] or 99) <= {"speed": 12, "acceleration": 20}[row["by"]]]
    whole = [row for row in inside if row["rate"] == "all"]
    print("agile, all rates together: NEES", span(list(map(mean_nees, whole)), 1), "coverage", span(list(map(coverage, whole)), 0))
    apart = [row for row in inside if row["rate"] != "all"]
    print(f"  {len(apart)} bins by rate; NEES above 3.8 or covered below 85:",
          [(row["noise"], row["rate"], row["by"], row["low"], nees(row), covered(row)) for row in apart
           if mean_nees(row) > 3.8 or coverage(row) < 85])
    beyond = [row for row in wild if row not in inside and (mean_nees(row) > 3.8 or coverage(row) < 85)]
    print("  beyond:", [(row["noise"], row["rate"], row["by"], row["low"], nees(row), covered(row)) for row in beyond])
    print("  EKF tuned, IMM5 in the same bins:", [span([mean_nees(row) for row in rows("scenarios/agile", "bins.csv")
          if row["method"] == m and (row["noise"], row["rate"], row["by"], row["low"]) in
          {(r["noise"], r["rate"], r["by"], r["low"]) for r in inside}], 1) for m in ("EKF tuned", "IMM5")])
    for name in RADARS + ["darts", "bursts", "falls", "outliers", "agile"]:
        found = cells(f"scenarios/{name}")
        print(f"{name}: NEES by cell", " ".join(f"{mean_nees(found['recursive', *cell]):.2f}" for cell in CELLS), "covered",
              " ".join(covered(found["recursive", *cell]) for cell in CELLS))
    apart = cells("scenarios/range-doppler-apart")
    for m in ("EKF tuned", "IMM5"):
        farther = [float(apart["recursive", "high", r]["ed_mean_m"]) / float(apart[m, "high", r]["ed_mean_m"]) for r in RATES]
        print("range-doppler-apart, high noise, farther than", m, [f"{100 * (x - 1):.0f} %" for x in farther])
    biased = cells("scenarios/bias")
    for m in ("EKF tuned", "recursive"):
        print("bias,", m, "low and medium: NEES",
              span([mean_nees(biased[m, n, r]) for n in ("low", "medium") for r in RATES], 1))
    uas = cells("counter-uas")
    print("counter-UAS:", {m: comparisons("counter-uas", "recursive", m) for m in ("EKF tuned", "IMM5", "IMM10", "converted")},
          "rejected", {m: sum(values(uas, m, lambda row: int(row["rejected"]))) for m in ("EKF tuned", "IMM5", "recursive")})
    for m in ("EKF tuned", "IMM5"):
        ratios = [1 - float(uas["recursive", n, r]["ed_mean_m"]) / float(uas[m, n, r]["ed_mean_m"])
                  for n in NOISES for r in ("1.00", "0.50", "0.10")]
        print("  nearer than", m, f"by {100 * min(ratios):.0f} to {100 * max(ratios):.0f} %")


def main():
    if sys.argv[1:] == ["--facts"]:
        facts()
        return 0
    if sys.argv[1:] not in ([], ["--check"]):
        sys.exit(__doc__)
    stale, seen = {}, []
    for name in PAGES:
        page = (ROOT / name).read_text(encoding="utf-8")
        new, names = written(page)
        seen += names
        if new != page:
            stale[name] = new
    if sorted(seen) != sorted(TABLES):
        sys.exit(f"tables {sorted(seen)} stand in the pages, {sorted(TABLES)} are known")
    if sys.argv[1:] and stale:
        sys.exit(f"not what docs/results says, python3 tests/results/tables.py writes it: {', '.join(stale)}")
    for name, new in stale.items():
        (ROOT / name).write_text(new, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
