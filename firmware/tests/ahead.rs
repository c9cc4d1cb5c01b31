//! Forecasts and likelihoods by the tracker's public interface: right, and without a trace.

use bnkf::blob::Blob;
use bnkf::clock::AHEAD_MAX_US;
use bnkf::measurement::Vectors;
use bnkf::radar::{innovations, predict};
use bnkf::recursive::curvature::curvature;
use bnkf::recursive::population::Base;
use bnkf::{
    Estimate, Inference, Likelihood, Measurement, MeasurementError, Mode, Sensed, Sensor, Settings,
    StepError, Tracker,
};

const RECURSIVE: &[u8] = include_bytes!("../models/recursive.bnkf");
const MEMORYLESS: &[u8] = include_bytes!("golden/tiny_bnkf.bnkf");
const BLOBS: [&[u8]; 2] = [RECURSIVE, MEMORYLESS];

fn tracker(bytes: &[u8], passes: u16) -> Tracker<'_> {
    let blob = Blob::parse(bytes).expect("a blob");
    let settings = Settings {
        inference: Inference::of_passes(passes).expect("in range"),
        ..Settings::of(&blob)
    };
    Tracker::new(blob, settings).expect("fits")
}

fn sensed(value: f32, sigma: f32) -> Option<Sensed> {
    Some(Sensed { value, sigma })
}

/// A target that goes round in front of the radar, outbound at `speed`.
fn seen(step: u64, speed: f32) -> Measurement {
    let time_s = 0.1 * step as f32;
    let wobble = (7.3 * step as f32).sin();
    Measurement {
        time_us: 1_000_000 + 100_000 * step,
        range: sensed(30.0 + speed * time_s + 0.2 * wobble, 0.3),
        elevation: sensed(0.4 + 0.002 * wobble, 0.004),
        azimuth: sensed(0.5 + 0.05 * time_s, 0.004),
        range_rate: sensed(speed + 0.05 * wobble, 0.1),
        sensor: Sensor::ORIGIN,
    }
}

fn started(bytes: &[u8], speed: f32) -> (Tracker<'_>, Estimate) {
    let mut tracker = tracker(bytes, 1);
    let mut latest = None;
    for step in 0..20 {
        latest = Some(tracker.step(&seen(step, speed)).expect("accepted"));
    }
    (tracker, latest.expect("steps"))
}

#[test]
fn asking_changes_nothing_to_the_bit() {
    for bytes in BLOBS {
        for passes in [1, 6] {
            let (mut quiet, mut asked) = (tracker(bytes, passes), tracker(bytes, passes));
            for step in 0..40 {
                let measurement = seen(step, 1.0);
                let now_us = measurement.time_us;
                // A wild plot, a repeated one and a far time among the questions.
                let wild = Measurement {
                    azimuth: sensed(-2.5, 0.004),
                    ..measurement
                };
                for question in [measurement, wild, seen(step + 30, 1.0)] {
                    let _ = asked.likelihood(&question);
                }
                let (a, b) = match step % 4 {
                    3 => (quiet.coast(now_us), asked.coast(now_us)),
                    _ => (quiet.step(&measurement), asked.step(&measurement)),
                };
                assert_eq!(a, b, "step {step}");
                let far_us = now_us + AHEAD_MAX_US;
                let _ = asked.forecasts(&[now_us + 500_000, far_us]);
                let _ = asked.forecast(far_us + 1);
                assert!(asked.likelihood(&measurement).is_ok());
                assert_eq!(
                    quiet.step(&measurement).is_ok(),
                    asked.step(&measurement).is_ok()
                );
            }
        }
    }
}

#[test]
fn a_forecast_does_not_depend_on_the_others() {
    for bytes in BLOBS {
        let (mut tracker, latest) = started(bytes, 1.0);
        let ahead_us = [
            0, 1, 300_000, 500_000, 700_000, 1_000_000, 1_000_000, 9_300_000,
        ];
        let times_us = ahead_us.map(|ahead_us| latest.time_us + ahead_us);
        let together = tracker.forecasts(&times_us).expect("known");
        let mut before_m2 = 0.0;
        for (own, time_us) in together.iter().zip(times_us) {
            assert_eq!(tracker.forecast(time_us), Ok(*own));
            assert_eq!(
                (own.time_us, own.mode, own.nis),
                (time_us, Mode::Coasting, 0.0)
            );
            let size_m2: f32 = (0..3).map(|axis| own.covariance_m2[axis][axis]).sum();
            assert!(size_m2 >= before_m2, "{size_m2} after {before_m2}");
            before_m2 = size_m2;
        }
        assert_eq!(together[0].position_m, latest.position_m);
        assert!(tracker.forecasts(&[]).is_ok());
    }
}

