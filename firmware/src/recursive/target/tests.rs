use super::*;
use crate::measurement::Sensed;
use crate::recursive::correction::correct_soundly;
use crate::sensor::Sensor;

mod bends;
mod relocation;

fn population() -> Population<f32> {
    Population::PAPER.known()
}

fn base() -> Base<f32> {
    Base::DRONE.known()
}

fn sensed(value: f32, sigma: f32) -> Option<Sensed> {
    Some(Sensed { value, sigma })
}

fn first() -> Measurement {
    Measurement {
        time_us: 7,
        range: sensed(33.0, 0.1),
        elevation: sensed(0.4, 0.005),
        azimuth: sensed(0.5, 0.006),
        range_rate: sensed(1.0, 0.05),
        sensor: Sensor::ORIGIN,
    }
}

fn start(measurement: &Measurement) -> Result<Target, StepError> {
    let mut target = Target::NONE;
    target.start(measurement, &population())?;
    Ok(target)
}

fn target() -> Target {
    start(&first()).expect("a target")
}

#[test]
fn a_start_needs_a_direction_that_says_something() {
    let started = |change: fn(&mut Measurement)| {
        let mut measurement = first();
        change(&mut measurement);
        start(&measurement).map(|target| target.used)
    };
    assert_eq!(started(|_| ()), Ok(1));
    assert_eq!(
        started(|m| m.azimuth = None),
        Err(StepError::Missing(Channel::Azimuth))
    );
    let blunt = started(|m| {
        m.range = sensed(1e6, 0.1);
        m.azimuth = sensed(0.5, 1.0);
    });
    assert_eq!(blunt, Err(StepError::Blunt));
}

#[test]
fn a_sensor_without_a_channel_is_as_blunt_as_the_population() {
    let mut measurement = first();
    (
        measurement.range,
        measurement.range_rate,
        measurement.elevation,
    ) = (None, None, None);
    let target = start(&measurement).expect("a target");
    for (got, sigma) in target
        .memory
        .ln_sigmas
        .into_iter()
        .zip([0.21, 0.006, 6.0, 1.6])
    {
        assert!((got - f32::ln(sigma)).abs() < 1e-6);
    }
    // With all channels it is as sharp as it says.
    let own = self::target().memory.ln_sigmas;
    for (got, sigma) in own.into_iter().zip([0.005, 0.006, 0.1, 0.05]) {
        assert!((got - f32::ln(sigma)).abs() < 1e-6);
    }
}

#[test]
fn tracks_are_apart_by_their_deviations() {
    let (near, mut far) = (target(), target());
    let reach = 3.0 * (2.0 * near.position_variance()).sqrt();
    far.state[1] += 0.99 * reach;
    assert!(!near.is_apart(&far, 3.0) && near.is_apart(&far, 2.9));
    far.state[1] += 0.02 * reach;
    assert!(near.is_apart(&far, 3.0));
    assert!(near.is_apart(&near, 0.0));
}

#[test]
fn what_means_nothing_does_not_settle() {
    assert!(target().settle());
    let mut far = target();
    (far.state[1], far.state[3], far.state[7]) = (-9.9e6, 9.9e4, -9.9e4);
    far.covariance[0][0] = 9.9e9;
    assert!(far.settle());
    type Damage = fn(&mut Target);
    let damages: [Damage; 9] = [
        |t| t.state[0] = 1e7,
        |t| t.covariance[2][2] = 1e10,
        |t| t.state[0] = f32::NAN,
        |t| t.state[2] = 1.1e7,
        |t| t.state[4] = -1.1e5,
        |t| t.state[8] = 1.1e5,
        |t| t.covariance[3][3] = f32::INFINITY,
        |t| t.covariance[5][5] = 0.0,
        |t| t.covariance[1][1] = 1.1e10,
    ];
    for damage in damages {
        let mut target = target();
        damage(&mut target);
        assert!(!target.settle(), "{target:?}");
    }
    let mut flat = target();
    flat.covariance[0][1] = (flat.covariance[0][0] * flat.covariance[1][1]).sqrt();
    flat.covariance[1][0] = flat.covariance[0][1];
    assert!(flat.settle() && crate::cholesky::is_definite(&flat.covariance));
}

