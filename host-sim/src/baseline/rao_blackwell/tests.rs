use super::*;
use crate::baseline::kalman::Kalman;
use crate::baseline::origin::Origin;
use crate::baseline::prior::tests::PRIOR;
use crate::baseline::sensor::{cartesian, expected, residual};
use bnkf_model_export::radar::pose::Pose;
use bnkf_model_export::scoring::step_score::StepScore;
use nalgebra::{Matrix3, Vector4};

const MOTION: Singer = Singer {
    acceleration_sigma_mps2: 1.5,
    correlation_time_s: 1.0,
    damping_per_s: 0.5,
    q_m2_s3: 0.3,
};

fn reading(k: u64, z: &Vector4<f64>, sigma: &Vector4<f64>) -> Reading {
    Reading {
        time_us: k * 200_000,
        elevation_rad: z[0],
        azimuth_rad: z[1],
        range_m: z[2],
        range_rate_mps: z[3],
        sigma_elevation_rad: sigma[0],
        sigma_azimuth_rad: sigma[1],
        sigma_range_m: sigma[2],
        sigma_range_rate_mps: sigma[3],
        sensor: Pose::ORIGIN,
        late_us: 0,
    }
}

fn started(first: &Reading) -> RaoBlackwell {
    let (p, v) = (Vector3::zeros(), Vector3::zeros());
    let start = Start {
        reading: first,
        true_position_m: p,
        true_velocity_mps: v,
    };
    let mut filter = RaoBlackwell::new(MOTION, PRIOR, 5);
    assert!(filter.start(&start).is_ok());
    filter
}

/// The same posterior by brute force: trajectories drawn from population and motion, weighted
/// by every reading. High noise, fast crossing target, 1 s.
#[test]
fn equals_importance_sampling_of_whole_trajectories() {
    let sigma = Vector4::new(0.1, 0.1, 100.0, 0.5);
    let mut random = RandomSource::new(21, &[]);
    let readings: Vec<Reading> = (0..=5)
        .map(|k| {
            let p = Vector3::new(20.0, -14.0, 13.0) + Vector3::new(1.5, 3.0, 0.3) * 0.2 * k as f64;
            let z = expected(&p, &Vector3::new(1.5, 3.0, 0.3));
            reading(k, &(z + sigma.map(|s| s * random.normal())), &sigma)
        })
        .collect();

    let mut filter = started(&readings[0]);
    let mut estimate = None;
    for reading in &readings[1..] {
        estimate = filter.step(reading.time_us, Some(reading)).ok();
    }
    let estimate = estimate.unwrap();

    let draws = 200_000;
    let step = Discrete::new(&MOTION, 0.2);
    let root = step.noise.cholesky().unwrap().unpack();
    let first = Observation::from(&readings[0]);
    let range = PRIOR.fused_range(&first);
    let elevation = PRIOR.elevation_rad.fused(first.z[0], sigma[0]);
    let (mut total, mut squares) = (0.0, 0.0);
    let (mut mean, mut second) = (Vector3::zeros(), Matrix3::zeros());
    for _ in 0..draws {
        // The first reading has done its part: only its range-rate is left to weigh.
        let p = cartesian(
            elevation.mean + elevation.sigma * random.normal(),
            first.z[1] + sigma[1] * random.normal(),
            range.mean + range.sigma * random.normal(),
        );
        let mut x = SVector::<f64, 9>::from_fn(|_, _| random.normal());
        x.fixed_rows_mut::<3>(0).copy_from(&p);
        for (axis, scale) in [1.7, 1.7, 0.6, 1.5, 1.5, 1.5].into_iter().enumerate() {
            x[3 + axis] *= scale;
        }
        let log_density = |x: &SVector<f64, 9>, reading: &Reading| {
            let h = expected(&x.fixed_rows::<3>(0).into(), &x.fixed_rows::<3>(3).into());
            let e = residual(&Observation::from(reading).z, &h).component_div(&sigma);
            -0.5 * (e.norm_squared() - e[2] * e[2])
        };
        let v = x.fixed_rows::<3>(3).into();
        let rate = (first.z[3] - expected(&p, &v)[3]) / sigma[3];
        let mut log_weight = -0.5 * rate * rate;
        for reading in &readings[1..] {
            x = step.transition * x + root * SVector::<f64, 9>::from_fn(|_, _| random.normal());
            log_weight += log_density(&x, reading);
        }
        let weight = log_weight.exp();
        let p = x.fixed_rows::<3>(0).into_owned();
        total += weight;
        squares += weight * weight;
        mean += p * weight;
        second += p * p.transpose() * weight;
    }
    let mean = mean / total;
    let covariance = second / total - mean * mean.transpose();
    // Standard error of a mean over as many equal weights as these are worth.
    let worth = total * total / squares;
    assert!(
        worth > 1000.0,
        "the brute force itself degenerated: {worth}"
    );
    for axis in 0..3 {
        let sd = covariance[(axis, axis)].sqrt();
        let off = (estimate.position_m[axis] - mean[axis]) / sd;
        assert!(
            off.abs() < 4.0 / worth.sqrt() + 0.02,
            "axis {axis}: off by {off} sd"
        );
        let ratio = estimate.covariance_m2[(axis, axis)].sqrt() / sd;
        assert!(
            (ratio - 1.0).abs() < 3.0 / worth.sqrt() + 0.03,
            "axis {axis}: {ratio}"
        );
    }
}