/// More than three times as fast as any target that the model was trained for: no network, acceleration that fades.
#[test]
fn far_beyond_the_envelope_the_closed_form_is_the_oracle() {
    let (mut tracker, latest) = started(RECURSIVE, 60.0);
    let motion = latest.motion.expect("recursive");
    assert!(latest.outside);
    let times_us = [500_000, 1_000_000, 2_000_000].map(|ahead_us| latest.time_us + ahead_us);
    let forecasts = tracker.forecasts(&times_us).expect("known");
    for (own, dt) in forecasts.iter().zip([0.5_f64, 1.0, 2.0]) {
        let decay = Base::DRONE.decay_hz;
        let f1 = (1.0 - (-decay * dt).exp()) / decay;
        let f2 = (dt - f1) / decay;
        for axis in 0..3 {
            let [p, v, a] = [
                latest.position_m[axis],
                motion.velocity_mps[axis],
                motion.acceleration_mps2[axis],
            ]
            .map(f64::from);
            let expected = p + dt * v + f2 * a;
            let got = f64::from(own.position_m[axis]);
            assert!((got - expected).abs() < 1e-3, "{dt} s: {got}, {expected}");
        }
    }
    // A quarter of a second is one part of a coast, by the same model.
    let near_us = latest.time_us + 250_000;
    let forecast = tracker.forecast(near_us).expect("known");
    let coast = tracker.coast(near_us).expect("known");
    for i in 0..3 {
        assert!((forecast.position_m[i] - coast.position_m[i]).abs() < 1e-4);
        for j in 0..3 {
            let (a, b) = (forecast.covariance_m2[i][j], coast.covariance_m2[i][j]);
            assert!((a - b).abs() < 1e-3 * coast.covariance_m2[0][0], "{a} {b}");
        }
    }
}

#[test]
fn a_memoryless_forecast_is_its_coast() {
    let (mut tracker, latest) = started(MEMORYLESS, 1.0);
    for ahead_us in [500_000, 1_000_000, 2_000_000] {
        let time_us = latest.time_us + ahead_us;
        let forecast = tracker.forecast(time_us);
        assert_eq!(tracker.coast(time_us), forecast);
    }
}

#[test]
fn what_cannot_be_told_is_named() {
    for bytes in BLOBS {
        let mut nothing = tracker(bytes, 1);
        assert_eq!(nothing.forecast(5), Err(StepError::NotStarted));
        assert_eq!(
            nothing.likelihood(&seen(0, 1.0)),
            Err(StepError::NotStarted)
        );
        let (mut tracker, latest) = started(bytes, 1.0);
        let now_us = latest.time_us;
        let went_back = |latest_us, given_us| StepError::TimeWentBack {
            latest_us,
            given_us,
        };
        assert_eq!(
            tracker.forecast(now_us - 1),
            Err(went_back(now_us, now_us - 1))
        );
        let disordered = [now_us + 5, now_us + 4];
        assert_eq!(
            tracker.forecasts(&disordered),
            Err(went_back(now_us + 5, now_us + 4))
        );
        for far_us in [now_us + AHEAD_MAX_US + 1, u64::MAX] {
            let too_far = StepError::TimeTooFarAhead {
                latest_us: now_us,
                given_us: far_us,
            };
            assert_eq!(tracker.forecast(far_us), Err(too_far));
            let late = Measurement {
                time_us: far_us,
                ..seen(0, 1.0)
            };
            assert_eq!(tracker.likelihood(&late), Err(too_far));
        }
        let before = tracker.likelihood(&seen(3, 1.0));
        assert_eq!(before, Err(went_back(now_us, seen(3, 1.0).time_us)));
        let empty = Measurement {
            range: None,
            elevation: None,
            azimuth: None,
            range_rate: None,
            ..seen(25, 1.0)
        };
        assert_eq!(
            tracker.likelihood(&empty),
            Err(StepError::Measurement(MeasurementError::Empty))
        );
    }
}

