//! Nothing false leaves the tracker: inputs that once gave a wrong or silent answer, with the right
//! one, on every shipped blob, the default one first.

mod hovering;

use bnkf::{
    Channel, Estimate, Measurement, MeasurementError, Mode, Sensor, StepError, WrappingClock,
};
use hovering::{RECURSIVE, distance, sensed, tracker, with, z};
use nalgebra::SMatrix;

const COUNTER_UAS: &[u8] = include_bytes!("../models/recursive-counter-uas.bnkf");
const BNKF: &[u8] = include_bytes!("../models/bnkf.bnkf");
const BNKFE: &[u8] = include_bytes!("../models/bnkfe.bnkf");
const EVERY: [&[u8]; 4] = [RECURSIVE, COUNTER_UAS, BNKF, BNKFE];

/// Finite, symmetric, and positive definite for single and double precision.
fn assert_sound(estimate: &Estimate) {
    assert!(estimate.position_m.iter().all(|x| x.is_finite()));
    assert!(estimate.nis.is_finite() && estimate.nis >= 0.0);
    let block = SMatrix::<f32, 3, 3>::from_fn(|i, j| estimate.covariance_m2[i][j]);
    assert!(
        block == block.transpose() && block.cholesky().is_some(),
        "{block}"
    );
    assert!(block.map(f64::from).cholesky().is_some(), "{block}");
    if let Some(motion) = &estimate.motion {
        let full = SMatrix::<f32, 9, 9>::from_fn(|i, j| motion.covariance[i][j]);
        assert!(
            full == full.transpose() && full.cholesky().is_some(),
            "{full}"
        );
        assert!(full.map(f64::from).cholesky().is_some(), "{full}");
        let vectors = motion.velocity_mps.iter().chain(&motion.acceleration_mps2);
        assert!(vectors.into_iter().all(|x| x.is_finite()));
    }
}

/// Root of the trace of the covariance of the position, m.
fn sigma(estimate: &Estimate) -> f32 {
    (0..3)
        .map(|i| estimate.covariance_m2[i][i])
        .sum::<f32>()
        .sqrt()
}

#[test]
fn a_target_at_any_elevation_is_tracked() {
    for elevation in [-1.55, -1.4, -0.8, -0.3, 0.0, 0.8, 1.4, 1.55] {
        let mut tracker = tracker(RECURSIVE);
        let truth = bnkf::radar::position(33.0_f32, elevation, 0.5);
        for i in 0..100 {
            let measurement = with(z(i), |m| m.elevation = sensed(elevation, 0.005));
            let estimate = tracker.step(&measurement).expect("a step");
            assert_sound(&estimate);
            let expected = if i == 0 {
                Mode::Started
            } else {
                Mode::Tracking
            };
            assert_eq!(estimate.mode, expected, "{elevation}, step {i}");
            assert!(
                distance(&estimate, truth) < 0.5,
                "{elevation}: {estimate:?}"
            );
        }
    }
}

#[test]
fn a_direction_beyond_the_vertical_is_the_same_point() {
    let mut plain = tracker(RECURSIVE);
    let mut beyond = tracker(RECURSIVE);
    for i in 0..50 {
        let pi = core::f32::consts::PI;
        let named = with(z(i), |m| {
            m.elevation = sensed(pi - 0.4, 0.005);
            m.azimuth = sensed(0.5 - pi, 0.005);
        });
        let (a, b) = (plain.step(&z(i)).unwrap(), beyond.step(&named).unwrap());
        assert_eq!(a.mode, b.mode);
        assert!(distance(&a, b.position_m) < 1e-3);
    }
    let refused = with(z(50), |m| m.elevation = sensed(3.2, 0.005));
    assert_eq!(
        beyond.step(&refused).unwrap_err(),
        StepError::Measurement(MeasurementError::OutOfRange(Channel::Elevation))
    );
}

