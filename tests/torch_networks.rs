//! Networks that torchbnn and bayesian-torch trained, imported: their blobs against what PyTorch computes with
//! the unrounded weights (`golden/torch_networks.py`).

mod tolerance;

use bnkf::Spread;
use bnkf::blob::{Activation, Blob, FeatureLayout};
use bnkf::network::monte_carlo::{Moments, Sampling, moments};
use bnkf::network::repeats::Repeats;
use bnkf::network::{self, Network, Scratch};
use bnkf::rng::seeded;
use bnkf_model_export::import::{layers, model, recipe, weight_file};
use bnkf_model_export::moments::reference::decoded;
use bnkf_model_export::posterior::gaussian_weights::GaussianWeights;
use bnkf_model_export::posterior::network_f64::NetworkF64;
use serde_json::Value;
use std::path::Path;
use tolerance::{
    IMPORTED_COVARIANCE, IMPORTED_KERNEL, IMPORTED_MEAN_SIGMAS, IMPORTED_MOMENTS, IMPORTED_WEIGHTS,
    MONTE_CARLO_STANDARD_ERRORS,
};

const BATCHES: usize = 10;
const PASSES: u16 = 10_000;

fn folder() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/torch_networks")
}

fn golden() -> Vec<Value> {
    let text = include_str!("golden/torch_networks/values.json");
    let values: Value = serde_json::from_str(text).expect("valid JSON");
    values["networks"].as_array().expect("list").clone()
}

/// The networks of a file, and their blob.
fn imported(golden: &Value) -> (Vec<GaussianWeights>, Vec<u8>) {
    let text = |key: &str| golden[key].as_str().expect("text").to_owned();
    let recipe = std::fs::read_to_string(folder().join(text("name") + ".toml")).expect("a recipe");
    let recipe = recipe::parse(&recipe).unwrap_or_else(|e| panic!("{e}"));
    let bytes = std::fs::read(folder().join(text("file"))).expect("a file of weights");
    let file = weight_file::parse(&bytes).unwrap_or_else(|e| panic!("{e}"));
    let (names, inputs) = (recipe.layers.as_deref(), recipe.features.len());
    let networks = layers::networks(&file, recipe.convention, names, inputs);
    let networks = networks.unwrap_or_else(|e| panic!("{e}"));
    let blob = model::blob(&recipe, &networks).unwrap_or_else(|e| panic!("{e}"));
    (networks, blob)
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().expect("list").iter();
    list.map(|number| number.as_f64().expect("number"))
        .collect()
}

fn cases(golden: &Value) -> Vec<(Vec<f64>, &Value)> {
    let cases = golden["cases"].as_array().expect("list").iter();
    cases.map(|case| (numbers(&case["input"]), case)).collect()
}

#[test]
fn every_file_becomes_the_blob_of_its_recipe() {
    use Activation::{Gelu, Identity, Relu, Tanh};
    use FeatureLayout::{Polar12, Polar13};
    let expected = [
        ("relu", Relu, 3, Polar13, 1),
        ("tanh", Tanh, 3, Polar13, 1),
        ("identity", Identity, 3, Polar12, 1),
        ("gelu", Gelu, 2, Polar12, 1),
        ("axes", Relu, 3, Polar13, 3),
    ];
    let golden = golden();
    assert_eq!(golden.len(), expected.len());
    for (golden, (name, activation, version, features, networks)) in golden.iter().zip(expected) {
        let (_, bytes) = imported(golden);
        let blob = Blob::parse(&bytes).expect("valid");
        assert_eq!(golden["name"], name);
        assert_eq!((blob.version(), blob.features()), (version, features));
        assert_eq!((blob.network_count(), blob.passes()), (networks, 100));
        assert!(blob.networks().all(|n| n.activation() == activation));
    }
}

/// The unrounded weights are the file's: what is left is the f32 of the file in f64 sums.
#[test]
fn unrounded_weights_give_torchs_outputs() {
    for golden in golden() {
        let (networks, bytes) = imported(&golden);
        let blob = Blob::parse(&bytes).expect("valid");
        let activation = blob.networks().next().expect("one").activation();
        for (input, case) in cases(&golden) {
            let naive = |weights: &GaussianWeights| NetworkF64 {
                activation,
                ..NetworkF64::from(weights)
            };
            let got = networks.iter().flat_map(|n| naive(n).mean_pass(&input));
            for (got, expected) in got.zip(numbers(&case["mean_weight_outputs"])) {
                assert!((got - expected).abs() < 1e-9, "{got} {expected}");
            }
        }
    }
}

