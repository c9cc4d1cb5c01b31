//! One step of a block of rows through the sampled network, and the way back.
//!
//! Pre-activations are sampled (local reparameterisation, Kingma, Salimans and Welling 2015), anew
//! for every row and step.

use super::gradient::Gradient;
use super::shape::{HIDDEN, LAYERS, OFFSETS, OUTPUT_COLUMNS, SHAPES};
use super::weights::Weights;
use crate::kernel::{
    Aligned, Hidden, Tier, fill_normal, hidden_backward, hidden_forward, rows_times, sample_output,
    transposed_times,
};
use crate::seed::derive;

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
            if weights.sampling.covers(layer, LAYERS) {
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
    use crate::recursive::network::Network;
    use crate::recursive::network::sampling::Sampling;
    use crate::recursive::network::shape::PARAMETERS;
    use bnkf::recursive::features::FEATURES;
    use bnkf::recursive::schedule::OUTPUTS;

    /// Sum of the outputs times fixed numbers, for the same noise at every call.
    fn loss(network: &Network, features: &[f32], sampling: Sampling) -> f64 {
        let tier = Tier::detect();
        let mut pass = Pass::new(8);
        pass.features_mut().copy_from_slice(features);
        pass.forward(tier, &network.weights(tier, sampling), 3);
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
        for sampling in [Sampling::Nothing, Sampling::LastLayer, Sampling::EveryLayer] {
            let network = network();
            let weights = network.weights(tier, sampling);
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
                let high = loss(&network, &moved, sampling);
                moved[i] = features[i] - 1e-3;
                check(
                    "feature",
                    by_feature[i],
                    high,
                    loss(&network, &moved, sampling),
                    1e-3,
                );
            }
            for i in (0..PARAMETERS).step_by(397) {
                let mut moved = network.clone();
                moved.means[i] += 1e-3;
                let high = loss(&moved, &features, sampling);
                moved.means[i] -= 2e-3;
                let low = loss(&moved, &features, sampling);
                check("mean", gradient.by_mean[i], high, low, 1e-3);
                let last = i >= OFFSETS[LAYERS - 1];
                if sampling == Sampling::EveryLayer || (last && sampling == Sampling::LastLayer) {
                    moved.means[i] = network.means[i];
                    moved.log_sigmas[i] += 1e-2;
                    let high = loss(&moved, &features, sampling);
                    moved.log_sigmas[i] -= 2e-2;
                    let low = loss(&moved, &features, sampling);
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
}