#[test]
fn a_long_coast_is_as_unsure_as_many_short_ones() {
    for bytes in [RECURSIVE, COUNTER_UAS] {
        for length_s in [9.0_f32, 10.001, 30.0, 60.0] {
            let end_us = 900_000 + (length_s * 1e6) as u64;
            let (mut once, mut often) = (tracker(bytes), tracker(bytes));
            for i in 0..10 {
                once.step(&z(i)).unwrap();
                often.step(&z(i)).unwrap();
            }
            let long = once.coast(end_us).expect("one coast");
            let mut time_us = 900_000;
            while time_us + 100_000 < end_us {
                time_us += 100_000;
                assert_sound(&often.coast(time_us).expect("short coast"));
            }
            let short = often.coast(end_us).expect("last short coast");
            assert_sound(&long);
            assert_eq!((long.mode, long.time_us), (Mode::Coasting, end_us));
            // The network is asked at other intervals, so its schedules differ a little.
            let ratio = sigma(&long) / sigma(&short);
            assert!((0.8..1.25).contains(&ratio), "{length_s} s: {ratio}");
            let apart = distance(&long, short.position_m);
            assert!(apart < 0.25 * sigma(&short), "{length_s} s: {apart}");
            assert!(
                sigma(&long) > 0.3 * length_s,
                "{length_s} s: {}",
                sigma(&long)
            );
        }
    }
}

/// Its parts are of up to half a minute: a network's answer for the next second must not turn the motion round in
/// them, again and again.
#[test]
fn a_long_forecast_stays_where_a_coast_does() {
    let medium = |i: u64| {
        with(z(i), |m| {
            m.range = sensed(33.0, 1.0);
            (m.elevation, m.azimuth) = (sensed(0.4, 0.02), sensed(0.5, 0.02));
            m.range_rate = sensed(0.0, 0.3);
        })
    };
    let mut tracker = tracker(RECURSIVE);
    for i in 0..100 {
        tracker.step(&medium(i)).unwrap();
    }
    let times_us = [20, 40, 60].map(|ahead_s| 9_900_000 + 1_000_000 * ahead_s);
    let forecasts = tracker.forecasts(&times_us).expect("known");
    for (forecast, time_us) in forecasts.iter().zip(times_us) {
        let coast = tracker.coast(time_us).expect("a coast");
        let (unsure, sure) = (sigma(forecast), sigma(&coast));
        assert!(
            (0.5..2.0).contains(&(unsure / sure)),
            "{time_us}: {unsure} m, coasting {sure} m"
        );
        let apart = distance(forecast, coast.position_m);
        assert!(apart < sure, "{time_us}: {apart} m, {sure} m");
    }
}

#[test]
fn a_coast_of_more_than_a_minute_is_refused_and_changes_nothing() {
    for bytes in EVERY {
        let mut tracker = tracker(bytes);
        for i in 0..10 {
            tracker.step(&z(i)).unwrap();
        }
        let refused = |given_us| StepError::TimeTooFarAhead {
            latest_us: 900_000,
            given_us,
        };
        for given_us in [60_900_001, 3_600_000_000, u64::MAX] {
            assert_eq!(tracker.coast(given_us).unwrap_err(), refused(given_us));
        }
        assert_eq!(tracker.step(&z(10)).unwrap().mode, Mode::Tracking);
    }
}

/// An hour of short coasts: nothing overflows, and doubt never shrinks.
#[test]
fn an_hour_without_a_measurement_stays_sound() {
    for bytes in EVERY {
        let mut tracker = tracker(bytes);
        for i in 0..10 {
            tracker.step(&z(i)).unwrap();
        }
        let mut last = 0.0;
        for minute in 1..=60 {
            match tracker.coast(900_000 + minute * 60_000_000) {
                Ok(estimate) => {
                    assert_sound(&estimate);
                    assert!(sigma(&estimate) >= last);
                    last = sigma(&estimate);
                }
                Err(error) => {
                    assert_eq!(error, StepError::Lost);
                    assert_eq!(
                        tracker.coast(900_000 + minute * 60_000_000).unwrap_err(),
                        StepError::NotStarted
                    );
                    break;
                }
            }
        }
        assert!(last > 30.0, "{last}");
    }
}

