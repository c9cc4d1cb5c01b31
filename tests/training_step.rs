//! The training step against PyTorch: forward passes, loss, gradient, divergence, Adam.

mod tolerance;

use bnkf_model_export::kernel::{AdamStep, Tier};
use bnkf_model_export::memoryless::gradient::{Batch, Gradient};
use bnkf_model_export::memoryless::member::Member;
use bnkf_model_export::memoryless::rows::Rows;
use bnkf_model_export::posterior::architecture::Architecture;
use bnkf_model_export::posterior::gaussian_weights::GaussianWeights;
use bnkf_model_export::posterior::network_f64::NetworkF64;
use serde_json::Value;
use tolerance::{ADAM_STEPS, TRAINING_F32, TRAINING_F64, TRAINING_SLOPE};

fn golden() -> Value {
    serde_json::from_str(include_str!("golden/torch_training.json")).expect("valid JSON")
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().expect("number")],
    }
}

fn floats(value: &Value) -> Vec<f32> {
    numbers(value).into_iter().map(|x| x as f32).collect()
}

fn weights(golden: &Value) -> GaussianWeights {
    let widths = numbers(&golden["widths"]).into_iter().map(|w| w as usize);
    GaussianWeights {
        architecture: Architecture::new(widths.collect()).expect("small"),
        means: floats(&golden["means"]),
        log_sigmas: floats(&golden["log_sigmas"]),
    }
}

fn rows(golden: &Value) -> Rows {
    Rows {
        inputs: 13,
        outputs: 3,
        features: floats(&golden["inputs"]),
        targets: floats(&golden["targets"]),
        weights: floats(&golden["weights"]),
    }
}

/// Largest difference over the largest expected value.
fn relative(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let pairs = found.iter().zip(expected);
    pairs.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / largest
}

fn doubles(values: &[f32]) -> Vec<f64> {
    values.iter().map(|&x| f64::from(x)).collect()
}

/// Outputs of the naive network with torch's noise, and the mean loss.
fn sampled(network: &NetworkF64, golden: &Value) -> (Vec<f64>, f64) {
    let (rows, targets) = (rows(golden), numbers(&golden["targets"]));
    let (mut outputs, mut loss) = (Vec::new(), 0.0);
    for row in 0..rows.len() {
        let noise: Vec<f64> = golden["noise"]
            .as_array()
            .expect("layers")
            .iter()
            .flat_map(|layer| numbers(&layer[row]))
            .collect();
        let mut noise = noise.into_iter();
        let features = doubles(rows.features_of(row));
        let y = network.sampled_pass(&features, || noise.next().expect("enough"));
        let squares: f64 = y
            .iter()
            .zip(&targets[row * 3..])
            .map(|(y, t)| (y - t).powi(2))
            .sum();
        loss += f64::from(rows.weights[row]) * squares / rows.len() as f64;
        outputs.extend(y);
    }
    (outputs, loss)
}

#[test]
fn forward_passes_and_losses_are_torchs() {
    let golden = golden();
    let (weights, rows) = (weights(&golden), rows(&golden));
    let network = NetworkF64::from(&weights);
    let (outputs, loss) = sampled(&network, &golden);
    assert!(relative(&outputs, &numbers(&golden["sampled_outputs"])) < TRAINING_F64);
    assert!(relative(&[loss], &numbers(&golden["sampled_loss"])) < TRAINING_F64);
    let mean_outputs = numbers(&golden["mean_outputs"]);
    let naive: Vec<f64> = (0..rows.len())
        .flat_map(|row| network.mean_pass(&doubles(rows.features_of(row))))
        .collect();
    assert!(relative(&naive, &mean_outputs) < TRAINING_F64);
    let divergence = weights.divergence(golden["prior_sigma"].as_f64().expect("number"));
    assert!(relative(&[divergence], &numbers(&golden["divergence"])) < TRAINING_F64);

    let order: Vec<u32> = (0..rows.len() as u32).collect();
    let batch = Batch {
        rows: &rows,
        order: &order,
        first_target: 0,
        noise_seed: None,
    };
    let mut gradient = Gradient::new(Tier::detect(), &weights);
    let fast = doubles(&gradient.outputs(batch));
    assert!(relative(&fast, &mean_outputs) < TRAINING_F32);
    let loss = gradient.loss_and_gradient(batch) / rows.len() as f64;
    assert!(relative(&[loss], &numbers(&golden["mean_loss"])) < TRAINING_F32);
    let by_mean = doubles(&gradient.by_mean);
    assert!(relative(&by_mean, &numbers(&golden["mean_by_mean"])) < TRAINING_F32);
    assert!(gradient.by_variance.iter().all(|&g| g == 0.0));
}