#[test]
fn mean_weights_are_torchs_within_the_rounding() {
    for golden in golden() {
        let (_, bytes) = imported(&golden);
        let blob = Blob::parse(&bytes).expect("valid");
        for (input, case) in cases(&golden) {
            let input: Vec<f32> = input.iter().map(|&x| x as f32).collect();
            let mut got = Vec::new();
            for view in blob.networks() {
                let mut outputs = [0.0; 3];
                let outputs = &mut outputs[..blob.outputs()];
                Network::new(view).mean_pass(&input, outputs);
                got.extend(outputs.iter().map(|&x| f64::from(x)));
            }
            // The firmware adds next to nothing to what rounding did.
            let exact: Vec<f64> = input.iter().map(|&x| f64::from(x)).collect();
            let rounded = blob.networks().flat_map(|view| {
                let naive = NetworkF64 {
                    activation: view.activation(),
                    ..NetworkF64::from(&decoded(view).expect("a network"))
                };
                naive.mean_pass(&exact)
            });
            for (got, rounded) in got.iter().zip(rounded) {
                let error = (got - rounded).abs();
                assert!(error < IMPORTED_KERNEL, "{}: {error}", golden["name"]);
            }
            let expected = numbers(&case["mean_weight_outputs"]);
            let largest = expected.iter().fold(1.0_f64, |a, b| a.max(b.abs()));
            for (got, expected) in got.iter().zip(&expected) {
                let error = (got - expected).abs() / largest;
                assert!(error < IMPORTED_WEIGHTS, "{}: {error}", golden["name"]);
            }
        }
    }
}

/// Mean and covariance of so many passes, by the batch.
fn sampled<const N: usize>(network: &Network<'_>, input: &[f32], spread: Spread) -> Moments<N> {
    let (mut rng, mut scratch) = (seeded(7), Scratch::new());
    let way = Sampling::Activations(spread);
    let mut sum = Moments {
        mean: [0.0; N],
        covariance: [[0.0; N]; N],
    };
    for _ in 0..BATCHES {
        let batch: Moments<N> = moments(network, input, PASSES, way, &mut rng, &mut scratch);
        for i in 0..N {
            sum.mean[i] += batch.mean[i] / BATCHES as f32;
            for j in 0..N {
                sum.covariance[i][j] += batch.covariance[i][j] / BATCHES as f32;
            }
        }
    }
    sum
}

fn assert_torchs<const N: usize>(
    name: &Value,
    network: &Network<'_>,
    input: &[f32],
    torch: &Value,
) {
    let mean = numbers(&torch["mean"]);
    let mean_errors = numbers(&torch["mean_standard_error"]);
    let both = 2.0_f64.sqrt() * MONTE_CARLO_STANDARD_ERRORS;
    let row = |key: &str, i: usize| numbers(&torch[key][i]);
    let sigma = |i: usize| row("covariance", i)[i].sqrt();
    let mut outputs = [0.0; N];
    let mut scratch = Scratch::new();
    let repeats = Repeats::of(network);
    let covariance =
        network::moments::outputs(network, &repeats, input, &mut outputs, 0, &mut scratch);
    let without_passes = Moments {
        mean: outputs,
        covariance,
    };
    // Moments err by what they leave out, passes by chance; frozen ones by a little of both.
    let ways = [
        (sampled::<N>(network, input, Spread::Exact), both, 1.0),
        (sampled::<N>(network, input, Spread::Frozen), both, 2.0),
        (without_passes, both, IMPORTED_MOMENTS),
    ];
    for (way, (got, both, more)) in ways.into_iter().enumerate() {
        for i in 0..N {
            let shift = (f64::from(got.mean[i]) - mean[i]).abs();
            let allowed = both * mean_errors[i] + more * IMPORTED_MEAN_SIGMAS * sigma(i);
            assert!(
                shift < allowed,
                "{name}, way {way}, mean {i}: {shift} > {allowed}"
            );
            for j in 0..N {
                let error = (f64::from(got.covariance[i][j]) - row("covariance", i)[j]).abs();
                let by_chance = both * row("covariance_standard_error", i)[j];
                let allowed = by_chance + more * IMPORTED_COVARIANCE * sigma(i) * sigma(j);
                assert!(
                    error < allowed,
                    "{name}, way {way}, covariance {i} {j}: {error} > {allowed}"
                );
            }
        }
    }
}

#[test]
fn passes_frozen_passes_and_moments_are_torchs() {
    for golden in golden() {
        let (_, bytes) = imported(&golden);
        let blob = Blob::parse(&bytes).expect("valid");
        for (input, case) in cases(&golden) {
            let input: Vec<f32> = input.iter().map(|&x| x as f32).collect();
            let torch = case["passes"].as_array().expect("list");
            for (view, torch) in blob.networks().zip(torch) {
                let network = Network::new(view);
                let assert = match blob.outputs() {
                    3 => assert_torchs::<3>,
                    _ => assert_torchs::<1>,
                };
                assert(&golden["name"], &network, &input, torch);
            }
        }
    }
}
