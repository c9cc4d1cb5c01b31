//! The variational network that schedules the motion model, over a block of flights at a time.
//!
//! Mean-field Gaussian weights; pre-activations are sampled (local reparameterisation, Kingma,
//! Salimans and Welling 2015), anew for every flight and step. Hidden layers end in GELU.

use super::features::FEATURES;
use super::schedule::OUTPUTS;
use crate::architecture::{Architecture, LayerShape};
use crate::gaussian_weights::GaussianWeights;
use crate::kernel::{
    AdamStep, Aligned, Hidden, Moments, Posterior, Tier, adam, exp_in_place, fill_normal,
    hidden_backward, hidden_forward, rows_times, sample_output, transposed_times,
};
use crate::random_source::RandomSource;
use crate::seed::derive;

/// Neurons of a hidden layer.
pub const HIDDEN: usize = 64;
/// Layers, the output layer included.
pub const LAYERS: usize = 5;
/// Columns of the output layer: [`OUTPUTS`] padded to what the kernels take.
pub const OUTPUT_COLUMNS: usize = OUTPUTS.next_multiple_of(16);

/// Inputs and columns of every layer.
pub const SHAPES: [(usize, usize); LAYERS] = [
    (FEATURES, HIDDEN),
    (HIDDEN, HIDDEN),
    (HIDDEN, HIDDEN),
    (HIDDEN, HIDDEN),
    (HIDDEN, OUTPUT_COLUMNS),
];

/// Where each layer's numbers start: `inputs` rows of weights, then one row of biases.
const fn offsets() -> [usize; LAYERS + 1] {
    let mut starts = [0; LAYERS + 1];
    let mut i = 0;
    while i < LAYERS {
        starts[i + 1] = starts[i] + (SHAPES[i].0 + 1) * SHAPES[i].1;
        i += 1;
    }
    starts
}
const OFFSETS: [usize; LAYERS + 1] = offsets();
/// Weights and biases, padding included.
pub const PARAMETERS: usize = OFFSETS[LAYERS];

/// Standard deviation of the prior of every weight, zero mean.
pub const PRIOR_SIGMA: f32 = 0.3;
/// Standard deviation that every weight starts with.
const INITIAL_SIGMA: f32 = 0.01;

/// Means, deviations and Adam's moments.
#[derive(Clone, Debug)]
pub struct Network {
    /// Posterior means, layer by layer, rows by input.
    pub means: Aligned,
    /// Natural logarithms of the posterior standard deviations.
    pub log_sigmas: Aligned,
    moments: [Aligned; 4],
    updates: i32,
}

/// Gradient of the data loss by means and by variances.
#[derive(Clone, Debug)]
pub struct Gradient {
    by_mean: Aligned,
    by_variance: Aligned,
}

/// What one pass reads: means and variances, and their transposes for the way back.
#[derive(Clone, Debug)]
pub struct Weights {
    means: Aligned,
    variances: Aligned,
    means_transposed: Aligned,
    variances_transposed: Aligned,
    sampled: bool,
}

/// Activations of one step of a block of rows, kept for the way back.
#[derive(Clone, Debug)]
pub struct Pass {
    rows: usize,
    /// Inputs of every layer and their squares.
    inputs: Vec<Aligned>,
    squares: Vec<Aligned>,
    slopes: Vec<Aligned>,
    gains: Vec<Aligned>,
    output: Aligned,
    output_gain: Aligned,
    /// Moments of pre-activations, noise.
    mean: Aligned,
    variance: Aligned,
    noise: Aligned,
}

impl Network {
    /// Random means (He initialisation; the last layer near zero, so that training starts from the
    /// base model) and small deviations.
    pub fn new(seed: u64) -> Self {
        let mut source = RandomSource::new(seed, &[crate::seed::name_id("recursive network")]);
        let mut means = Aligned::zeros(PARAMETERS);
        for (layer, (inputs, columns)) in SHAPES.into_iter().enumerate() {
            let gain = if layer + 1 == LAYERS { 0.02 } else { 1.4 };
            let used = if layer + 1 == LAYERS {
                OUTPUTS
            } else {
                columns
            };
            for row in 0..inputs {
                for column in 0..used {
                    means[OFFSETS[layer] + row * columns + column] =
                        (source.normal() * gain / (inputs as f64).sqrt()) as f32;
                }
            }
        }
        let mut log_sigmas = Aligned::zeros(PARAMETERS);
        log_sigmas.fill(INITIAL_SIGMA.ln());
        Self {
            means,
            log_sigmas,
            moments: core::array::from_fn(|_| Aligned::zeros(PARAMETERS)),
            updates: 0,
        }
    }

