"""Single steps, what is refused, and tracks as bytes."""

import bnkf
import flight
import numpy as np
import pytest


def run(tracker, rows):
    """The estimates of rows, one call each."""
    return [
        tracker.coast(int(row[0])) if np.isnan(row[1]) else tracker.step(int(row[0]), **flight.channels(row))
        for row in rows
    ]


def test_models_say_what_they_are(model, memoryless, tmp_path):
    assert (model.kind, memoryless.kind) == ("recursive", "memoryless")
    assert (model.passes, memoryless.passes) == (1, 100)
    assert model.checksum != memoryless.checksum
    with pytest.raises(FileNotFoundError, match="none.bnkf"):
        bnkf.Model(tmp_path / "none.bnkf")
    with pytest.raises(bnkf.ModelError, match="blob is truncated: 24 bytes needed, 15 given"):
        bnkf.Model(b"no model at all")
    with pytest.raises(TypeError, match="expected str, bytes or os.PathLike object, not int"):
        bnkf.Model(3)


def test_estimates_have_shapes_and_modes(model):
    estimates = run(bnkf.Tracker(model), flight.readings())
    assert [e.mode for e in estimates[:5]] == ["started"] + 3 * ["tracking"] + ["coasting"]
    last = estimates[-2]
    for array, shape in [
        (last.position_m, (3,)),
        (last.velocity_mps, (3,)),
        (last.acceleration_mps2, (3,)),
        (last.covariance_m2, (3, 3)),
        (last.covariance, (9, 9)),
    ]:
        assert (array.dtype, array.shape) == (np.float32, shape)
    assert np.linalg.eigvalsh(last.covariance_m2.astype(float)).min() > 0
    assert np.array_equal(last.covariance[:3, :3], last.covariance_m2)
    assert 0 < last.nis < 50
    assert not last.outside
    # x east at cos, y north at sin, as the radar's azimuth says.
    turn = 0.1 * 0.1 * 58
    truth = [30 * np.cos(turn), 30 * np.sin(turn), 10 + 2 * np.sin(turn)]
    assert np.linalg.norm(last.position_m - truth) < 0.5


def test_a_memoryless_model_has_no_velocity(memoryless):
    rows = flight.readings(4)
    last = run(bnkf.Tracker(memoryless), rows)[-1]
    assert last.velocity_mps is last.acceleration_mps2 is last.covariance is None
    assert np.isnan(bnkf.track(memoryless, rows).velocity_mps).all()


def test_forecasts_and_likelihoods_leave_the_track_as_it_is(model):
    rows = flight.readings()
    tracker = bnkf.Tracker(model)
    run(tracker, rows[:22])
    before = tracker.to_bytes()
    ahead = tracker.forecast(np.array([3_600_000, 4_100_000]))
    assert [e.time_us for e in ahead] == [3_600_000, 4_100_000]
    assert np.trace(ahead[1].covariance_m2) > np.trace(ahead[0].covariance_m2)
    plot = flight.channels(rows[22])
    fit = tracker.likelihood(int(rows[22][0]), **plot)
    assert fit.degrees == 4 and fit.passes_gate and fit.nis < 30
    plot["range_rate"] = None
    plot["range"] = (60.0, 0.1)
    other = tracker.likelihood(int(rows[22][0]), **plot)
    assert other.degrees == 3 and not other.passes_gate
    assert np.isnan(other.innovation).tolist() == [False, False, False, True]
    assert other.innovation[2] == pytest.approx(30, abs=3)
    assert other.ln_likelihood < fit.ln_likelihood
    assert tracker.to_bytes() == before


def test_a_track_goes_on_from_its_bytes(model, memoryless):
    rows = flight.readings()
    tracker = bnkf.Tracker(model, 3, seed=7)
    run(tracker, rows[:30])
    data = tracker.to_bytes()
    again = bnkf.Tracker.from_bytes(model, data)
    assert again.latest_us == tracker.latest_us == rows[29][0]
    run(again, rows[30:])
    run(tracker, rows[30:])
    assert again.to_bytes() == tracker.to_bytes() != data
    with pytest.raises(bnkf.TrackBytesError, match="checksum"):
        bnkf.Tracker.from_bytes(model, data[:-1] + bytes([data[-1] ^ 1]))
    with pytest.raises(bnkf.TrackBytesError, match="3 bytes; a track has 1088"):
        bnkf.Tracker.from_bytes(model, b"abc")
    with pytest.raises(bnkf.TrackBytesError, match="does not run on a Memoryless"):
        bnkf.Tracker.from_bytes(memoryless, data)
    tracker.reset()
    assert tracker.latest_us is None


def test_refusals_have_the_crates_text_and_change_nothing(model):
    tracker = bnkf.Tracker(model)
    with pytest.raises(bnkf.StepError, match="^no measurement yet$"):
        tracker.coast(1)
    run(tracker, flight.readings(10))
    before = tracker.to_bytes()
    nan = float("nan")
    for said, call in [
        ("time_us went back from 1900000 to 1$", lambda: tracker.coast(1)),
        (r"measurement: range \[m\] is not finite", lambda: tracker.step(2_000_000, range=(nan, 1))),
        (r"measurement: sigma of azimuth", lambda: tracker.step(2_000_000, azimuth=(0, 1e-9))),
        ("measurement: nothing was measured", lambda: tracker.step(2_000_000)),
        (
            "measurement: sensor.position_m is not within",
            lambda: tracker.step(2_000_000, range=(1, 1), sensor_position_m=[2e6, 0, 0]),
        ),
    ]:
        with pytest.raises(bnkf.StepError, match=said):
            call()
    assert tracker.to_bytes() == before
    assert issubclass(bnkf.StepError, bnkf.BnkfError) and issubclass(bnkf.BnkfError, ValueError)


def test_settings_are_told_apart(model, memoryless):
    rows = flight.readings(20)
    last = lambda *a, **k: bnkf.track(model, rows, *a, **k).position_m[-2].tobytes()
    assert last() == last("mean") == last(1) == last(None, seed=2)
    assert last(16) == last(16, seed=1) != last(16, seed=2)
    different = [last(), last(16), last(16, frozen_spreads=True), last("moments")]
    assert len(set(different)) == len(different)
    alone = bnkf.track(memoryless, rows, 2, correction="none").position_m
    assert not np.array_equal(alone, bnkf.track(memoryless, rows, 2).position_m, equal_nan=True)
    for said, arguments in [
        ("inference: 'best' is not \"mean\", \"moments\" or a number", {"inference": "best"}),
        ("inference: 2.5 is not", {"inference": 2.5}),
        ("passes: 70000 is not in 1..=10000", {"inference": 70_000}),
        ("passes: 0 is not in 1..=10000", {"inference": 0}),
        ("correction: \"half\" is not one", {"correction": "half"}),
        ("correction: None does not fit a recursive blob", {"correction": "none"}),
    ]:
        with pytest.raises(bnkf.SettingsError, match=said):
            bnkf.Tracker(model, **arguments)