/// The unit tests hold the fast kernels to central differences of the naive network; here these
/// differences are held to torch's automatic differentiation, with noise.
#[test]
fn slopes_of_the_naive_network_are_torchs_gradient() {
    let golden = golden();
    let weights = weights(&golden);
    let naive = NetworkF64::from(&weights);
    let loss = |change: &dyn Fn(&mut NetworkF64)| {
        let mut changed = naive.clone();
        change(&mut changed);
        sampled(&changed, &golden).1
    };
    let slope = |change: &dyn Fn(&mut NetworkF64, f64), step: f64| {
        (loss(&|n| change(n, step)) - loss(&|n| change(n, -step))) / (2.0 * step)
    };
    let (mut by_mean, mut by_variance) = (Vec::new(), Vec::new());
    for (index, shape) in weights.architecture.layers().into_iter().enumerate() {
        for output in 0..shape.outputs {
            for input in 0..shape.inputs {
                by_mean.push(slope(
                    &|n, h| n.layers[index].means[output][input] += h,
                    1e-5,
                ));
                by_variance.push(slope(
                    &|n, h| n.layers[index].variances[output][input] += h,
                    1e-6,
                ));
            }
        }
        for output in 0..shape.outputs {
            by_mean.push(slope(&|n, h| n.layers[index].bias_means[output] += h, 1e-5));
            by_variance.push(slope(
                &|n, h| n.layers[index].bias_variances[output] += h,
                1e-6,
            ));
        }
    }
    assert!(relative(&by_mean, &numbers(&golden["sampled_by_mean"])) < TRAINING_SLOPE);
    assert!(relative(&by_variance, &numbers(&golden["sampled_by_variance"])) < TRAINING_SLOPE);
}

#[test]
fn ten_steps_of_adam_end_where_torchs_do() {
    let golden = golden();
    let rows = rows(&golden);
    let order: Vec<u32> = (0..rows.len() as u32).collect();
    let batch = Batch {
        rows: &rows,
        order: &order,
        first_target: 0,
        noise_seed: None,
    };
    let number = |name: &str| golden[name].as_f64().expect("number");
    let mut member = Member::new(0, weights(&golden));
    let mut gradient = Gradient::new(Tier::detect(), &member.weights);
    for step in 1..=number("adam_steps") as i32 {
        gradient.load(Tier::detect(), &member.weights);
        assert!(gradient.loss_and_gradient(batch).is_finite());
        let step = AdamStep {
            rate: number("adam_rate") as f32,
            beta1: 0.9,
            beta2: 0.999,
            epsilon: 1e-8,
            correction1: (1.0 / (1.0 - 0.9_f64.powi(step))) as f32,
            correction2: (1.0 / (1.0 - 0.999_f64.powi(step))) as f32,
            kl_weight: number("kl_weight") as f32,
            prior_precision: number("prior_sigma").powi(-2) as f32,
        };
        member.step(Tier::detect(), step, &gradient);
    }
    let far = |found: &[f32], name: &str| {
        let pairs = found.iter().zip(numbers(&golden[name]));
        pairs.fold(0.0_f64, |m, (a, b)| m.max((f64::from(*a) - b).abs()))
    };
    let moved = far(&member.weights.means, "means");
    assert!(moved > 0.05, "{moved}");
    assert!(far(&member.weights.means, "adam_means") < ADAM_STEPS);
    assert!(far(&member.weights.log_sigmas, "adam_log_sigmas") < ADAM_STEPS);
}