    /// What passes read; `sampled` false takes every variance as zero.
    pub fn weights(&self, tier: Tier, sampled: bool) -> Weights {
        let mut variances = Aligned::zeros(PARAMETERS);
        if sampled {
            variances.copy_from_slice(&self.log_sigmas);
            exp_in_place(tier, 2.0, &mut variances);
        }
        Weights {
            means_transposed: transposed(&self.means),
            variances_transposed: transposed(&variances),
            means: self.means.clone(),
            variances,
            sampled,
        }
    }

    /// One Adam step on the mean gradient of a batch, clipped to `clip` in Euclidean norm, plus
    /// `kl_weight` times the divergence from the prior. Returns the norm before clipping; a
    /// gradient that is not finite changes nothing.
    pub fn update(
        &mut self,
        tier: Tier,
        rate: f32,
        kl_weight: f32,
        clip: f32,
        gradient: &mut Gradient,
    ) -> f32 {
        let norm = gradient.norm(&self.log_sigmas);
        if !norm.is_finite() {
            return norm;
        }
        if norm > clip {
            gradient.scale(clip / norm);
        }
        self.updates += 1;
        let (beta1, beta2) = (0.9_f32, 0.999_f32);
        let step = AdamStep {
            rate,
            beta1,
            beta2,
            epsilon: 1e-8,
            correction1: 1.0 / (1.0 - beta1.powi(self.updates)),
            correction2: 1.0 / (1.0 - beta2.powi(self.updates)),
            kl_weight,
            prior_precision: 1.0 / (PRIOR_SIGMA * PRIOR_SIGMA),
        };
        let [mean_first, mean_second, log_sigma_first, log_sigma_second] = &mut self.moments;
        adam(
            tier,
            step,
            &gradient.by_mean,
            &gradient.by_variance,
            Posterior {
                means: &mut self.means,
                log_sigmas: &mut self.log_sigmas,
            },
            Moments {
                mean_first,
                mean_second,
                log_sigma_first,
                log_sigma_second,
            },
        );
        norm
    }

    /// Divergence of the posterior from the prior, nats.
    pub fn divergence(&self) -> f64 {
        let prior = f64::from(PRIOR_SIGMA);
        self.means
            .iter()
            .zip(self.log_sigmas.iter())
            .map(|(&mean, &log_sigma)| {
                let (mean, log_sigma) = (f64::from(mean), f64::from(log_sigma));
                let variance = (2.0 * log_sigma).exp();
                prior.ln() - log_sigma + (variance + mean * mean) / (2.0 * prior * prior) - 0.5
            })
            .sum()
    }

    /// The posterior in the order that blobs are written from, without padding.
    ///
    /// # Panics
    /// Never: the widths are constants that a blob can hold.
    pub fn gaussian_weights(&self) -> GaussianWeights {
        let mut widths: Vec<usize> = SHAPES.iter().map(|shape| shape.0).collect();
        widths.push(OUTPUTS);
        let architecture = Architecture::new(widths).expect("a blob can hold the widths");
        let mut ordered = GaussianWeights {
            means: vec![0.0; architecture.parameters()],
            log_sigmas: vec![0.0; architecture.parameters()],
            architecture,
        };
        for (to, from) in places(&ordered.architecture.layers()) {
            ordered.means[to] = self.means[from];
            ordered.log_sigmas[to] = self.log_sigmas[from];
        }
        ordered
    }

    /// The inverse of [`Self::gaussian_weights`], with a fresh optimiser; `None` for another shape.
    pub fn of_gaussian_weights(weights: &GaussianWeights) -> Option<Self> {
        let mut network = Self::new(0);
        if network.gaussian_weights().architecture != weights.architecture {
            return None;
        }
        for (from, to) in places(&weights.architecture.layers()) {
            network.means[to] = weights.means[from];
            network.log_sigmas[to] = weights.log_sigmas[from];
        }
        Some(network)
    }

    /// Every number that training needs to go on, in a fixed order.
    pub fn to_state(&self) -> (Vec<f32>, i32) {
        let mut state = Vec::with_capacity(6 * PARAMETERS);
        for part in [&self.means, &self.log_sigmas]
            .into_iter()
            .chain(&self.moments)
        {
            state.extend_from_slice(part);
        }
        (state, self.updates)
    }

