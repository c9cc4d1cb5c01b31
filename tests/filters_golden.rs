//! The baselines against values that Stone Soup and FilterPy computed (tests/golden/*.py).

mod tolerance;

use bnkf_host_sim::baseline::bank::{FiveTurns, SOJOURN_S};
use bnkf_host_sim::baseline::correction::Correction;
use bnkf_host_sim::baseline::imm::Imm;
use bnkf_host_sim::baseline::kalman::{Kalman, PAPER_Q_M2_S3};
use bnkf_host_sim::baseline::motion::WhiteAcceleration;
use bnkf_host_sim::baseline::origin::Origin;
use bnkf_host_sim::baseline::sigma_points::Spread;
use bnkf_host_sim::filter::{Filter, Start};
use bnkf_model_export::radar::pose::Pose;
use bnkf_model_export::radar::reading::Reading;
use nalgebra::{Matrix6, Vector6};
use serde_json::Value;

const STONE_SOUP: &str = include_str!("golden/stonesoup_filters.json");
const FILTER_PY: &str = include_str!("golden/filterpy_imm.json");

const STEPS: usize = 144;

fn parsed(text: &str) -> Value {
    serde_json::from_str(text).expect("valid JSON")
}

fn entries(value: &Value) -> &[Value] {
    value.as_array().expect("an array")
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn numbers(value: &Value) -> Vec<f64> {
    entries(value).iter().map(number).collect()
}

fn reading(level: &Value, z: &Value, time_us: u64) -> Reading {
    let (sigmas, z) = (&level["sigmas"], numbers(z));
    Reading {
        time_us,
        elevation_rad: z[0],
        azimuth_rad: z[1],
        range_m: z[2],
        range_rate_mps: z[3],
        sigma_range_m: number(&sigmas["range_m"]),
        sigma_elevation_rad: number(&sigmas["elevation_rad"]),
        sigma_azimuth_rad: number(&sigmas["azimuth_rad"]),
        sigma_range_rate_mps: number(&sigmas["range_rate_mps"]),
        sensor: Pose::ORIGIN,
        late_us: 0,
    }
}

/// What `record` says of a filter after each of the sequence's steps.
fn run<F: Filter, T>(mut filter: F, level: &Value, record: impl Fn(&F) -> T) -> Vec<T> {
    let prior = numbers(&level["prior_mean"]);
    let readings = entries(&level["readings"]);
    assert_eq!(readings.len(), STEPS);
    let start = Start {
        reading: &reading(level, &readings[0], 0),
        true_position_m: [prior[0], prior[1], prior[2]].into(),
        true_velocity_mps: [prior[3], prior[4], prior[5]].into(),
    };
    filter.start(&start).expect("a started filter");
    let after = |(k, z): (usize, &Value)| {
        let time_us = 100_000 * (k as u64 + 1);
        let reading = reading(level, z, time_us);
        filter.step(time_us, Some(&reading)).expect("an estimate");
        record(&filter)
    };
    readings.iter().enumerate().map(after).collect()
}

/// Asserts that a mean is right relative to its own norm, position and velocity apart.
fn assert_mean(mean: &Vector6<f64>, golden: &Value, what: &str) {
    let golden = Vector6::from_column_slice(&numbers(golden));
    for first in [0, 3] {
        let error = (mean - golden).fixed_rows::<3>(first).norm();
        let relative = error / golden.fixed_rows::<3>(first).norm();
        assert!(
            relative < tolerance::FILTER_RELATIVE,
            "{what}: mean off by {relative:e}"
        );
    }
}

/// Asserts that every covariance is right relative to the standard deviations it joins.
fn assert_covariance(p: &Matrix6<f64>, golden_upper: &Value, what: &str) {
    let upper = (0..6).flat_map(|i| (i..6).map(move |j| (i, j)));
    let golden = numbers(golden_upper);
    assert_eq!(golden.len(), 21);
    for ((i, j), golden) in upper.zip(golden) {
        let relative = (p[(i, j)] - golden).abs() / (p[(i, i)] * p[(j, j)]).sqrt();
        assert!(
            relative < tolerance::FILTER_RELATIVE,
            "{what}: ({i}, {j}) off by {relative:e}"
        );
    }
}

fn assert_equals_stone_soup(make: impl Fn() -> Kalman<WhiteAcceleration, 6>, kind: &str) {
    let golden = parsed(STONE_SOUP);
    let every = number(&golden["covariance_every"]) as usize;
    assert_eq!(entries(&golden["levels"]).len(), 3);
    for level in entries(&golden["levels"]) {
        let beliefs = run(make(), level, |f| *f.belief().expect("a belief"));
        let means = entries(&level[kind]["mean"]);
        let covariances = entries(&level[kind]["covariance_upper"]);
        assert_eq!((means.len(), covariances.len()), (STEPS, STEPS / every));
        for (k, belief) in beliefs.iter().enumerate() {
            let what = format!("{} {kind}, step {}", level["noise"], k + 1);
            assert_mean(&belief.mean, &means[k], &what);
            if (k + 1) % every == 0 {
                let golden = &covariances[(k + 1) / every - 1];
                assert_covariance(&belief.covariance, golden, &what);
            }
        }
    }
}

#[test]
fn ekf_equals_stone_soup_over_144_steps() {
    assert_equals_stone_soup(Kalman::paper_ekf, "ekf");
}

#[test]
fn ukf_equals_stone_soup_over_144_steps() {
    assert_equals_stone_soup(Kalman::paper_ukf, "ukf");
}

#[test]
fn ckf_equals_stone_soup_over_144_steps() {
    let motion = WhiteAcceleration {
        q_m2_s3: PAPER_Q_M2_S3,
    };
    let cubature = Correction::SigmaPoints(Spread::CUBATURE);
    assert_equals_stone_soup(|| Kalman::new(motion, cubature, Origin::Truth), "ckf");
}

#[test]
fn imm_equals_filter_py_over_144_steps() {
    let (sequences, golden) = (parsed(STONE_SOUP), parsed(FILTER_PY));
    assert_eq!(number(&golden["sojourn_s"]), SOJOURN_S);
    let turns = FiveTurns {
        turn_rate_radps: number(&golden["turn_rate_radps"]),
        damping_per_s: number(&golden["damping_per_s"]),
        q_m2_s3: number(&golden["q_m2_s3"]),
    };
    let every = number(&golden["every"]) as usize;
    for (level, golden) in entries(&sequences["levels"])
        .iter()
        .zip(entries(&golden["levels"]))
    {
        assert_eq!(level["noise"], golden["noise"]);
        let steps = run(Imm::five(&turns, Origin::Truth), level, |f| {
            let probabilities = f.modes().expect("modes").map(|mode| mode.probability);
            (f.belief().expect("a belief"), probabilities)
        });
        assert_eq!(entries(&golden["mean"]).len(), STEPS / every);
        for (i, k) in (every - 1..STEPS).step_by(every).enumerate() {
            let what = format!("{} imm, step {}", level["noise"], k + 1);
            let (belief, probabilities) = &steps[k];
            assert_mean(&belief.mean, &golden["mean"][i], &what);
            assert_covariance(&belief.covariance, &golden["covariance_upper"][i], &what);
            for (ours, theirs) in probabilities.iter().zip(numbers(&golden["probability"][i])) {
                assert!(
                    (ours - theirs).abs() < tolerance::FILTER_RELATIVE,
                    "{what}: probability"
                );
            }
        }
    }
}
