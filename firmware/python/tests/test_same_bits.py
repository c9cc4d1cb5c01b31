"""Every number is that of the Rust program, to the last bit."""

import csv
import os
import pathlib
import subprocess
import sys

import bnkf
import numpy as np

TWIN = pathlib.Path(os.environ["BNKF_TWIN"])
EXAMPLE = pathlib.Path(__file__).parents[1] / "examples" / "track.py"
MODEL = pathlib.Path(__file__).parents[3] / "models" / "recursive.bnkf"


def targets():
    """Lines and rows of the readings of every target."""
    found = {}
    with open(TWIN / "readings.csv", newline="") as file:
        for line, row in enumerate(csv.DictReader(file), start=2):
            target = row["flight"], row["noise"], row["rate"]
            numbers = [float(row[column] or "nan") for column in bnkf.COLUMNS]
            lines, rows = found.setdefault(target, ([], []))
            lines.append(line)
            rows.append(numbers)
    return found.values()


def estimates():
    """Rows of the Rust program by their line of the readings."""
    with open(TWIN / "estimates.csv", newline="") as file:
        return {int(row["line"]): row for row in csv.DictReader(file)}


POSITION = ["x_m", "y_m", "z_m"]
COVARIANCE = ["xx_m2", "xy_m2", "xz_m2", "xy_m2", "yy_m2", "yz_m2", "xz_m2", "yz_m2", "zz_m2"]
VELOCITY = ["vx_mps", "vy_mps", "vz_mps"]
DOUBT = ["manoeuvre", "wrong_reading"]


def bits(numbers):
    return np.asarray(numbers, dtype=np.float32).reshape(-1).view(np.uint32).tolist()


def rust_bits(row, columns):
    return bits([row[column] or "nan" for column in columns])


def test_of_a_whole_flight(model):
    theirs = estimates()
    compared, modes = 0, set()
    for lines, rows in targets():
        ours = bnkf.track(model, np.array(rows))
        assert len(ours) == len(rows)
        for i, line in enumerate(lines):
            row = theirs[line]
            assert bits(ours.position_m[i]) == rust_bits(row, POSITION)
            assert bits(ours.covariance_m2[i]) == rust_bits(row, COVARIANCE)
            assert bits(ours.velocity_mps[i]) == rust_bits(row, VELOCITY)
            assert bits([ours.manoeuvre[i], ours.outlier[i]]) == rust_bits(row, DOUBT)
            if row["nis"]:
                assert bits(ours.nis[i]) == rust_bits(row, ["nis"])
            assert ours.mode[i] == (row["mode"] or "refused")
            assert ours.outside[i] == (row["outside"] == "true")
            assert ours.refused.get(i, "") == row["refused"]
            assert ours.time_us[i] == int(row["time_us"])
            compared += 1
            modes.add(row["mode"])
    assert compared == len(theirs) > 5000
    assert {"started", "tracking", "coasting"} <= modes


def test_of_single_steps(model):
    theirs = estimates()
    for lines, rows in list(targets())[::5]:
        tracker = bnkf.Tracker(model)
        for line, (time_us, *numbers) in zip(lines, rows):
            row = theirs[line]
            sensed = lambda i: None if np.isnan(numbers[i]) else (numbers[i], numbers[i + 4])
            four = [sensed(i) for i in range(4)]
            try:
                if four == [None] * 4:
                    estimate = tracker.coast(int(time_us))
                else:
                    estimate = tracker.step(int(time_us), *four, numbers[8:11], np.array(numbers[11:14]))
            except bnkf.StepError as error:
                assert str(error) == row["refused"]
                continue
            assert not row["refused"]
            assert bits(estimate.position_m) == rust_bits(row, POSITION)
            assert bits(estimate.covariance_m2) == rust_bits(row, COVARIANCE)
            assert bits(estimate.velocity_mps) == rust_bits(row, VELOCITY)
            assert bits([estimate.doubt.manoeuvre, estimate.doubt.outlier]) == rust_bits(row, DOUBT)
            assert (estimate.mode, estimate.time_us) == (row["mode"], int(row["time_us"]))
            assert estimate.outside == (row["outside"] == "true")


def test_the_example_tracks_them():
    command = [sys.executable, EXAMPLE, TWIN / "readings.csv", "--model", MODEL]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    lines = said.splitlines()
    assert len(lines) == len(targets())
    best = min(float(line.split(": ")[1].split(" m")[0]) for line in lines)
    assert 0.01 < best < 0.5