    /// The inverse of [`Self::to_state`]; `None` when the length is another network's.
    pub fn from_state(state: &[f32], updates: i32) -> Option<Self> {
        if state.len() != 6 * PARAMETERS {
            return None;
        }
        let mut parts = state.chunks_exact(PARAMETERS).map(|part| {
            let mut buffer = Aligned::zeros(PARAMETERS);
            buffer.copy_from_slice(part);
            buffer
        });
        Some(Self {
            means: parts.next()?,
            log_sigmas: parts.next()?,
            moments: [parts.next()?, parts.next()?, parts.next()?, parts.next()?],
            updates,
        })
    }
}

/// Where each number of the unpadded order lies in the padded one: (unpadded, padded).
fn places(layers: &[LayerShape]) -> Vec<(usize, usize)> {
    let mut places = Vec::new();
    for ((shape, (inputs, columns)), start) in layers.iter().zip(SHAPES).zip(OFFSETS) {
        for output in 0..shape.outputs {
            let weights = (0..inputs).map(|input| (shape.row(output) + input, input));
            for (ordered, row) in weights.chain([(shape.bias(output), inputs)]) {
                places.push((ordered, start + row * columns + output));
            }
        }
    }
    places
}

/// Every layer's weights with rows and columns exchanged; biases are left out.
fn transposed(parameters: &[f32]) -> Aligned {
    let mut out = Aligned::zeros(PARAMETERS);
    for (layer, (inputs, columns)) in SHAPES.into_iter().enumerate() {
        let start = OFFSETS[layer];
        for row in 0..inputs {
            for column in 0..columns {
                out[start + column * inputs + row] = parameters[start + row * columns + column];
            }
        }
    }
    out
}

impl Gradient {
    /// Zero.
    pub fn zeros() -> Self {
        Self {
            by_mean: Aligned::zeros(PARAMETERS),
            by_variance: Aligned::zeros(PARAMETERS),
        }
    }

    /// Gradient by every mean.
    pub fn by_mean(&self) -> &[f32] {
        &self.by_mean
    }

    /// Adds another batch's.
    pub fn add(&mut self, other: &Self) {
        for (sum, term) in self.by_mean.iter_mut().zip(other.by_mean.iter()) {
            *sum += term;
        }
        for (sum, term) in self.by_variance.iter_mut().zip(other.by_variance.iter()) {
            *sum += term;
        }
    }

    fn scale(&mut self, factor: f32) {
        for value in self.by_mean.iter_mut().chain(self.by_variance.iter_mut()) {
            *value *= factor;
        }
    }

    /// Euclidean norm by means and logarithms of sigmas.
    fn norm(&self, log_sigmas: &[f32]) -> f32 {
        let mut sum = 0.0_f64;
        for i in 0..PARAMETERS {
            let by_log_sigma = 2.0 * (2.0 * log_sigmas[i]).exp() * self.by_variance[i];
            sum += f64::from(self.by_mean[i]).powi(2) + f64::from(by_log_sigma).powi(2);
        }
        sum.sqrt() as f32
    }
}

impl Pass {
    /// Room for `rows` rows, a multiple of eight.
    pub fn new(rows: usize) -> Self {
        let layers = |width: fn((usize, usize)) -> usize, count: usize| {
            SHAPES[..count]
                .iter()
                .map(|&shape| Aligned::zeros(rows * width(shape)))
                .collect()
        };
        Self {
            rows,
            inputs: layers(|shape| shape.0, LAYERS),
            squares: layers(|shape| shape.0, LAYERS),
            slopes: layers(|shape| shape.1, LAYERS - 1),
            gains: layers(|shape| shape.1, LAYERS - 1),
            output: Aligned::zeros(rows * OUTPUT_COLUMNS),
            output_gain: Aligned::zeros(rows * OUTPUT_COLUMNS),
            mean: Aligned::zeros(rows * HIDDEN),
            variance: Aligned::zeros(rows * HIDDEN),
            noise: Aligned::zeros(rows * HIDDEN),
        }
    }

    /// Features, `FEATURES` a row; to be filled before [`Self::forward`].
    pub fn features_mut(&mut self) -> &mut [f32] {
        &mut self.inputs[0]
    }

    /// Outputs, [`OUTPUT_COLUMNS`] a row.
    pub fn outputs(&self) -> &[f32] {
        &self.output
    }

