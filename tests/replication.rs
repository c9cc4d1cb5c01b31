//! The paper's replica: its Monte Carlo moments against sampled weights, its objective against
//! differences, and the checked-in page against the checked-in results.

mod tolerance;

use bnkf_host_sim::replication::moments::Ensemble;
use bnkf_host_sim::replication::page::{made_part, tables};
use bnkf_host_sim::replication::results::Results;
use bnkf_host_sim::replication::scaling::Scaling;
use bnkf_model_export::kernel::Tier;
use bnkf_model_export::memoryless::gradient::{Batch, Gradient};
use bnkf_model_export::posterior::architecture::Architecture;
use bnkf_model_export::posterior::gaussian_weights::GaussianWeights;
use bnkf_model_export::posterior::network_f64::NetworkF64;
use bnkf_model_export::random_source::RandomSource;
use nalgebra::{Matrix6, Vector6};
use tolerance::{MONTE_CARLO_STANDARD_ERRORS, REPLICA_SLOPE};

const PASSES: usize = 10_000;

/// Features and physical targets of `count` examples.
fn examples(count: usize, outputs: usize) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let mut random = RandomSource::new(4, &[]);
    let mut draw = |width: usize, scale: f64| -> Vec<Vec<f64>> {
        let mut row = |_| (0..width).map(|_| 5.0 + scale * random.normal()).collect();
        (0..count).map(&mut row).collect()
    };
    (draw(5, 2.0), draw(outputs, 20.0))
}

fn network(outputs: usize, id: u64) -> GaussianWeights {
    let architecture = Architecture::new(vec![5, 24, 16, outputs]).unwrap();
    GaussianWeights::random(&architecture, 0.1, &mut RandomSource::new(id, &[]))
}

/// Mean and covariance of passes that sample every single weight, in physical units.
fn by_sampled_weights(
    members: &[GaussianWeights],
    scaling: &Scaling,
    features: &[f64],
    random: &mut RandomSource,
) -> (Vector6<f64>, Matrix6<f64>) {
    let (mut mean, mut square) = (Vector6::zeros(), Matrix6::zeros());
    let networks: Vec<NetworkF64> = members.iter().map(NetworkF64::from).collect();
    for _ in 0..PASSES {
        let mut state = Vector6::zeros();
        let passes = networks
            .iter()
            .flat_map(|network| network.weight_sampled_pass(features, || random.normal()));
        for (output, value) in passes.enumerate() {
            state[output] = scaling.physical(output, value as f32);
        }
        mean += state;
        square += state * state.transpose();
    }
    mean /= PASSES as f64;
    (mean, square / PASSES as f64 - mean * mean.transpose())
}

#[test]
fn moments_are_those_of_sampled_weights() {
    for (members, outputs) in [
        (vec![network(6, 1)], 6),
        ((2..5).map(|id| network(1, id)).collect::<Vec<_>>(), 3),
    ] {
        let (features, targets) = examples(3, outputs);
        let scaling = Scaling::of(&features, &targets);
        let rows = scaling.rows(&features, &targets, members.len() > 1);
        let mut ensemble = Ensemble::new(&members, scaling.clone(), outputs, PASSES);
        let found = ensemble.moments(&rows, 9);
        let mut random = RandomSource::new(5, &[]);
        for (row, found) in found.iter().enumerate() {
            let inputs: Vec<f64> = rows
                .features_of(row)
                .iter()
                .map(|x| f64::from(*x))
                .collect();
            let (mean, covariance) = by_sampled_weights(&members, &scaling, &inputs, &mut random);
            // Two independent runs: twice the variance of one.
            let allowed = MONTE_CARLO_STANDARD_ERRORS * (2.0 / PASSES as f64).sqrt();
            for a in 0..outputs {
                let sigma = covariance[(a, a)].sqrt();
                assert!(sigma > 0.1, "the weights' spread shows in the output");
                assert!(
                    (found.mean[a] - mean[a]).abs() < allowed * sigma,
                    "row {row} output {a}"
                );
                for b in 0..outputs {
                    if a != b && members.len() > 1 {
                        assert_eq!(found.covariance[(a, b)], 0.0);
                        continue;
                    }
                    // Of a sample covariance: sqrt((v_a v_b + c^2) / n); tails beyond a Gaussian's
                    // widen it by less than a half.
                    let spread = (covariance[(a, a)] * covariance[(b, b)]
                        + covariance[(a, b)].powi(2))
                    .sqrt();
                    let error = found.covariance[(a, b)] - covariance[(a, b)];
                    assert!(error.abs() < 1.5 * allowed * spread, "row {row}: {a} {b}");
                }
            }
            for unused in outputs..6 {
                assert_eq!(
                    (found.mean[unused], found.covariance[(unused, unused)]),
                    (0.0, 0.0)
                );
            }
        }
    }
}

#[test]
fn the_loss_is_the_mean_squared_error_in_metres_and_its_slope_is_the_gradient() {
    let (features, targets) = examples(200, 3);
    let scaling = Scaling::of(&features, &targets);
    let rows = scaling.rows(&features, &targets, false);
    let order: Vec<u32> = (0..200).collect();
    let batch = Batch {
        rows: &rows,
        order: &order,
        first_target: 0,
        noise_seed: None,
    };
    let weights = network(3, 6);
    let mut gradient = Gradient::new(Tier::detect(), &weights);
    let loss = gradient.loss_and_gradient(batch) / 200.0;
    let naive = |weights: &GaussianWeights| -> f64 {
        let network = NetworkF64::from(weights);
        let squares = (0..200).map(|row| {
            let inputs: Vec<f64> = rows
                .features_of(row)
                .iter()
                .map(|x| f64::from(*x))
                .collect();
            let outputs = network.mean_pass(&inputs);
            let errors = outputs.iter().enumerate().map(|(output, value)| {
                scaling.physical(output, *value as f32) - targets[row][output]
            });
            errors.map(|error| error * error).sum::<f64>() / 3.0
        });
        squares.sum::<f64>() / 200.0
    };
    assert!(
        (loss / naive(&weights) - 1.0).abs() < REPLICA_SLOPE,
        "{loss}"
    );
    let largest = gradient.by_mean.iter().fold(0.0_f32, |m, g| m.max(g.abs()));
    for index in (0..weights.means.len()).step_by(7) {
        let at = |step: f32| {
            let mut moved = weights.clone();
            moved.means[index] += step;
            naive(&moved)
        };
        let slope = (at(1e-2) - at(-1e-2)) / 2e-2;
        let error = slope - f64::from(gradient.by_mean[index]);
        assert!(error.abs() < REPLICA_SLOPE * f64::from(largest), "{index}");
    }
}

#[test]
fn the_checked_in_page_holds_the_checked_in_results() {
    let page = include_str!("../docs/results/replication.md");
    let json = include_str!("../docs/results/replication/replication.json");
    let results: Results = serde_json::from_str(json).expect("the command's JSON");
    let made = made_part(page).expect("the page has its markers");
    let tables = tables(&results);
    for (number, (line, expected)) in made.lines().zip(tables.lines()).enumerate() {
        assert_eq!(line, expected, "line {number} of the tables");
    }
    assert_eq!(made.len(), tables.len());
    let csv = include_str!("../docs/results/replication/replication.csv");
    assert!(csv.as_bytes() == results.csv(), "another CSV");
    assert!(!results.provenance.quick);
}