/// Innovation, NIS and log-density of a Gaussian in double precision: Jacobian by differences, the
/// curvature that the filter adds, Cholesky's factor of the innovation's covariance.
fn naive(
    state: &[f64; 6],
    covariance: &[Vec<f64>],
    extra: [f64; 4],
    measurement: &Measurement,
) -> ([f64; 4], f64, f64) {
    let h = |x: &[f64; 6]| predict([x[0], x[1], x[2]], [x[3], x[4], x[5]]).measurement;
    let channels = measurement.channels();
    let measured = channels.map(|own| own.map_or(0.0, |own| f64::from(own.value)));
    let present = channels.map(|own| f64::from(u8::from(own.is_some())));
    let vectors = Vectors {
        present,
        ..Vectors::whole(measured, [1.0; 4])
    };
    let innovation = innovations(&vectors, &h(state));
    let there: Vec<usize> = (0..4).filter(|&i| channels[i].is_some()).collect();
    let size = covariance.len();
    let derivative = |channel: usize, column: usize| {
        if column >= 6 {
            return 0.0;
        }
        let (mut less, mut more) = (*state, *state);
        less[column] -= 1e-5;
        more[column] += 1e-5;
        (h(&more)[channel] - h(&less)[channel]) / 2e-5
    };
    let spread = |a: usize, b: usize| {
        let mut sum = 0.0;
        for i in 0..size {
            for j in 0..size {
                sum += derivative(a, i) * covariance[i][j] * derivative(b, j);
            }
        }
        let sigma = channels[a].map_or(0.0, |own| f64::from(own.sigma));
        if a == b {
            sum += sigma * sigma + extra[a];
        }
        sum
    };
    let mut root = vec![vec![0.0_f64; there.len()]; there.len()];
    let mut whitened = vec![0.0_f64; there.len()];
    for i in 0..there.len() {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| root[i][k] * root[j][k]).sum();
            let left = spread(there[i], there[j]) - known;
            root[i][j] = if i == j {
                left.sqrt()
            } else {
                left / root[j][j]
            };
        }
        let known: f64 = (0..i).map(|k| root[i][k] * whitened[k]).sum();
        whitened[i] = (innovation[there[i]] - known) / root[i][i];
    }
    let nis: f64 = whitened.iter().map(|y| y * y).sum();
    let ln_root: f64 = (0..there.len()).map(|i| root[i][i].ln()).sum();
    let constant = 0.5 * there.len() as f64 * core::f64::consts::TAU.ln();
    (innovation, nis, -0.5 * nis - ln_root - constant)
}

fn matrix<const N: usize>(single: &[[f32; N]; N]) -> Vec<Vec<f64>> {
    let row = |row: &[f32; N]| row.iter().map(|&x| f64::from(x)).collect();
    single.iter().map(row).collect()
}

fn assert_near(got: &Likelihood, channels: usize, expected: ([f64; 4], f64, f64)) {
    let (innovation, nis, ln) = expected;
    assert_eq!(usize::from(got.degrees), channels);
    assert_eq!(got.innovation.iter().flatten().count(), channels);
    for (got, expected) in got.innovation.into_iter().zip(innovation) {
        assert!(got.is_none_or(|got| (f64::from(got) - expected).abs() < 1e-4));
    }
    assert!(
        (f64::from(got.nis) - nis).abs() < 2e-3 * (1.0 + nis),
        "{got:?} {nis}"
    );
    let off = (f64::from(got.ln_likelihood) - ln).abs();
    assert!(off < 2e-3 * (1.0 + ln.abs()), "{got:?} {ln}");
}

/// At the time of the latest step nothing moves: the Gaussian is that of the estimate.
#[test]
fn a_recursive_likelihood_is_the_gaussians() {
    let (mut tracker, latest) = started(RECURSIVE, 1.0);
    let motion = latest.motion.expect("recursive");
    let single: [f32; 9] = core::array::from_fn(|i| match i {
        0..3 => latest.position_m[i],
        3..6 => motion.velocity_mps[i - 3],
        _ => motion.acceleration_mps2[i - 6],
    });
    let state: [f64; 6] = core::array::from_fn(|i| f64::from(single[i]));
    let covariance = matrix(&motion.covariance);
    let extra = curvature(&single, &motion.covariance).map(f64::from);
    let base = Measurement {
        time_us: latest.time_us,
        range: sensed(32.5, 0.3),
        elevation: sensed(0.41, 0.004),
        azimuth: sensed(0.59, 0.004),
        range_rate: sensed(0.8, 0.1),
        sensor: Sensor::ORIGIN,
    };
    let part = Measurement {
        elevation: None,
        range_rate: None,
        ..base
    };
    let alone = Measurement {
        range: None,
        ..part
    };
    for (measurement, channels) in [(base, 4), (part, 2), (alone, 1)] {
        let got = tracker.likelihood(&measurement).expect("finite");
        let expected = naive(&state, &covariance, extra, &measurement);
        assert_near(&got, channels, expected);
    }
}

