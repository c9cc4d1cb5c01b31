//! The firmware's moments without passes beside many passes, on every shipped model and under every
//! noise: what `model-export moments MODEL` asks, with fewer inputs and passes. `docs/results/moments.md`
//! has the figures of a million passes.

use bnkf::blob::Blob;
use bnkf_model_export::flights::generator::generate;
use bnkf_model_export::moments::comparison::{
    COVARIANCE_MEDIAN_MAX, COVARIANCE_P95_MAX, Errors, References, references,
};
use bnkf_model_export::moments::inputs::{Level, levels};
use bnkf_model_export::recursive::scenario::Scenario;
use tolerance::MOMENTS_MEAN;

mod tolerance;

/// For each network and noise.
const INPUTS: usize = 12;
/// They err by 1 % of the covariance and 0.007 sigma of the mean, in squares beside what the moments do.
const PASSES: u32 = 20_000;

/// For one noise after the other.
fn met(blob: &Blob<'_>, scenario: Scenario) -> Vec<Level> {
    let all = generate(&scenario.held_out_flights()).expect("flights");
    let flights: Vec<_> = all.into_iter().step_by(5).collect();
    levels(blob, scenario, &flights, INPUTS, 1)
}

fn sampled(blob: &Blob<'_>, levels: &[Level]) -> Vec<References> {
    references(blob, levels, PASSES, 1).expect("networks")
}

fn accepted(errors: &Errors) -> bool {
    let [median, p95, _] = errors.covariance;
    median <= COVARIANCE_MEDIAN_MAX && p95 <= COVARIANCE_P95_MAX && errors.mean[0] <= MOMENTS_MEAN
}

/// Every network under every noise stays within the limits of the command; the mean has what so few inputs and
/// passes add.
fn assert_accepted(bytes: &[u8], scenario: Scenario, networks: usize) {
    let blob = Blob::parse(bytes).expect("shipped blob");
    let all = sampled(&blob, &met(&blob, scenario));
    assert_eq!(all.len(), 3 * networks);
    for references in &all {
        let errors = Errors::of(&blob, references).expect("cases of the blob");
        let (network, level) = (references.network, &references.level);
        assert_eq!(errors.count, INPUTS);
        assert!(accepted(&errors), "network {network}, {level}: {errors:?}");
    }
}

#[test]
fn of_bnkf() {
    let blob = include_bytes!("../models/bnkf.bnkf");
    assert_accepted(blob, Scenario::Paper, 1);
}

#[test]
fn of_bnkfe() {
    let blob = include_bytes!("../models/bnkfe.bnkf");
    assert_accepted(blob, Scenario::Paper, 3);
}

#[test]
fn of_the_recursive_model() {
    let blob = include_bytes!("../models/recursive.bnkf");
    assert_accepted(blob, Scenario::Paper, 1);
}

#[test]
fn of_the_counter_uas_model() {
    let blob = include_bytes!("../models/recursive-counter-uas.bnkf");
    assert_accepted(blob, Scenario::CounterUas, 1);
}

/// One tenth more variance than the passes have is not accepted, nor is a mean that is off.
#[test]
fn wrong_moments_are_not_accepted() {
    let blob = Blob::parse(include_bytes!("../models/bnkfe.bnkf")).expect("shipped blob");
    let mut all = sampled(&blob, &met(&blob, Scenario::Paper)[..1]);
    let right = Errors::of(&blob, &all[0]).expect("cases of the blob");
    let mut shifted = all[0].clone();
    for (_, reference) in &mut all[0].cases {
        reference.covariance[0][0] /= 1.1;
    }
    for (_, reference) in &mut shifted.cases {
        reference.mean[0] += 0.05 * reference.covariance[0][0].sqrt();
    }
    let [wide, shifted] =
        [&all[0], &shifted].map(|all| Errors::of(&blob, all).expect("cases of the blob"));
    assert!(accepted(&right) && !accepted(&wide) && !accepted(&shifted));
}
