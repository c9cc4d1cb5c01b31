//! What rounding costs: the firmware's estimates from the blob beside those of the unrounded
//! weights.
//!
//! The estimate at the mean weights has no noise on either side: the firmware's integer kernels
//! against the naive network in f64. Predictive standard deviations come from many Monte Carlo
//! passes on both sides, with noise of their own.

use crate::flights::flight::Flight;
use crate::kernel::Tier;
use crate::memoryless::example::{Condition, ExampleSettings, examples};
use crate::memoryless::gradient::{Batch, Gradient};
use crate::memoryless::normalisation::Normalisations;
use crate::memoryless::rows::Rows;
use crate::posterior::gaussian_weights::GaussianWeights;
use crate::posterior::network_f64::NetworkF64;
use crate::radar::noise::NoiseLevel;
use crate::random_source::RandomSource;
use crate::seed;
use bnkf::Spread;
use bnkf::blob::{Activation, Blob, NetworkView};
use bnkf::network::monte_carlo::{self, Sampling};
use bnkf::network::repeats::Repeats;
use bnkf::network::{Network, Scratch, moments};
use bnkf::rng::seeded;
use rayon::prelude::*;
use serde::Serialize;

/// Largest accepted mean shift of the estimate, in predictive standard deviations.
pub const SHIFT_MAX: f64 = 0.05;
/// Largest accepted relative error of the predictive standard deviation.
pub const SIGMA_ERROR_MAX: f64 = 0.10;

const SAMPLING: Sampling = Sampling::Activations(Spread::Exact);

/// One output of one network for one input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Distance between the estimates at the mean weights, in predictive standard deviations.
    pub shift: f64,
    /// Predictive standard deviation from the blob over that of the unrounded weights.
    pub sigma_ratio: f64,
}

/// Many comparisons in a few numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Number of comparisons.
    pub count: usize,
    /// Mean of the shifts.
    pub shift_mean: f64,
    /// 95th percentile of the shifts.
    pub shift_p95: f64,
    /// Mean of the ratios.
    pub sigma_ratio_mean: f64,
    /// 5th percentile of the ratios.
    pub sigma_ratio_p5: f64,
    /// 95th percentile of the ratios.
    pub sigma_ratio_p95: f64,
}