#[test]
fn a_memoryless_likelihood_is_the_coasted_positions() {
    let (mut tracker, latest) = started(MEMORYLESS, 1.0);
    let measurement = Measurement {
        time_us: latest.time_us + 200_000,
        ..seen(21, 1.0)
    };
    let got = tracker.likelihood(&measurement).expect("finite");
    assert_eq!(got.innovation[3], None);
    let ahead = tracker.forecast(measurement.time_us).expect("known");
    let [x, y, z] = ahead.position_m.map(f64::from);
    let covariance = matrix(&ahead.covariance_m2);
    let position = Measurement {
        range_rate: None,
        ..measurement
    };
    let expected = naive(&[x, y, z, 0.0, 0.0, 0.0], &covariance, [0.0; 4], &position);
    assert_near(&got, 3, expected);
}

#[test]
fn the_gate_is_the_steps() {
    let mut verdicts = [0; 2];
    for off in 0..60 {
        let (mut tracker, latest) = started(RECURSIVE, 1.0);
        let mut measurement = seen(20, 1.0);
        measurement.time_us = latest.time_us + 100_000;
        measurement.azimuth = sensed(0.5 + 0.05 * 2.0 + 0.04 * off as f32, 0.004);
        let told = tracker.likelihood(&measurement).expect("finite");
        let used = tracker.step(&measurement).expect("accepted").mode == Mode::Tracking;
        assert_eq!(told.passes_gate, used, "{off}: {told:?}");
        verdicts[usize::from(used)] += 1;
    }
    assert!(verdicts[0] > 5 && verdicts[1] > 3, "{verdicts:?}");
}

#[test]
fn hostile_questions_get_finite_answers_or_none() {
    for bytes in BLOBS {
        let (mut tracker, latest) = started(bytes, 1.0);
        for ahead_us in [0, 1, 100_000, 30_000_000, AHEAD_MAX_US] {
            if let Ok(forecast) = tracker.forecast(latest.time_us + ahead_us) {
                let numbers = forecast.position_m.iter();
                let mut numbers = numbers.chain(forecast.covariance_m2.as_flattened());
                assert!(numbers.all(|x| x.is_finite()));
            }
            for range in [-1e6, 0.0, 1e-3, 1e6] {
                for [least, most] in [[1e-6, 1e-4], [1.0, 1e4]] {
                    let measurement = Measurement {
                        time_us: latest.time_us + ahead_us,
                        range: sensed(range, most),
                        elevation: sensed(3.1, least),
                        azimuth: sensed(-99.0, least),
                        range_rate: sensed(-1e4, most),
                        sensor: Sensor::ORIGIN,
                    };
                    if let Ok(told) = tracker.likelihood(&measurement) {
                        let numbers = told.innovation.into_iter().flatten();
                        let mut numbers = numbers.chain([told.nis, told.ln_likelihood]);
                        assert!(numbers.all(|x| x.is_finite()), "{told:?}");
                        assert!(told.nis >= 0.0);
                    }
                }
            }
        }
    }
}

/// A plot from a vehicle elsewhere is as likely as the same plot where everything, vehicle, target and
/// track, was moved and set in motion together.
#[test]
fn a_plot_is_as_likely_from_every_sensor() {
    let elsewhere = |mut measurement: Measurement| {
        measurement.sensor = Sensor::at([64.0, -32.0, 8.0]);
        measurement
    };
    let (mut here, mut there) = (tracker(RECURSIVE, 1), tracker(RECURSIVE, 1));
    for step in 0..20 {
        here.step(&seen(step, 1.0)).expect("accepted");
        there.step(&elsewhere(seen(step, 1.0))).expect("accepted");
    }
    let plot = seen(20, 1.0);
    let expected = here.likelihood(&plot).expect("finite");
    assert_eq!(there.likelihood(&elsewhere(plot)), Ok(expected));
    // The vehicle drives along the line of sight: all of it is missing from the range-rate.
    let mut driven = elsewhere(plot);
    let (s, c) = plot
        .azimuth
        .map_or((0.0, 0.0), |azimuth| azimuth.value.sin_cos());
    driven.sensor.velocity_mps = [4.0 * c, 4.0 * s, 0.0];
    let level = plot
        .elevation
        .map_or(0.0, |elevation| elevation.value.cos());
    if let Some(range_rate) = &mut driven.range_rate {
        range_rate.value -= 4.0 * level;
    }
    let got = there.likelihood(&driven).expect("finite");
    assert!(
        (got.ln_likelihood - expected.ln_likelihood).abs() < 0.05,
        "{got:?} {expected:?}"
    );
    let mut memoryless = tracker(MEMORYLESS, 1);
    memoryless.step(&seen(0, 1.0)).expect("accepted");
    assert_eq!(
        memoryless.likelihood(&elsewhere(plot)),
        Err(StepError::Sensor)
    );
}