#[test]
fn a_target_faster_than_the_model_is_tracked_and_said_to_be_outside() {
    for speed in [61.0_f32, 80.0, 100.0] {
        let mut tracker = tracker(COUNTER_UAS);
        let (mut tracked, mut outside, mut nees) = (0, 0, 0.0);
        for i in 0..100 {
            let east = -500.0 + speed * i as f32 * 0.1;
            let truth = [east, 800.0, 200.0];
            let level = east.hypot(800.0);
            let range = level.hypot(200.0);
            let measurement = Measurement {
                time_us: i * 100_000,
                range: sensed(range, 3.0),
                elevation: sensed(200.0_f32.atan2(level), 0.005),
                azimuth: sensed(800.0_f32.atan2(east), 0.005),
                range_rate: sensed(east * speed / range, 0.2),
                sensor: Sensor::ORIGIN,
            };
            let estimate = tracker.step(&measurement).unwrap();
            assert_sound(&estimate);
            if i >= 20 {
                tracked += usize::from(estimate.mode == Mode::Tracking);
                outside += usize::from(estimate.outside);
                nees += (distance(&estimate, truth) / sigma(&estimate)).powi(2);
            }
        }
        assert_eq!(tracked, 80, "{speed} m/s");
        // The model's bound is 45 m/s, a parameter of its blob.
        assert_eq!(outside, 80, "{speed} m/s");
        assert!(nees / 80.0 < 3.0, "{nees}");
        let (before, after) = (tracker.coast(10_900_000), tracker.coast(14_900_000));
        let (before, after) = (before.unwrap(), after.unwrap());
        let moved = after.position_m[0] - before.position_m[0];
        assert!((moved / (4.0 * speed) - 1.0).abs() < 0.2, "{moved}");
        assert!(sigma(&after) > 10.0);
    }
}

#[test]
fn a_target_inside_is_said_to_be_inside() {
    let mut tracker = tracker(RECURSIVE);
    for i in 0..20 {
        assert!(!tracker.step(&z(i)).unwrap().outside);
    }
}

#[test]
fn absurd_values_are_refused_by_name_and_cost_nothing() {
    use Channel::{Azimuth, Range, RangeRate};
    let out = |channel| StepError::Measurement(MeasurementError::OutOfRange(channel));
    let blunt = |channel| StepError::Measurement(MeasurementError::Sigma(channel));
    for bytes in EVERY {
        let mut tracker = tracker(bytes);
        for i in 0..5 {
            tracker.step(&z(i)).unwrap();
        }
        let absurd = [
            (with(z(5), |m| m.range = sensed(1e38, 0.1)), out(Range)),
            (with(z(5), |m| m.range = sensed(3e38, 0.1)), out(Range)),
            (with(z(5), |m| m.range = sensed(33.0, 1e20)), blunt(Range)),
            (
                with(z(5), |m| m.range_rate = sensed(3e19, 0.05)),
                out(RangeRate),
            ),
            (
                with(z(5), |m| m.range_rate = sensed(1e18, 0.05)),
                out(RangeRate),
            ),
            (
                with(z(5), |m| m.range_rate = sensed(0.0, f32::MAX)),
                blunt(RangeRate),
            ),
            (
                with(z(5), |m| m.azimuth = sensed(1e30, 0.005)),
                out(Azimuth),
            ),
        ];
        for (measurement, expected) in absurd {
            assert_eq!(tracker.step(&measurement).unwrap_err(), expected);
        }
        let next = tracker.step(&z(5)).unwrap();
        assert_eq!(next.mode, Mode::Tracking);
        assert_sound(&next);
    }
}

/// The largest values that are taken at all: outliers like any other, of which one costs nothing.
#[test]
fn the_largest_outlier_is_an_outlier_like_any_other() {
    for change in [
        |m: &mut Measurement| m.range = sensed(1e6, 1e-4),
        |m: &mut Measurement| m.range_rate = sensed(-1e4, 1e-4),
        |m: &mut Measurement| m.azimuth = sensed(2.5, 1e-6),
        |m: &mut Measurement| m.elevation = sensed(-1.5, 1e-6),
    ] {
        let mut tracker = tracker(RECURSIVE);
        for i in 0..10 {
            tracker.step(&z(i)).unwrap();
        }
        for i in 10..60 {
            let odd = i % 3 == 0;
            let measurement = if odd { with(z(i), change) } else { z(i) };
            let estimate = tracker.step(&measurement).unwrap();
            let expected = if odd { Mode::Rejected } else { Mode::Tracking };
            assert_eq!(estimate.mode, expected, "{i}");
            assert_sound(&estimate);
        }
    }
}