    /// Computes the outputs of the features; `seed` gives the noise of sampled weights.
    pub fn forward(&mut self, tier: Tier, weights: &Weights, seed: u64) {
        for input in 0..self.inputs[0].len() {
            self.squares[0][input] = self.inputs[0][input] * self.inputs[0][input];
        }
        for (layer, (inputs, columns)) in SHAPES.into_iter().enumerate() {
            let start = OFFSETS[layer];
            let bias = start + inputs * columns;
            let end = bias + columns;
            let len = self.rows * columns;
            let (mean, variance) = if layer + 1 == LAYERS {
                (&mut self.output, &mut self.output_gain)
            } else {
                (&mut self.mean, &mut self.variance)
            };
            let (m, v) = (&weights.means, &weights.variances);
            rows_times(
                tier,
                inputs,
                columns,
                inputs,
                &self.inputs[layer],
                &m[start..bias],
                &m[bias..end],
                &mut mean[..len],
            );
            if weights.sampled {
                rows_times(
                    tier,
                    inputs,
                    columns,
                    inputs,
                    &self.squares[layer],
                    &v[start..bias],
                    &v[bias..end],
                    &mut variance[..len],
                );
                fill_normal(tier, derive(seed, &[layer as u64]), &mut self.noise[..len]);
            } else {
                variance[..len].fill(0.0);
                self.noise[..len].fill(0.0);
            }
            if layer + 1 == LAYERS {
                sample_output(tier, mean, variance, &self.noise[..len]);
            } else {
                let (_, inputs_after) = self.inputs.split_at_mut(layer + 1);
                let (_, squares_after) = self.squares.split_at_mut(layer + 1);
                hidden_forward(
                    tier,
                    mean,
                    variance,
                    &self.noise,
                    Hidden {
                        activation: &mut inputs_after[0],
                        square: &mut squares_after[0],
                        slope: &mut self.slopes[layer],
                        gain: &mut self.gains[layer],
                    },
                );
            }
        }
    }

