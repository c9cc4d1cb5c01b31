//! What passes with frozen spreads say beside exact ones, for every shipped model.

mod tolerance;

use bnkf::Spread;
use bnkf::blob::Blob;
use bnkf::gaussian::standard_normal;
use bnkf::network::monte_carlo::{Sampling, moments, separate_moments};
use bnkf::network::{Network, Scratch};
use bnkf::rng::seeded;
use tolerance::FROZEN_SPREADS;

const MODELS: [(&str, &[u8]); 4] = [
    ("bnkf", include_bytes!("../models/bnkf.bnkf")),
    ("bnkfe", include_bytes!("../models/bnkfe.bnkf")),
    ("recursive", include_bytes!("../models/recursive.bnkf")),
    (
        "recursive-counter-uas",
        include_bytes!("../models/recursive-counter-uas.bnkf"),
    ),
];
/// Random inputs of each network, and exact passes in the runs that stand for the truth.
const INPUTS: u64 = 4;
const TRUTH: [u16; 4] = [10_000; 4];
/// Passes and runs of so many.
const TRIALS: [(u16, u64); 2] = [(16, 600), (100, 320)];

/// Covariance of the outputs of a memoryless network, variances of those of a recursive one: what the
/// trackers ask for.
fn covariance(
    network: &Network<'_>,
    inputs: &[f32],
    (passes, spread, seed): (u16, Spread, u64),
) -> Vec<f64> {
    let (mut scratch, mut rng) = (Scratch::new(), seeded(seed));
    let way = Sampling::Activations(spread);
    let values = match network.outputs() {
        1 => moments::<1>(network, inputs, passes, way, &mut rng, &mut scratch)
            .covariance
            .concat(),
        3 => moments::<3>(network, inputs, passes, way, &mut rng, &mut scratch)
            .covariance
            .concat(),
        36 => separate_moments::<36>(network, inputs, passes, spread, &mut rng, &mut scratch)
            .1
            .to_vec(),
        outputs => panic!("{outputs} outputs"),
    };
    values.into_iter().map(f64::from).collect()
}

/// Root mean square over inputs and runs of the relative error of the covariance, exact and frozen, over the
/// same random words; for each of [`TRIALS`].
fn errors(network: &Network<'_>) -> [[f64; 2]; 2] {
    let mut squares = [[0.0; 2]; 2];
    for input in 0..INPUTS {
        let mut rng = seeded(900 + input);
        let inputs: Vec<f32> = (0..network.inputs())
            .map(|_| 0.8 * standard_normal(&mut rng))
            .collect();
        let mut truth: Vec<f64> = Vec::new();
        for (seed, passes) in (2_000..).zip(TRUTH) {
            let part = covariance(network, &inputs, (passes, Spread::Exact, seed));
            truth.resize(part.len(), 0.0);
            for (sum, value) in truth.iter_mut().zip(part) {
                *sum += value / TRUTH.len() as f64;
            }
        }
        let size: f64 = truth.iter().map(|value| value * value).sum();
        for (squares, (passes, runs)) in squares.iter_mut().zip(TRIALS) {
            for (square, spread) in squares.iter_mut().zip([Spread::Exact, Spread::Frozen]) {
                for seed in 0..runs {
                    let got = covariance(network, &inputs, (passes, spread, seed));
                    let error = got.iter().zip(&truth).map(|(got, truth)| got - truth);
                    let relative = error.map(|error| error * error).sum::<f64>() / size;
                    *square += relative / (INPUTS * runs) as f64;
                }
            }
        }
    }
    squares.map(|squares| squares.map(f64::sqrt))
}

#[test]
fn freezing_adds_little_to_the_error_of_the_covariance() {
    for (name, bytes) in MODELS {
        let blob = Blob::parse(bytes).unwrap();
        for network in blob.networks().map(Network::new) {
            for ([exact, frozen], (passes, _)) in errors(&network).into_iter().zip(TRIALS) {
                let said = format!("{name}, {passes} passes: exact {exact:.4}, frozen {frozen:.4}");
                println!("{said}");
                assert!(frozen < exact * (1.0 + FROZEN_SPREADS), "{said}");
            }
        }
    }
}
