//! A window against its slope, its halves and its lost flights.

use super::*;
use crate::flights::generator::{GeneratorSettings, generate};
use crate::recursive::carry::Carry;
use crate::recursive::encounter::Encounter;
use crate::recursive::network::Network;
use crate::recursive::network::sampling::Sampling;
use crate::recursive::network::shape::{LAYERS, PARAMETERS};
use crate::recursive::normalisation::Normalisation;
use crate::recursive::population::population_of;
use crate::recursive::recipe::Recipe;
use crate::recursive::step::Weighing;
use bnkf::recursive::parameters::Parameters;

const STEPS: usize = 25;

fn encounters(count: usize) -> Vec<Encounter> {
    let settings = GeneratorSettings {
        flights: 8,
        ..GeneratorSettings::default()
    };
    let flights = generate(&settings).unwrap();
    let population = population_of(&flights).unwrap();
    (0..count)
        .filter_map(|lane| Recipe::DEFAULT.encounter(&flights, &population, 0, lane))
        .collect()
}

/// Encounters of different lengths, the last ones the shortest.
pub fn unequal(count: usize) -> Vec<Encounter> {
    let mut encounters = encounters(count);
    assert_eq!(encounters.len(), count);
    for (index, encounter) in encounters.iter_mut().enumerate() {
        let steps = 17 + 2 * (count - index);
        encounter.arrivals.truncate(steps);
        encounter.truths_m.truncate(steps);
        assert_eq!(encounter.arrivals.len(), steps);
    }
    encounters
}

fn batches() -> Vec<Batch> {
    Batch::groups(&encounters(2 * LANES))
}

fn network() -> Network {
    let mut network = Network::new(7);
    // A last layer that schedules something.
    for i in PARAMETERS - 65 * OUTPUT_COLUMNS..PARAMETERS {
        network.means[i] *= 10.0;
    }
    network
}

#[test]
fn the_gradient_of_a_window_is_the_slope_of_its_loss() {
    assert_eq!(LAYERS, 5);
    let programs = Programs::new(&Parameters::PAPER, &Normalisation::IDENTITY, Weighing::All);
    let (batches, network, tier) = (batches(), network(), Tier::detect());
    let loss = |network: &Network, gradient: Option<&mut Gradient>| {
        let weights = network.weights(tier, Sampling::Nothing);
        let mut run = Unrolled::new(&programs, batches.len(), STEPS, 0.0);
        run.begin(&batches);
        let loss = run.forward(&weights, &batches, 0..STEPS, 0);
        assert_eq!(loss.lost, 0);
        if let Some(gradient) = gradient {
            run.backward(&weights, &batches, 0..STEPS, 1.0, gradient);
        }
        loss.sum
    };
    let mut gradient = Gradient::zeros();
    loss(&network, Some(&mut gradient));
    for seed in 0..4 {
        // Along the gradient of a random quarter of the weights, so that the slope is large.
        let chosen = |i: usize| derive(seed, &[i as u64]).is_multiple_of(4);
        let by_mean = gradient.by_mean();
        let norm = (0..PARAMETERS)
            .filter(|&i| chosen(i))
            .map(|i| f64::from(by_mean[i]).powi(2))
            .sum::<f64>()
            .sqrt();
        let h = 2e-4;
        let moved = |sign: f64| {
            let mut moved = network.clone();
            for i in (0..PARAMETERS).filter(|&i| chosen(i)) {
                moved.means[i] += (sign * h * f64::from(by_mean[i]) / norm) as f32;
            }
            loss(&moved, None)
        };
        let slope = (moved(1.0) - moved(-1.0)) / (2.0 * h);
        assert!((slope / norm - 1.0).abs() < 0.02, "{slope} {norm}");
    }
}

/// Every step's position error and the root of its covariance's trace, metres, and whether it
/// teaches.
fn errors(run: &Unrolled<'_>, batches: &[Batch]) -> Vec<(f64, f64, bool)> {
    let mut errors = Vec::new();
    for (group, batch) in batches.iter().enumerate() {
        for at in 0..STEPS {
            for lane in 0..LANES {
                let flat: Vec<f64> = run.carry(at + 1, group).iter().map(|n| n[lane]).collect();
                let carry = Carry::unflatten(&flat);
                let axes = 0..3;
                let error = axes
                    .clone()
                    .map(|axis| (carry.state[axis] - batch.truths_m[at][axis][lane]).powi(2));
                let variance = axes.map(|axis| carry.covariance[axis][axis]);
                errors.push((
                    error.sum::<f64>().sqrt(),
                    variance.sum::<f64>().sqrt(),
                    run.seeds[at][group][lane] > 0.0,
                ));
            }
        }
    }
    errors
}