#[test]
fn a_drift_moves_and_doubts() {
    let mut moved = target();
    moved.drift(500_007, &base());
    let before = target();
    assert_eq!(moved.time_us, 500_007);
    for axis in 0..3 {
        let expected = before.state[axis] + 0.5 * before.state[3 + axis];
        assert!((moved.state[axis] - expected).abs() < 1e-3);
        assert!(moved.covariance[axis][axis] > before.covariance[axis][axis]);
    }
    assert!(moved.position_variance() > before.position_variance());
    let mut still = target();
    still.drift(7, &base());
    assert_eq!(
        (still.state, still.covariance),
        (before.state, before.covariance)
    );
}

#[test]
fn a_correction_is_counted_and_an_estimate_is_the_track() {
    let mut target = target();
    let vectors = Vectors::from(&first());
    let mut corrected = Corrected::before(&target.state, &target.covariance);
    let whitened = correct_soundly(&mut corrected, &vectors, [1.0; 3]);
    let whitened = whitened.expect("sound");
    assert!(whitened.iter().all(|y| y.abs() < 1.0));
    let before = target.covariance[0][0];
    target.take(&corrected);
    assert_eq!(target.used, 2);
    assert!(target.covariance[0][0] < before);
    let estimate = target.estimate(f32::MAX, Mode::Tracking, true, Doubt::OUTLIER);
    assert_eq!(estimate.nis, NIS_MAX);
    assert_eq!(
        (estimate.mode, estimate.outside, estimate.time_us),
        (Mode::Tracking, true, 7)
    );
    assert_eq!(
        estimate.position_m,
        [target.state[0], target.state[1], target.state[2]]
    );
    assert_eq!(estimate.covariance_m2[1][2], target.covariance[1][2]);
    let motion = estimate.motion.expect("recursive");
    assert_eq!(motion.velocity_mps, target.velocity());
    assert_eq!(
        motion.acceleration_mps2,
        [target.state[6], target.state[7], target.state[8]]
    );
    assert_eq!(motion.covariance, target.covariance);
}

/// A measurement from a moving sensor elsewhere, as one joint update in f64 with the Jacobian by
/// differences of a measurement function written again in plain words.
#[test]
fn a_correction_from_a_moving_sensor_is_the_textbooks() {
    use nalgebra::{SMatrix, SVector};
    let sensor = Sensor {
        position_m: [12.0, -30.0, 2.5],
        velocity_mps: [-9.0, 12.0, 0.5],
    };
    let mut target = target();
    for i in 0..9 {
        target.covariance[i][i] += 0.02;
    }
    let world: [f64; 9] = target.state.map(f64::from);
    let h = |s: &[f64; 9]| {
        let d: [f64; 3] = core::array::from_fn(|i| s[i] - f64::from(sensor.position_m[i]));
        let v: [f64; 3] = core::array::from_fn(|i| s[3 + i] - f64::from(sensor.velocity_mps[i]));
        let range = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        SVector::<f64, 4>::from([
            libm::asin(d[2] / range),
            libm::atan2(d[1], d[0]),
            range,
            (d[0] * v[0] + d[1] * v[1] + d[2] * v[2]) / range,
        ])
    };
    let jacobian = SMatrix::<f64, 4, 9>::from_fn(|row, column| {
        let step = |size: f64| {
            let mut moved = world;
            moved[column] += size;
            h(&moved)[row]
        };
        (step(1e-5) - step(-1e-5)) / 2e-5
    });
    let away = SVector::<f64, 4>::from([0.004, -0.003, 0.2, 0.1]);
    let measured = h(&world) + away;
    let sigmas = [0.01, 0.008, 0.3, 0.2];
    let vectors = Vectors::whole(core::array::from_fn(|i| measured[i] as f32), sigmas);
    target.seen_from(sensor.position_m);
    let curvature = crate::recursive::curvature::curvature(&target.state, &target.covariance);
    let prior = SMatrix::<f64, 9, 9>::from_fn(|i, j| f64::from(target.covariance[i][j]));
    let noise = SMatrix::<f64, 4, 4>::from_diagonal(&SVector::from_fn(|i, _| {
        f64::from(sigmas[i]).powi(2) + f64::from(curvature[i])
    }));
    let innovation = jacobian * prior * jacobian.transpose() + noise;
    let gain = prior * jacobian.transpose() * innovation.try_inverse().expect("regular");
    let mean = SVector::<f64, 9>::from(world) + gain * away;
    let spread = prior - gain * jacobian * prior;
    target.relative_to(sensor.velocity_mps);
    let mut corrected = Corrected::before(&target.state, &target.covariance);
    let whitened = correct_soundly(&mut corrected, &vectors, [1.0; 3]);
    assert!(whitened.is_some());
    target.take(&corrected);
    target.over_ground(sensor.velocity_mps);
    let estimate = target.estimate(0.0, Mode::Tracking, false, Doubt::NONE);
    let motion = estimate.motion.expect("recursive");
    for i in 0..3 {
        assert!((f64::from(estimate.position_m[i]) - mean[i]).abs() < 1e-4);
        assert!((f64::from(motion.velocity_mps[i]) - mean[3 + i]).abs() < 1e-4);
    }
    for i in 0..9 {
        for j in 0..9 {
            assert!((f64::from(motion.covariance[i][j]) - spread[(i, j)]).abs() < 1e-4);
        }
    }
}

