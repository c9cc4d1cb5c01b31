"""A whole flight at once."""

import threading
import time

import bnkf
import flight
import numpy as np
import pytest
from numpy.lib import recfunctions


class Frame:
    """What a data frame is to NumPy: numbers in the order that its columns happen to have."""

    def __init__(self, rows, names):
        order = range(len(names))[::-1]
        self.columns = [names[i] for i in order]
        self.rows = rows[:, order]

    def __getitem__(self, name):
        return self.rows[:, self.columns.index(name)]

    def __array__(self, *_, **__):
        return self.rows


def same(first, second):
    return np.array_equal(first.position_m, second.position_m) and np.array_equal(first.mode, second.mode)


def test_every_form_of_readings_is_the_same_flight(model):
    rows = flight.readings()
    expected = bnkf.track(model, rows)
    assert (expected.mode == "coasting").sum() == 12
    with_sensor = np.column_stack([rows, np.zeros((len(rows), 6))])
    assert same(bnkf.track(model, with_sensor), expected)
    assert same(bnkf.track(model, np.asfortranarray(rows)), expected)
    assert same(bnkf.track(model, rows.tolist()), expected)
    named = recfunctions.unstructured_to_structured(rows, names=list(bnkf.COLUMNS[:9]))
    named = recfunctions.append_fields(named, "truth", rows[:, 1], usemask=False)
    assert same(bnkf.track(model, named), expected)
    deaf = rows.copy()
    deaf[:, 4] = np.nan
    without = recfunctions.drop_fields(named, ["range_rate_mps", "sigma_range_rate_mps"])
    assert same(bnkf.track(model, without), bnkf.track(model, deaf))
    assert not same(bnkf.track(model, deaf), expected)
    # Columns in another order, with names, as a data frame has them.
    assert same(bnkf.track(model, Frame(rows, bnkf.COLUMNS[:9])), expected)
    with_sensor[:, 9] = 5
    moved = bnkf.track(model, with_sensor)
    assert np.allclose(moved.position_m[-2] - expected.position_m[-2], [5, 0, 0], atol=0.2)


def test_refused_rows_are_named_and_the_track_goes_on(model):
    rows = flight.readings(20)
    rows[7, 5] = np.nan
    rows[12, 0] = 0
    said = bnkf.track(model, rows)
    assert said.refused == {
        7: "measurement: range [m] is not finite",
        12: "time_us went back from 2100000 to 0",
    }
    assert (said.mode[[7, 8, 12, 13]] == ["refused", "tracking", "refused", "tracking"]).all()
    assert np.isnan(said.position_m).any(axis=1).nonzero()[0].tolist() == [7, 12]
    assert len(bnkf.track(model, rows[:0])) == 0


@pytest.mark.parametrize(
    ("readings", "said"),
    [
        (np.zeros((3, 8)), r"shape \[3, 8\] is neither"),
        (np.zeros(9), r"shape \[9\] is neither"),
        (np.full((1, 9), np.nan), "row 0: time_us NaN is no whole number"),
        (np.full((1, 9), 0.5), "row 0: time_us 0.5 is no whole number"),
        (np.full((1, 9), -1.0), "row 0: time_us -1 is no whole number"),
        (np.full((1, 9), 2.0**53), "row 0: time_us 9007199254740992 is no whole number below"),
        (np.ma.masked_invalid(np.zeros((3, 9))), "a masked array"),
        (np.zeros(3, dtype=[("range_m", float)]), "no column time_us"),
        (np.zeros((3, 2), dtype=[("time_us", float)]), r"shape \[3, 2\] of named columns"),
    ],
)
def test_what_holds_no_readings_is_refused(model, readings, said):
    with pytest.raises(ValueError, match=said):
        bnkf.track(model, readings)


def test_other_threads_run_meanwhile(model):
    rows = flight.readings(30_000)
    worker = threading.Thread(target=bnkf.track, args=(model, rows))
    worker.start()
    naps = 0
    while worker.is_alive() and naps < 20:
        time.sleep(0.001)
        naps += 1
    worker.join()
    assert naps == 20