#[test]
fn any_channel_may_be_missing() {
    type Damage = fn(&mut Measurement);
    let subsets: [Damage; 5] = [
        |m| m.range_rate = None,
        |m| m.elevation = None,
        |m| m.range = None,
        |m| (m.range, m.range_rate) = (None, None),
        |m| (m.elevation, m.range_rate) = (None, None),
    ];
    for damage in subsets {
        let mut tracker = tracker(RECURSIVE);
        for i in 0..100 {
            let estimate = tracker.step(&with(z(i), damage)).expect("a step");
            assert_sound(&estimate);
            let expected = if i == 0 {
                Mode::Started
            } else {
                Mode::Tracking
            };
            assert_eq!(estimate.mode, expected);
            let truth = bnkf::radar::position(33.0_f32, 0.4, 0.5);
            assert!(distance(&estimate, truth) < 3.0 * sigma(&estimate) + 0.1);
        }
    }
    // Without an azimuth there is nowhere to start, but somewhere to go on.
    let mut tracker = tracker(RECURSIVE);
    let partial = |i| with(z(i), |m| m.azimuth = None);
    assert_eq!(
        tracker.step(&partial(0)).unwrap_err(),
        StepError::Missing(Channel::Azimuth)
    );
    tracker.step(&z(0)).unwrap();
    assert_eq!(tracker.step(&partial(1)).unwrap().mode, Mode::Tracking);
}

#[test]
fn one_absurd_time_is_refused_and_honest_ones_go_on() {
    for bytes in EVERY {
        for absurd_us in [3_600_000_000, u64::MAX] {
            let mut tracker = tracker(bytes);
            for i in 0..5 {
                tracker.step(&z(i)).unwrap();
            }
            let absurd = with(z(5), |m| m.time_us = absurd_us);
            let refused = StepError::TimeTooFarAhead {
                latest_us: 400_000,
                given_us: absurd_us,
            };
            assert_eq!(tracker.step(&absurd).unwrap_err(), refused);
            for i in 6..20 {
                assert_eq!(tracker.step(&z(i)).unwrap().mode, Mode::Tracking);
            }
        }
    }
}

#[test]
fn a_clock_that_was_set_costs_one_measurement() {
    for bytes in EVERY {
        let mut tracker = tracker(bytes);
        for i in 0..5 {
            tracker.step(&z(i)).unwrap();
        }
        // Ahead by ten hours, and back again.
        for offset in [360_000, 0] {
            assert!(tracker.step(&z(offset + 5)).is_err());
            assert_eq!(tracker.step(&z(offset + 6)).unwrap().mode, Mode::Started);
            assert_eq!(tracker.step(&z(offset + 7)).unwrap().mode, Mode::Tracking);
        }
    }
}

#[test]
fn a_clock_of_32_bits_is_unwrapped() {
    let mut tracker = tracker(RECURSIVE);
    let mut clock = WrappingClock::default();
    let start = u64::from(u32::MAX) - 1_000_000;
    for i in 0..100 {
        let counter = (start + i * 100_000) as u32;
        let measurement = with(z(0), |m| m.time_us = start);
        let measurement = Measurement {
            time_us: clock.extend(counter),
            ..measurement
        };
        let estimate = tracker.step(&measurement).expect("a step");
        assert_eq!(estimate.time_us, start + i * 100_000);
    }
}

#[test]
fn a_repeated_measurement_is_not_counted_twice() {
    for bytes in EVERY {
        let (mut once, mut often) = (tracker(bytes), tracker(bytes));
        for i in 0..20 {
            let estimate = once.step(&z(i)).unwrap();
            assert_eq!(often.step(&z(i)).unwrap(), estimate);
            for _ in 0..10 {
                assert_eq!(often.step(&z(i)).unwrap_err(), StepError::Repeated);
            }
        }
    }
    // Another measurement at the same time is one more.
    let mut tracker = tracker(RECURSIVE);
    tracker.step(&z(0)).unwrap();
    let other = with(z(0), |m| m.range = sensed(33.05, 0.1));
    assert_eq!(tracker.step(&other).unwrap().mode, Mode::Tracking);
}

#[test]
fn an_azimuth_may_be_given_in_any_turn() {
    let turn = core::f32::consts::TAU;
    for bytes in EVERY {
        for azimuth in [0.5_f32, -0.5, 3.0, -3.0] {
            for turns in [1.0, -1.0, 3.0] {
                let (mut plain, mut turned) = (tracker(bytes), tracker(bytes));
                for i in 0..20 {
                    let given = azimuth + turns * turn;
                    let wrapped = bnkf::scalar::Scalar::wrap(given);
                    let a = with(z(i), |m| m.azimuth = sensed(wrapped, 0.005));
                    let b = with(z(i), |m| m.azimuth = sensed(given, 0.005));
                    let (a, b) = (plain.step(&a).unwrap(), turned.step(&b).unwrap());
                    assert_eq!(a, b, "{azimuth} + {turns} turns");
                }
            }
        }
    }
}