/// Galileo: who moves with sensor and target sees the same.
#[test]
fn only_the_relative_velocity_counts() {
    let vectors = Vectors::from(&first());
    let own = [3.0, -2.0, 1.0];
    let corrected = |mut target: Target, own: [f32; 3]| {
        target.relative_to(own);
        let mut corrected = Corrected::before(&target.state, &target.covariance);
        let whitened = correct_soundly(&mut corrected, &vectors, [1.0; 3]);
        assert!(whitened.is_some());
        target.take(&corrected);
        target.over_ground(own);
        (target.state, corrected.nis)
    };
    let (plain, nis) = corrected(target(), own);
    let mut boosted = target();
    let boost = [16.0, 8.0, -4.0];
    for axis in 0..3 {
        boosted.state[3 + axis] += boost[axis];
    }
    let own = core::array::from_fn(|axis| own[axis] + boost[axis]);
    let (moved, moved_nis) = corrected(boosted, own);
    assert!((nis - moved_nis).abs() < 1e-3 * nis);
    for i in 0..9 {
        let boost = if (3..6).contains(&i) {
            boost[i - 3]
        } else {
            0.0
        };
        assert!((moved[i] - plain[i] - boost).abs() < 1e-5);
    }
}

#[test]
fn a_place_is_the_same_from_every_sensor() {
    let place = |target: &Target| {
        target
            .estimate(0.0, Mode::Tracking, false, Doubt::NONE)
            .position_m
    };
    let mut seen = target();
    seen.seen_from([40.0, -3.0, 1.0]);
    assert!(!target().is_apart(&seen, 1e-3) && !seen.is_apart(&target(), 1e-3));
    for (a, b) in place(&seen).into_iter().zip(place(&target())) {
        assert!((a - b).abs() < 1e-5);
    }
    seen.seen_from([0.0; 3]);
    for axis in 0..3 {
        assert!((seen.state[axis] - target().state[axis]).abs() < 1e-5);
    }
    let mut away = first();
    away.sensor = Sensor::at([100.0, 0.0, 0.0]);
    let away = start(&away).expect("a target");
    assert_eq!(away.state, target().state);
    assert!((place(&away)[0] - place(&target())[0] - 100.0).abs() < 1e-4);
}

/// Overflow is no correction.
#[test]
fn an_overflow_corrects_nothing() {
    let mut target = target();
    target.covariance[0][0] = f32::INFINITY;
    let mut corrected = Corrected::before(&target.state, &target.covariance);
    let whitened = correct_soundly(&mut corrected, &Vectors::from(&first()), [1.0; 3]);
    assert!(whitened.is_none());
}

/// A target's factor and doubt are those of its state and covariance.
#[test]
fn a_track_is_fused_and_doubted() {
    let factor = Factor {
        shifts: [1.0; 5],
        weights: [2.0; 5],
    };
    let (before, mut fused) = (target(), target());
    fused.fuse(&factor, &population(), 0.1);
    let (mut state, mut covariance) = (before.state, before.covariance);
    factor.fuse(&mut state, &mut covariance, &population(), 0.1);
    assert_eq!((fused.state, fused.covariance), (state, covariance));
    assert!(state != before.state && covariance != before.covariance);

    let wide = Schedule::wide(&base());
    let interval = Interval {
        sight: before.sight(),
        noise: wide.noise,
        sensor_scale: wide.sensor_scale,
        dt_s: 0.2,
        coast_s: 0.0,
    };
    let (hypotheses, odds) = (Hypotheses::DRONE.known(), [0.7, 0.1, 0.1, 0.1]);
    let mut doubted = target();
    doubted.doubt(&interval, &hypotheses, &odds);
    let mut covariance = before.covariance;
    interval.doubt(&mut covariance, &hypotheses, &odds);
    assert_eq!(doubted.covariance, covariance);
    assert!(covariance[0][0] > before.covariance[0][0]);
}
