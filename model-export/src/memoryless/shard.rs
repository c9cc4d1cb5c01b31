//! A fixed part of a minibatch on its way through the network and back.
//!
//! Local reparameterisation (Kingma, Salimans and Welling 2015): instead of every weight, the
//! pre-activations are sampled, with mean `mu.x + mu_b` and variance `sigma^2.x^2 + sigma_b^2`.

use crate::kernel::{
    Aligned, BLOCK_ROWS, Hidden, Tier, add_columns, fill_normal, hidden_backward, hidden_forward,
    rows_times, sample_output, transposed_times,
};
use crate::memoryless::rows::Rows;
use crate::posterior::padded_weights::{PaddedLayer, PaddedWeights};
use crate::seed;

/// Which rows go through the network, what of them it estimates, and the noise of its weights.
#[derive(Clone, Copy, Debug)]
pub struct Batch<'a> {
    /// All rows.
    pub rows: &'a Rows,
    /// Indices of the rows of this batch.
    pub order: &'a [u32],
    /// First target of a row that the network estimates.
    pub first_target: usize,
    /// Seed of the weight noise; `None` puts every weight at its mean.
    pub noise_seed: Option<u64>,
}

/// Gradient of the data loss with respect to the moments of one layer's weights.
pub(crate) struct LayerGradient {
    /// `[output][input]`, outputs rounded up to four, inputs to whole registers.
    pub by_mean: Aligned,
    pub by_variance: Aligned,
    pub by_bias_mean: Aligned,
    pub by_bias_variance: Aligned,
}

/// What a layer saw: its inputs, their squares, and the derivatives of the layer before it.
struct LayerInputs {
    activation: Aligned,
    square: Aligned,
    slope: Aligned,
    gain: Aligned,
}

/// Moments of pre-activations on the way forth, their gradients on the way back.
struct MomentPair {
    mean: Aligned,
    variance: Aligned,
}

/// Working memory for blocks of [`BLOCK_ROWS`] rows, and the gradient summed over them.
pub(crate) struct Shard {
    tier: Tier,
    pub gradient: Vec<LayerGradient>,
    inputs: Vec<LayerInputs>,
    front: MomentPair,
    back: MomentPair,
    noise: Aligned,
    zeros: Aligned,
}

impl Shard {
    pub fn new(tier: Tier, weights: &PaddedWeights) -> Self {
        let widest = weights
            .layers
            .iter()
            .map(|l| l.columns_in.max(l.columns_out))
            .max();
        let widest = widest.unwrap_or(0);
        let block = |columns: usize| Aligned::zeros(BLOCK_ROWS * columns);
        let pair = || MomentPair {
            mean: block(widest),
            variance: block(widest),
        };
        let gradient = |layer: &PaddedLayer| {
            let weights = layer.shape.outputs.next_multiple_of(4) * layer.columns_in;
            LayerGradient {
                by_mean: Aligned::zeros(weights),
                by_variance: Aligned::zeros(weights),
                by_bias_mean: Aligned::zeros(layer.columns_out),
                by_bias_variance: Aligned::zeros(layer.columns_out),
            }
        };
        let inputs = |layer: &PaddedLayer| LayerInputs {
            activation: block(layer.columns_in),
            square: block(layer.columns_in),
            slope: block(layer.columns_in),
            gain: block(layer.columns_in),
        };
        Self {
            tier,
            gradient: weights.layers.iter().map(gradient).collect(),
            inputs: weights.layers.iter().map(inputs).collect(),
            front: pair(),
            back: pair(),
            noise: block(widest),
            zeros: Aligned::zeros(widest),
        }
    }

    /// Sets the gradient to zero.
    pub fn clear(&mut self) {
        for layer in &mut self.gradient {
            layer.by_mean.fill(0.0);
            layer.by_variance.fill(0.0);
            layer.by_bias_mean.fill(0.0);
            layer.by_bias_variance.fill(0.0);
        }
    }

    /// Runs block `block` of `batch` forth; returns its summed loss.
    pub fn forward(&mut self, weights: &PaddedWeights, batch: &Batch<'_>, block: usize) -> f64 {
        let order = block_order(batch.order, block);
        self.take_rows(batch.rows, order, weights.layers[0].columns_in);
        let last = weights.layers.len() - 1;
        for (index, layer) in weights.layers.iter().enumerate() {
            let used = BLOCK_ROWS * layer.columns_out;
            let (mean, variance) = (
                &mut self.front.mean[..used],
                &mut self.front.variance[..used],
            );
            let noise = &mut self.noise[..used];
            let (depth, columns, stride) =
                (layer.shape.inputs, layer.columns_out, layer.columns_in);
            let inputs = &self.inputs[index];
            let (x, square) = (&inputs.activation, &inputs.square);
            rows_times(
                self.tier,
                depth,
                columns,
                stride,
                x,
                &layer.forward_mean,
                &layer.bias_mean,
                mean,
            );
            rows_times(
                self.tier,
                depth,
                columns,
                stride,
                square,
                &layer.forward_variance,
                &layer.bias_variance,
                variance,
            );
            match batch.noise_seed {
                Some(noise_seed) => {
                    let seed = seed::derive(noise_seed, &[block as u64, index as u64]);
                    fill_normal(self.tier, seed, noise);
                }
                None => noise.fill(0.0),
            }
            if index < last {
                let next = &mut self.inputs[index + 1];
                let hidden = Hidden {
                    activation: &mut next.activation,
                    square: &mut next.square,
                    slope: &mut next.slope,
                    gain: &mut next.gain,
                };
                hidden_forward(self.tier, mean, variance, noise, hidden);
            } else {
                sample_output(self.tier, mean, variance, noise);
            }
        }
        self.loss(&weights.layers[last], batch, order)
    }