/// A drone that turns far harder than the model expects, seen by a good sensor: the particles
/// may be as wrong as a Kalman filter of the same model, but not surer of it.
#[test]
fn a_surprising_turn_does_not_collapse_the_covariance() {
    let sigma = Vector4::new(0.001, 0.001, 1.0, 0.01);
    let mut random = RandomSource::new(4, &[]);
    let truth = |k: u64| {
        let angle = 2.5 * 0.2 * k as f64;
        let (sin, cos) = angle.sin_cos();
        let p = Vector3::new(25.0 + 1.5 * cos, -20.0 + 1.5 * sin, 12.0);
        (p, Vector3::new(-3.75 * sin, 3.75 * cos, 0.0))
    };
    let readings: Vec<Reading> = (0..100)
        .map(|k| {
            let (p, v) = truth(k);
            let z = expected(&p, &v) + sigma.map(|s| s * random.normal());
            reading(k, &z, &sigma)
        })
        .collect();
    let calm = Singer {
        acceleration_sigma_mps2: 1.0,
        q_m2_s3: 0.01,
        ..MOTION
    };
    let nees = |filter: &mut dyn Filter| {
        let start = Start {
            reading: &readings[0],
            true_position_m: Vector3::zeros(),
            true_velocity_mps: Vector3::zeros(),
        };
        assert!(filter.start(&start).is_ok());
        let squares = (1..100).map(|k| {
            let reading = &readings[k as usize];
            let estimate = filter.step(reading.time_us, Some(reading)).unwrap();
            let (position, covariance) = (estimate.position_m, estimate.covariance_m2);
            let score = StepScore::new(&position, &covariance, &truth(k).0).unwrap();
            score.mahalanobis_squared
        });
        squares.sum::<f64>() / 99.0
    };
    let kalman = nees(&mut Kalman::new(
        calm,
        Correction::Extended,
        Origin::Population(PRIOR),
    ));
    let particles = nees(&mut RaoBlackwell::new(calm, PRIOR, 5));
    assert!(kalman > 6.0, "the turn surprises nobody: {kalman}");
    assert!(particles < 1.2 * kalman, "{particles}, Kalman {kalman}");
}

#[test]
fn resampling_keeps_the_moments_and_the_seed_decides() {
    let sigma = Vector4::new(0.1, 0.1, 100.0, 1.0);
    let z = expected(&Vector3::new(20.0, -14.0, 13.0), &Vector3::zeros());
    let mut filter = started(&reading(0, &z, &sigma));
    let before = filter.estimate(None).unwrap();
    let mut twin = filter.clone();
    let radar_m = Vector3::zeros();
    assert!(filter.resample(&radar_m).is_ok() && twin.resample(&radar_m).is_ok());
    assert_eq!(filter.particles, twin.particles);
    assert!((filter.effective_particles() - PARTICLES as f64).abs() < 1e-9);
    let after = filter.estimate(None).unwrap();
    // Forty draws: a standard error of 0.08 sd in a mean, 0.11 in a standard deviation.
    for axis in 0..3 {
        let sd = before.covariance_m2[(axis, axis)].sqrt();
        assert!((after.position_m[axis] - before.position_m[axis]).abs() < 0.3 * sd);
        let ratio = after.covariance_m2[(axis, axis)].sqrt() / sd;
        assert!((ratio - 1.0).abs() < 0.35, "{ratio}");
    }
}

#[test]
fn it_must_be_started() {
    let mut filter = RaoBlackwell::new(MOTION, PRIOR, 1);
    assert_eq!(filter.step(0, None), Err(FilterError::NotStarted));
}
