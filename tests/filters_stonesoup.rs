//! EKF and UKF against values that Stone Soup computed (tests/golden/stonesoup_filters.py).

mod tolerance;

use bnkf_host_sim::baseline::kalman::Kalman;
use bnkf_host_sim::baseline::motion::WhiteAcceleration;
use bnkf_host_sim::filter::{Filter, Start};
use bnkf_model_export::reading::Reading;
use serde_json::Value;

const GOLDEN: &str = include_str!("golden/stonesoup_filters.json");

fn numbers(value: &Value) -> Vec<f64> {
    let entries = value.as_array().expect("an array");
    entries
        .iter()
        .map(|x| x.as_f64().expect("a number"))
        .collect()
}

fn reading(level: &Value, z: &Value, time_us: u64) -> Reading {
    let sigma = |name: &str| level["sigmas"][name].as_f64().expect("a number");
    let z = numbers(z);
    Reading {
        time_us,
        elevation_rad: z[0],
        azimuth_rad: z[1],
        range_m: z[2],
        range_rate_mps: z[3],
        sigma_range_m: sigma("range_m"),
        sigma_elevation_rad: sigma("elevation_rad"),
        sigma_azimuth_rad: sigma("azimuth_rad"),
        sigma_range_rate_mps: sigma("range_rate_mps"),
    }
}

/// Runs one level and returns the largest relative differences of mean and covariance. A mean
/// is relative to its own norm (position and velocity apart), a covariance entry to the standard
/// deviations it joins.
fn differences(
    mut filter: Kalman<WhiteAcceleration, 6>,
    level: &Value,
    kind: &str,
    every: usize,
) -> (f64, f64) {
    let prior = numbers(&level["prior_mean"]);
    let readings = level["readings"].as_array().expect("readings");
    let means = level[kind]["mean"].as_array().expect("means");
    let covariances = level[kind]["covariance_upper"]
        .as_array()
        .expect("covariances");
    assert_eq!(
        (readings.len(), means.len(), covariances.len()),
        (144, 144, 144 / every)
    );

    let start = Start {
        reading: &reading(level, &readings[0], 0),
        true_position_m: [prior[0], prior[1], prior[2]].into(),
        true_velocity_mps: [prior[3], prior[4], prior[5]].into(),
    };
    filter.start(&start).expect("a started filter");
    let (mut mean_worst, mut covariance_worst) = (0.0_f64, 0.0_f64);
    for (k, z) in readings.iter().enumerate() {
        let time_us = 100_000 * (k as u64 + 1);
        filter
            .step(time_us, Some(&reading(level, z, time_us)))
            .expect("an estimate");
        let belief = filter.belief().expect("a belief");
        let golden = nalgebra::Vector6::from_column_slice(&numbers(&means[k]));
        let difference = belief.mean - golden;
        for first in [0, 3] {
            let part = difference.fixed_rows::<3>(first).norm();
            mean_worst = mean_worst.max(part / golden.fixed_rows::<3>(first).norm());
        }
        if (k + 1) % every == 0 {
            let upper = numbers(&covariances[(k + 1) / every - 1]);
            let entries = (0..6).flat_map(|i| (i..6).map(move |j| (i, j)));
            for ((i, j), golden) in entries.zip(upper) {
                let p = &belief.covariance;
                let scale = (p[(i, i)] * p[(j, j)]).sqrt();
                covariance_worst = covariance_worst.max((p[(i, j)] - golden).abs() / scale);
            }
        }
    }
    (mean_worst, covariance_worst)
}

fn compare(make: fn() -> Kalman<WhiteAcceleration, 6>, kind: &str) {
    let golden: Value = serde_json::from_str(GOLDEN).expect("valid JSON");
    let every = golden["covariance_every"].as_u64().expect("a number") as usize;
    let levels = golden["levels"].as_array().expect("levels");
    assert_eq!(levels.len(), 3);
    for level in levels {
        let (mean, covariance) = differences(make(), level, kind, every);
        println!(
            "{} {kind}: mean {mean:.1e}, covariance {covariance:.1e}",
            level["noise"]
        );
        assert!(
            mean < tolerance::FILTER_RELATIVE,
            "{} {kind}: mean off by {mean:e}",
            level["noise"]
        );
        assert!(
            covariance < tolerance::FILTER_RELATIVE,
            "{} {kind}: covariance off by {covariance:e}",
            level["noise"]
        );
    }
}

#[test]
fn ekf_equals_stone_soup_over_144_steps() {
    compare(Kalman::paper_ekf, "ekf");
}

#[test]
fn ukf_equals_stone_soup_over_144_steps() {
    compare(Kalman::paper_ukf, "ukf");
}