    /// Output `output` of row `row` of the block that last went forth.
    pub fn output(&self, weights: &PaddedWeights, row: usize, output: usize) -> f32 {
        let columns = weights.layers[weights.layers.len() - 1].columns_out;
        self.front.mean[row * columns + output]
    }

    /// Adds the gradient of the block that last went forth; `scale` times its loss is the loss.
    pub fn backward(
        &mut self,
        weights: &PaddedWeights,
        batch: &Batch<'_>,
        block: usize,
        scale: f32,
    ) {
        let order = block_order(batch.order, block);
        self.start_backward(
            &weights.layers[weights.layers.len() - 1],
            batch,
            order,
            scale,
        );
        for (index, layer) in weights.layers.iter().enumerate().rev() {
            self.add_layer_gradient(layer, index);
            if index > 0 {
                self.through_layer(layer, index);
                std::mem::swap(&mut self.front, &mut self.back);
            }
        }
    }

    fn take_rows(&mut self, rows: &Rows, order: &[u32], columns: usize) {
        let first = &mut self.inputs[0];
        let blocks = first.activation.chunks_exact_mut(columns);
        for (index, (x, square)) in blocks
            .zip(first.square.chunks_exact_mut(columns))
            .enumerate()
        {
            let Some(&row) = order.get(index) else {
                x.fill(0.0);
                square.fill(0.0);
                continue;
            };
            for (column, &value) in rows.features_of(row as usize).iter().enumerate() {
                x[column] = value;
                square[column] = value * value;
            }
        }
    }

    fn loss(&self, last: &PaddedLayer, batch: &Batch<'_>, order: &[u32]) -> f64 {
        let mut sum = 0.0;
        for (y, &row) in self.front.mean.chunks_exact(last.columns_out).zip(order) {
            let targets = &batch.rows.targets_of(row as usize)[batch.first_target..];
            let errors = y[..last.shape.outputs]
                .iter()
                .zip(targets)
                .map(|(y, t)| y - t);
            let squares: f64 = errors.map(|e| f64::from(e) * f64::from(e)).sum();
            sum += f64::from(batch.rows.weights[row as usize]) * squares;
        }
        sum
    }

    /// Replaces outputs by the gradient of the loss with respect to their moments.
    fn start_backward(&mut self, last: &PaddedLayer, batch: &Batch<'_>, order: &[u32], scale: f32) {
        let columns = last.columns_out;
        let used = BLOCK_ROWS * columns;
        let means = self.front.mean[..used].chunks_exact_mut(columns);
        let variances = self.front.variance[..used].chunks_exact_mut(columns);
        for (index, (mean, gain)) in means.zip(variances).enumerate() {
            let outputs = if index < order.len() {
                last.shape.outputs
            } else {
                0
            };
            mean[outputs..].fill(0.0);
            gain[outputs..].fill(0.0);
            let Some(&row) = order.get(index) else {
                continue;
            };
            let targets = &batch.rows.targets_of(row as usize)[batch.first_target..];
            let factor = 2.0 * scale * batch.rows.weights[row as usize];
            for output in 0..outputs {
                mean[output] = factor * (mean[output] - targets[output]);
                gain[output] *= mean[output];
            }
        }
    }

    fn add_layer_gradient(&mut self, layer: &PaddedLayer, index: usize) {
        let used = BLOCK_ROWS * layer.columns_out;
        let (by_mean, by_variance) = (&self.front.mean[..used], &self.front.variance[..used]);
        let (sum, inputs) = (&mut self.gradient[index], &self.inputs[index]);
        let rows = layer.shape.outputs.next_multiple_of(4);
        let (columns, stride) = (layer.columns_in, layer.columns_out);
        let (x, square) = (&inputs.activation, &inputs.square);
        transposed_times(
            self.tier,
            rows,
            columns,
            stride,
            by_mean,
            x,
            &mut sum.by_mean,
        );
        transposed_times(
            self.tier,
            rows,
            columns,
            stride,
            by_variance,
            square,
            &mut sum.by_variance,
        );
        add_columns(self.tier, by_mean, &mut sum.by_bias_mean);
        add_columns(self.tier, by_variance, &mut sum.by_bias_variance);
    }

    /// From the moments of this layer's pre-activations to those of the layer before.
    fn through_layer(&mut self, layer: &PaddedLayer, index: usize) {
        let used = BLOCK_ROWS * layer.columns_out;
        let (by_mean, by_variance) = (&self.front.mean[..used], &self.front.variance[..used]);
        let used = BLOCK_ROWS * layer.columns_in;
        let (mean, variance) = (&mut self.back.mean[..used], &mut self.back.variance[..used]);
        let (depth, columns, stride) = (layer.shape.outputs, layer.columns_in, layer.columns_out);
        let zeros = &self.zeros[..columns];
        rows_times(
            self.tier,
            depth,
            columns,
            stride,
            by_mean,
            &layer.backward_mean,
            zeros,
            mean,
        );
        rows_times(
            self.tier,
            depth,
            columns,
            stride,
            by_variance,
            &layer.backward_variance,
            zeros,
            variance,
        );
        let inputs = &self.inputs[index];
        hidden_backward(
            self.tier,
            mean,
            variance,
            &inputs.activation,
            &inputs.slope,
            &inputs.gain,
        );
    }
}

fn block_order(order: &[u32], block: usize) -> &[u32] {
    let start = block * BLOCK_ROWS;
    &order[start..order.len().min(start + BLOCK_ROWS)]
}