impl Summary {
    /// Summarises `comparisons`; `None` if there are none.
    #[must_use]
    pub fn of(comparisons: &[Comparison]) -> Option<Self> {
        let sorted = |value: &dyn Fn(&Comparison) -> f64| {
            let mut values: Vec<f64> = comparisons.iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let (shifts, ratios) = (sorted(&|c| c.shift), sorted(&|c| c.sigma_ratio));
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let quantile =
            |values: &[f64], part: f64| values[(part * (values.len() - 1) as f64).round() as usize];
        (!comparisons.is_empty()).then(|| Self {
            count: comparisons.len(),
            shift_mean: mean(&shifts),
            shift_p95: quantile(&shifts, 0.95),
            sigma_ratio_mean: mean(&ratios),
            sigma_ratio_p5: quantile(&ratios, 0.05),
            sigma_ratio_p95: quantile(&ratios, 0.95),
        })
    }

    /// Whether the rounding stays within [`SHIFT_MAX`] and [`SIGMA_ERROR_MAX`].
    #[must_use]
    pub fn accepted(&self) -> bool {
        self.shift_mean <= SHIFT_MAX && (self.sigma_ratio_mean - 1.0).abs() <= SIGMA_ERROR_MAX
    }
}

/// Compares a network of a blob with its unrounded `weights` on every row of `rows` (normalised),
/// with `passes` Monte Carlo passes on each side, or the blob's moments `without_passes`. Row by row,
/// output by output.
#[must_use]
pub fn compare(
    view: NetworkView<'_>,
    weights: &GaussianWeights,
    rows: &Rows,
    passes: u16,
    without_passes: bool,
) -> Vec<Comparison> {
    let outputs = weights.architecture.outputs();
    let naive = NetworkF64 {
        activation: view.activation(),
        ..NetworkF64::from(weights)
    };
    let network = Network::new(view);
    let repeats = Repeats::of(&network);
    let sigmas = match view.activation() {
        Activation::Gelu => unrounded_sigmas(weights, rows, passes),
        // The fast kernels are the trainer's, which has no other.
        _ => naive_sigmas(&naive, rows, passes),
    };
    let mut comparisons = Vec::with_capacity(rows.len() * outputs);
    let mut scratch = Scratch::new();
    let mut rng = seeded(1);
    for row in 0..rows.len() {
        let inputs = rows.features_of(row);
        let exact: Vec<f64> = inputs.iter().map(|&x| f64::from(x)).collect();
        let exact = naive.mean_pass(&exact);
        let mut rounded = [0.0_f32; 3];
        network.mean_pass(inputs, &mut rounded[..outputs]);
        let mut means = [0.0_f32; 3];
        let variance = match (outputs, without_passes) {
            (3, true) => diagonal(moments::outputs::<3>(
                &network,
                &repeats,
                inputs,
                &mut means,
                0,
                &mut scratch,
            )),
            (_, true) => diagonal(moments::outputs::<1>(
                &network,
                &repeats,
                inputs,
                &mut means[..outputs],
                0,
                &mut scratch,
            )),
            (3, false) => {
                let m = monte_carlo::moments::<3>(
                    &network,
                    inputs,
                    passes,
                    SAMPLING,
                    &mut rng,
                    &mut scratch,
                );
                diagonal(m.covariance)
            }
            (_, false) => {
                let m = monte_carlo::moments::<1>(
                    &network,
                    inputs,
                    passes,
                    SAMPLING,
                    &mut rng,
                    &mut scratch,
                );
                diagonal(m.covariance)
            }
        };
        for output in 0..outputs {
            let sigma = sigmas[row * outputs + output];
            comparisons.push(Comparison {
                shift: (f64::from(rounded[output]) - exact[output]).abs() / sigma,
                sigma_ratio: f64::from(variance[output]).sqrt() / sigma,
            });
        }
    }
    comparisons
}

/// About `count` measurements of `flights`, evenly spread over flights and sampling rates,
/// normalised as the tracker does.
#[must_use]
pub fn measured_rows(
    blob: &Blob<'_>,
    flights: &[Flight],
    level: NoiseLevel,
    settings: &ExampleSettings,
    count: usize,
    seed: u64,
) -> Rows {
    let conditions = Condition::all()
        .into_iter()
        .filter(|condition| condition.level == level);
    let found: Vec<_> = conditions
        .flat_map(|condition| {
            flights
                .iter()
                .flat_map(move |flight| examples(flight, condition, settings, seed))
        })
        .collect();
    let normalisation = Normalisations::of_blob(blob);
    let mut rows = Rows::new(blob.features().len(), 3);
    for example in found.iter().step_by((found.len() / count).max(1)) {
        normalisation.push_features(&example.features, &mut rows.features);
        rows.targets.extend([0.0; 3]);
        rows.weights.push(0.0);
    }
    rows
}

/// Variances of up to three outputs.
fn diagonal<const N: usize>(covariance: [[f32; N]; N]) -> [f32; 3] {
    let mut variances = [0.0; 3];
    for (i, variance) in variances.iter_mut().enumerate().take(N) {
        *variance = covariance[i][i];
    }
    variances
}

/// Predictive standard deviations of the unrounded weights by the naive network, row-major, in normalised
/// units.
fn naive_sigmas(network: &NetworkF64, rows: &Rows, passes: u16) -> Vec<f64> {
    let of_row = |row: usize| {
        let inputs = rows.features_of(row).iter().map(|&x| f64::from(x));
        let inputs: Vec<f64> = inputs.collect();
        let seed = seed::derive(1, &[seed::name_id("verify"), row as u64]);
        let mut random = RandomSource::new(seed, &[]);
        let mut sums = Vec::new();
        for _ in 0..passes {
            let outputs = network.sampled_pass(&inputs, || random.normal());
            sums.resize(outputs.len(), (0.0, 0.0));
            for ((sum, squares), y) in sums.iter_mut().zip(outputs) {
                *sum += y;
                *squares += y * y;
            }
        }
        sums
    };
    let sums: Vec<_> = (0..rows.len()).into_par_iter().map(of_row).collect();
    deviations(sums.into_iter().flatten(), passes)
}

/// Predictive standard deviations of the unrounded weights, row-major, in normalised units.
fn unrounded_sigmas(weights: &GaussianWeights, rows: &Rows, passes: u16) -> Vec<f64> {
    let order: Vec<u32> = (0..rows.len() as u32).collect();
    let mut gradient = Gradient::new(Tier::detect(), weights);
    let mut sums = vec![(0.0, 0.0); rows.len() * weights.architecture.outputs()];
    for pass in 0..u64::from(passes) {
        let noise_seed = Some(seed::derive(1, &[seed::name_id("verify"), pass]));
        let batch = Batch {
            rows,
            order: &order,
            first_target: 0,
            noise_seed,
        };
        for ((sum, squares), y) in sums.iter_mut().zip(gradient.outputs(batch)) {
            *sum += f64::from(y);
            *squares += f64::from(y) * f64::from(y);
        }
    }
    deviations(sums.into_iter(), passes)
}

/// Standard deviations from sums of samples and of their squares.
fn deviations(sums: impl Iterator<Item = (f64, f64)>, passes: u16) -> Vec<f64> {
    let count = f64::from(passes);
    let deviation = |(sum, squares): (f64, f64)| {
        let variance = (squares - sum * sum / count) / (count - 1.0);
        variance.max(0.0).sqrt()
    };
    sums.map(deviation).collect()
}