/// What the distance adds to the gradient is the slope of the distances over standard deviations
/// that stay what they were.
#[test]
fn the_distance_teaches_beside_the_likelihood() {
    let programs = Programs::new(&Parameters::PAPER, &Normalisation::IDENTITY, Weighing::All);
    let (batches, network, tier) = (batches(), network(), Tier::detect());
    let run = |network: &Network, distance_weight: f64| {
        let weights = network.weights(tier, Sampling::Nothing);
        let mut run = Unrolled::new(&programs, batches.len(), STEPS, distance_weight);
        run.begin(&batches);
        run.forward(&weights, &batches, 0..STEPS, 0);
        let mut gradient = Gradient::zeros();
        run.backward(&weights, &batches, 0..STEPS, 1.0, &mut gradient);
        (errors(&run, &batches), gradient.by_mean().to_vec())
    };
    let (before, plain) = run(&network, 0.0);
    let (_, both) = run(&network, 100.0);
    let added: Vec<f64> = both
        .iter()
        .zip(&plain)
        .map(|(b, p)| f64::from(b - p) / 100.0)
        .collect();
    let norm = added.iter().map(|x| x * x).sum::<f64>().sqrt();
    let h = 2e-4;
    let moved = |sign: f64| -> f64 {
        let mut moved = network.clone();
        for i in 0..PARAMETERS {
            moved.means[i] += (sign * h * added[i] / norm) as f32;
        }
        let after = run(&moved, 0.0).0;
        after
            .iter()
            .zip(&before)
            .filter(|(_, (_, _, teaches))| *teaches)
            .map(|((e, ..), (_, sigma, _))| e / sigma)
            .sum()
    };
    let slope = (moved(1.0) - moved(-1.0)) / (2.0 * h);
    // The network's arithmetic is f32; steps that do not teach, counted in, would make 2.4 %.
    assert!((slope / norm - 1.0).abs() < 0.02, "{slope} {norm}");
}

#[test]
fn two_windows_are_one() {
    let programs = Programs::new(&Parameters::PAPER, &Normalisation::IDENTITY, Weighing::All);
    let (batches, tier) = (batches(), Tier::detect());
    let weights = network().weights(tier, Sampling::Nothing);
    let mut whole = Unrolled::new(&programs, batches.len(), STEPS, 0.0);
    whole.begin(&batches);
    let once = whole.forward(&weights, &batches, 0..STEPS, 0);
    let mut parts = Unrolled::new(&programs, batches.len(), STEPS, 0.0);
    parts.begin(&batches);
    let first = parts.forward(&weights, &batches, 0..10, 0);
    parts.roll(10);
    let second = parts.forward(&weights, &batches, 10..STEPS, 0);
    assert!((once.sum - first.sum - second.sum).abs() < 1e-9 * once.sum.abs());
    assert_eq!(once.steps, first.steps + second.steps);
    assert_eq!(whole.carry(STEPS, 1), parts.carry(STEPS - 10, 1));
}

#[test]
fn a_lost_flight_starts_anew_and_is_scored_no_more() {
    let programs = Programs::new(&Parameters::PAPER, &Normalisation::IDENTITY, Weighing::All);
    let (mut batches, tier) = (batches(), Tier::detect());
    batches[1].arrivals[3][1][2] = 1.0;
    batches[1].arrivals[3][4][2] = f64::NAN;
    let weights = network().weights(tier, Sampling::Nothing);
    let mut run = Unrolled::new(&programs, batches.len(), STEPS, 0.0);
    run.begin(&batches);
    let loss = run.forward(&weights, &batches, 0..10, 0);
    assert_eq!(loss.lost, 1);
    assert!(loss.sum.is_finite());
    assert_eq!(loss.steps, (2 * LANES * 10 - 7) as f64);
    let mut gradient = Gradient::zeros();
    run.backward(&weights, &batches, 0..10, 1.0, &mut gradient);
    assert!(gradient.by_mean().iter().all(|g| g.is_finite()));
}
