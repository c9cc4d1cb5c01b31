//! The firmware's Bayesian network against PyTorch, and its two ways of sampling against each
//! other, on a small network that an independent script wrote.

mod tolerance;

use bnkf::Spread;
use bnkf::blob::Blob;
use bnkf::network::monte_carlo::{Moments, Sampling, moments};
use bnkf::network::{Network, Scratch};
use bnkf::rng::seeded;
use serde_json::Value;
use tolerance::{
    MEAN_WEIGHT_OUTPUT, MONTE_CARLO_STANDARD_ERRORS, QUANTISED_COVARIANCE, QUANTISED_MEAN_SIGMAS,
};

const BNKF: &[u8] = include_bytes!("golden/tiny_bnkf.bnkf");
const BNKFE: &[u8] = include_bytes!("golden/tiny_bnkfe.bnkf");
const BATCHES: usize = 10;
const PASSES: u16 = 10_000;

fn golden() -> Value {
    serde_json::from_str(include_str!("golden/torch_blob.json")).expect("valid JSON")
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().expect("list");
    list.iter()
        .map(|number| number.as_f64().expect("number"))
        .collect()
}

fn input(case: &Value) -> Vec<f32> {
    numbers(&case["input"])
        .into_iter()
        .map(|x| x as f32)
        .collect()
}

#[test]
fn mean_weights_give_torchs_outputs() {
    let (joint, ensemble) = (Blob::parse(BNKF).unwrap(), Blob::parse(BNKFE).unwrap());
    for case in golden()["cases"].as_array().expect("list") {
        let networks = joint.networks().chain(ensemble.networks());
        for (view, expected) in networks.zip(case["mean_weight_outputs"].as_array().unwrap()) {
            let network = Network::new(view);
            let expected = numbers(expected);
            let mut outputs = [0.0; 3];
            network.mean_pass(&input(case), &mut outputs[..expected.len()]);
            let largest = expected.iter().fold(1.0_f64, |a, b| a.max(b.abs()));
            for (output, expected) in outputs.iter().zip(&expected) {
                let error = (f64::from(*output) - expected).abs();
                assert!(error < MEAN_WEIGHT_OUTPUT * largest, "{output} {expected}");
            }
        }
    }
}

/// Mean and covariance over [`BATCHES`] times [`PASSES`] passes, with standard errors from the
/// spread of the batches' own Gaussian theory.
struct Sampled {
    mean: [f64; 3],
    covariance: [[f64; 3]; 3],
}

fn sample(case: &Value, sampling: Sampling, seed: u64) -> Sampled {
    let blob = Blob::parse(BNKF).unwrap();
    let network = Network::new(blob.networks().next().unwrap());
    let (mut rng, mut scratch) = (seeded(seed), Scratch::new());
    let mut batches = Vec::new();
    for _ in 0..BATCHES {
        let batch: Moments<3> = moments(
            &network,
            &input(case),
            PASSES,
            sampling,
            &mut rng,
            &mut scratch,
        );
        batches.push(batch);
    }
    let average =
        |f: &dyn Fn(&Moments<3>) -> f64| batches.iter().map(f).sum::<f64>() / BATCHES as f64;
    let mean: [f64; 3] = std::array::from_fn(|i| average(&|b| f64::from(b.mean[i])));
    let covariance = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            average(&|b| f64::from(b.covariance[i][j]))
                + average(&|b| (f64::from(b.mean[i]) - mean[i]) * (f64::from(b.mean[j]) - mean[j]))
        })
    });
    Sampled { mean, covariance }
}

fn assert_agrees(sampled: &Sampled, expected: &Sampled, errors: &Value, kernel: bool) {
    let mean_errors = numbers(&errors["mean_standard_error"]);
    let both = 2.0_f64.sqrt() * MONTE_CARLO_STANDARD_ERRORS;
    for i in 0..3 {
        let sigma = expected.covariance[i][i].sqrt();
        let shift = (sampled.mean[i] - expected.mean[i]).abs();
        let allowed = both * mean_errors[i]
            + if kernel {
                QUANTISED_MEAN_SIGMAS * sigma
            } else {
                0.0
            };
        assert!(shift < allowed, "mean {i}: {shift} > {allowed}");
        for j in 0..3 {
            let size = sigma * expected.covariance[j][j].sqrt();
            let error = numbers(&errors["covariance_standard_error"][i])[j];
            let difference = (sampled.covariance[i][j] - expected.covariance[i][j]).abs();
            let allowed = both * error
                + if kernel {
                    QUANTISED_COVARIANCE * size
                } else {
                    0.0
                };
            assert!(
                difference < allowed,
                "covariance {i} {j}: {difference} > {allowed}"
            );
        }
    }
}

#[test]
fn both_ways_of_sampling_agree_with_torch_and_each_other() {
    for (index, case) in golden()["cases"]
        .as_array()
        .expect("list")
        .iter()
        .enumerate()
    {
        let torch = &case["joint"];
        let mean = numbers(&torch["mean"]);
        let expected = Sampled {
            mean: std::array::from_fn(|i| mean[i]),
            covariance: std::array::from_fn(|i| {
                let row = numbers(&torch["covariance"][i]);
                std::array::from_fn(|j| row[j])
            }),
        };
        let activations = sample(
            case,
            Sampling::Activations(Spread::Exact),
            100 + index as u64,
        );
        let weights = sample(case, Sampling::Weights, 200 + index as u64);
        assert_agrees(&weights, &expected, torch, false);
        assert_agrees(&activations, &expected, torch, true);
        assert_agrees(&activations, &weights, torch, true);
    }
}