    /// Adds the weights' gradient to `gradient` and writes that of the features to
    /// `feature_adjoints`, given that of the outputs. Uses up what [`Self::forward`] kept.
    pub fn backward(
        &mut self,
        tier: Tier,
        weights: &Weights,
        output_adjoints: &[f32],
        gradient: &mut Gradient,
        feature_adjoints: &mut [f32],
    ) {
        let len = self.rows * OUTPUT_COLUMNS;
        for i in 0..len {
            self.output_gain[i] *= output_adjoints[i];
        }
        let mut by_mean = Aligned::zeros(self.rows * HIDDEN);
        let mut by_variance = Aligned::zeros(self.rows * HIDDEN);
        by_mean[..len].copy_from_slice(output_adjoints);
        by_variance[..len].copy_from_slice(&self.output_gain);
        let zeros = [0.0; HIDDEN];
        for (layer, (inputs, columns)) in SHAPES.into_iter().enumerate().rev() {
            let start = OFFSETS[layer];
            let bias = start + inputs * columns;
            let used = self.rows * columns;
            for (factors, adjoints, sums) in [
                (&self.inputs[layer], &by_mean, &mut gradient.by_mean),
                (
                    &self.squares[layer],
                    &by_variance,
                    &mut gradient.by_variance,
                ),
            ] {
                let (weight_sums, rest) = sums[start..].split_at_mut(bias - start);
                transposed_times(
                    tier,
                    inputs,
                    columns,
                    inputs,
                    factors,
                    &adjoints[..used],
                    weight_sums,
                );
                for row in adjoints[..used].chunks_exact(columns) {
                    for (sum, term) in rest.iter_mut().zip(row) {
                        *sum += term;
                    }
                }
            }
            for (adjoints, matrix, through) in [
                (&by_mean, &weights.means_transposed, &mut self.mean),
                (
                    &by_variance,
                    &weights.variances_transposed,
                    &mut self.variance,
                ),
            ] {
                rows_times(
                    tier,
                    columns,
                    inputs,
                    columns,
                    &adjoints[..used],
                    &matrix[start..bias],
                    &zeros[..inputs],
                    &mut through[..self.rows * inputs],
                );
            }
            if layer > 0 {
                hidden_backward(
                    tier,
                    &mut self.mean,
                    &mut self.variance,
                    &self.inputs[layer],
                    &self.slopes[layer - 1],
                    &self.gains[layer - 1],
                );
                core::mem::swap(&mut by_mean, &mut self.mean);
                core::mem::swap(&mut by_variance, &mut self.variance);
            } else {
                for (i, adjoint) in feature_adjoints.iter_mut().enumerate() {
                    *adjoint = self.mean[i] + 2.0 * self.inputs[0][i] * self.variance[i];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum of the outputs times fixed numbers, for the same noise at every call.
    fn loss(network: &Network, features: &[f32], sampled: bool) -> f64 {
        let tier = Tier::detect();
        let mut pass = Pass::new(8);
        pass.features_mut().copy_from_slice(features);
        pass.forward(tier, &network.weights(tier, sampled), 3);
        pass.outputs()
            .iter()
            .zip(seeds())
            .map(|(&o, s)| f64::from(o) * f64::from(s))
            .sum()
    }

    fn seeds() -> Vec<f32> {
        (0..8 * OUTPUT_COLUMNS)
            .map(|i| {
                let used = i % OUTPUT_COLUMNS < OUTPUTS;
                if used {
                    ((i * 13) % 17) as f32 * 0.1 - 0.8
                } else {
                    0.0
                }
            })
            .collect()
    }

    fn network() -> Network {
        let mut network = Network::new(5);
        // Larger last layer and deviations than at the start, so that every path carries weight.
        for i in OFFSETS[LAYERS - 1]..PARAMETERS {
            network.means[i] *= 20.0;
        }
        for i in 0..PARAMETERS {
            network.log_sigmas[i] = -3.0 + 0.5 * ((i % 5) as f32 - 2.0);
        }
        network
    }

    #[test]
    fn gradients_equal_central_differences() {
        let tier = Tier::detect();
        let features: Vec<f32> = (0..8 * FEATURES).map(|i| (i as f32 * 0.37).sin()).collect();
        for sampled in [false, true] {
            let network = network();
            let weights = network.weights(tier, sampled);
            let mut pass = Pass::new(8);
            pass.features_mut().copy_from_slice(&features);
            pass.forward(tier, &weights, 3);
            let mut gradient = Gradient::zeros();
            let mut by_feature = vec![0.0; 8 * FEATURES];
            pass.backward(tier, &weights, &seeds(), &mut gradient, &mut by_feature);
            let check = |name: &str, got: f32, high: f64, low: f64, h: f64| {
                let expected = (high - low) / (2.0 * h);
                assert!(
                    (f64::from(got) - expected).abs() < 0.02 * expected.abs() + 0.02,
                    "{name}: {got} {expected}"
                );
            };
            for i in (0..8 * FEATURES).step_by(37) {
                let mut moved = features.clone();
                moved[i] = features[i] + 1e-3;
                let high = loss(&network, &moved, sampled);
                moved[i] = features[i] - 1e-3;
                check(
                    "feature",
                    by_feature[i],
                    high,
                    loss(&network, &moved, sampled),
                    1e-3,
                );
            }
            for i in (0..PARAMETERS).step_by(397) {
                let mut moved = network.clone();
                moved.means[i] += 1e-3;
                let high = loss(&moved, &features, sampled);
                moved.means[i] -= 2e-3;
                let low = loss(&moved, &features, sampled);
                check("mean", gradient.by_mean[i], high, low, 1e-3);
                if sampled {
                    moved.means[i] = network.means[i];
                    moved.log_sigmas[i] += 1e-2;
                    let high = loss(&moved, &features, sampled);
                    moved.log_sigmas[i] -= 2e-2;
                    let low = loss(&moved, &features, sampled);
                    let variance = (2.0 * network.log_sigmas[i]).exp();
                    check(
                        "log sigma",
                        2.0 * variance * gradient.by_variance[i],
                        high,
                        low,
                        1e-2,
                    );
                }
            }
        }
    }

    #[test]
    fn state_round_trips() {
        let network = network();
        let (state, updates) = network.to_state();
        let back = Network::from_state(&state, updates).unwrap();
        assert_eq!(back.to_state().0, state);
        assert!(Network::from_state(&state[1..], updates).is_none());
        assert!(back.divergence() > 0.0);
    }

    #[test]
    fn a_gradient_that_is_not_finite_changes_nothing() {
        let mut network = network();
        let before = network.to_state();
        let mut gradient = Gradient::zeros();
        gradient.by_mean[7] = f32::NAN;
        let norm = network.update(Tier::detect(), 1e-3, 1e-6, 1.0, &mut gradient);
        assert!(norm.is_nan());
        assert_eq!(network.to_state(), before);
    }
}