#[test]
fn exact_and_blunt_channels_together_start_soundly() {
    let mut count = 0;
    for bytes in EVERY {
        for range in [0.0, 1e-3, 1.0, 33.0, 1_000.0, 1e6] {
            for elevation in [-1.57_f32, -0.7, 0.0, 0.7, 1.57] {
                for azimuth in [0.0_f32, 0.785, 2.0, -3.1] {
                    for sigmas in [
                        [3.0, 0.005, 0.005, 0.0005],
                        [20.0, 1e-5, 1e-5, 0.05],
                        [1e-4, 1.0, 1.0, 1e-4],
                        [1e5, 1e-6, 1e-6, 1e-4],
                        [1e-4, 1e-6, 1e-6, 1e-4],
                        [1e5, 1.0, 1.0, 1e4],
                    ] {
                        let mut tracker = tracker(bytes);
                        for (i, step_us) in [0, 1, 0, 0, 100_000, 1].into_iter().enumerate() {
                            let jitter = i as f32 * 1e-3;
                            let measurement = Measurement {
                                time_us: step_us + i as u64,
                                range: sensed(range + jitter, sigmas[0]),
                                elevation: sensed(elevation, sigmas[1]),
                                azimuth: sensed(azimuth, sigmas[2]),
                                range_rate: sensed(jitter, sigmas[3]),
                                sensor: Sensor::ORIGIN,
                            };
                            match tracker.step(&measurement) {
                                Ok(estimate) => {
                                    assert_sound(&estimate);
                                    count += 1;
                                }
                                // A thousand kilometres to within a radian are nowhere.
                                Err(StepError::Blunt) => {
                                    assert!(range * sigmas[1] > 5e4, "{i} {measurement:?}")
                                }
                                Err(error) => assert!(i > 0, "{error}"),
                            }
                        }
                    }
                }
            }
        }
    }
    assert!(count > 8_000, "{count}");
}

#[test]
fn steps_of_a_microsecond_and_of_nothing_are_sound() {
    for bytes in EVERY {
        for step_us in [0, 1] {
            let mut tracker = tracker(bytes);
            for i in 0..2_000 {
                let measurement = with(z(0), |m| {
                    m.time_us = i * step_us;
                    m.range = sensed(33.0 + (i % 7) as f32 * 0.01, 0.1);
                });
                assert_sound(&tracker.step(&measurement).unwrap());
            }
        }
    }
}

/// Straight on at 1.1 to 2.9 times the largest speed of the training, where the network is asked: what a forecast
/// says is less than three of its own deviations away, however far ahead.
#[test]
fn forecasts_of_what_is_faster_than_the_training_are_honest() {
    const AHEAD_S: [f32; 5] = [0.5, 1.0, 2.0, 4.0, 8.0];
    let cases = [
        (COUNTER_UAS, 800.0_f32, 3.0, [50.0_f32, 61.0, 80.0, 100.0]),
        (RECURSIVE, 30.0, 0.1, [18.0, 25.0, 35.0, 47.0]),
    ];
    for (bytes, north, sigma_m, speeds) in cases {
        for speed in speeds {
            let mut tracker = tracker(bytes);
            let truth = |time_s: f32| [speed * (time_s - 2.0), north, 0.25 * north];
            for i in 0..40_u64 {
                let [east, north, up] = truth(0.1 * i as f32);
                let level = east.hypot(north);
                let range = level.hypot(up);
                let measurement = Measurement {
                    time_us: i * 100_000,
                    range: sensed(range, sigma_m),
                    elevation: sensed(up.atan2(level), 0.005),
                    azimuth: sensed(north.atan2(east), 0.005),
                    range_rate: sensed(east * speed / range, 0.2),
                    sensor: Sensor::ORIGIN,
                };
                let estimate = tracker.step(&measurement).unwrap();
                assert!(i < 20 || estimate.outside, "{speed} m/s");
            }
            let times_us = AHEAD_S.map(|ahead_s| 3_900_000 + (1e6 * ahead_s) as u64);
            let forecasts = tracker.forecasts(&times_us).unwrap();
            for (estimate, ahead_s) in forecasts.iter().zip(AHEAD_S) {
                assert_sound(estimate);
                let away = distance(estimate, truth(3.9 + ahead_s)) / sigma(estimate);
                assert!(away < 3.0, "{speed} m/s, {ahead_s} s: {away}");
            }
        }
    }
}
