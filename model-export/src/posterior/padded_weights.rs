//! The weights of one training step in the layout that the products want.

use crate::kernel::{Aligned, LANES, Tier, exp_in_place};
use crate::posterior::architecture::LayerShape;
use crate::posterior::gaussian_weights::GaussianWeights;

/// One layer, once for each direction; rows padded with zeros to whole registers.
pub(crate) struct PaddedLayer {
    pub shape: LayerShape,
    /// Outputs rounded up to whole registers.
    pub columns_out: usize,
    /// Inputs rounded up to whole registers.
    pub columns_in: usize,
    /// Means, `[input][output]`.
    pub forward_mean: Aligned,
    /// Variances, `[input][output]`.
    pub forward_variance: Aligned,
    /// Means, `[output][input]`.
    pub backward_mean: Aligned,
    /// Variances, `[output][input]`.
    pub backward_variance: Aligned,
    /// Bias means.
    pub bias_mean: Aligned,
    /// Bias variances.
    pub bias_variance: Aligned,
}

impl PaddedLayer {
    fn new(shape: LayerShape) -> Self {
        let columns_out = shape.outputs.next_multiple_of(LANES);
        let columns_in = shape.inputs.next_multiple_of(LANES);
        Self {
            shape,
            columns_out,
            columns_in,
            forward_mean: Aligned::zeros(shape.inputs * columns_out),
            forward_variance: Aligned::zeros(shape.inputs * columns_out),
            backward_mean: Aligned::zeros(shape.outputs * columns_in),
            backward_variance: Aligned::zeros(shape.outputs * columns_in),
            bias_mean: Aligned::zeros(columns_out),
            bias_variance: Aligned::zeros(columns_out),
        }
    }
}

/// All layers.
pub(crate) struct PaddedWeights {
    pub layers: Vec<PaddedLayer>,
    variances: Aligned,
}

impl PaddedWeights {
    pub fn new(weights: &GaussianWeights) -> Self {
        let layers = weights
            .architecture
            .layers()
            .into_iter()
            .map(PaddedLayer::new)
            .collect();
        let parameters = weights.architecture.parameters().next_multiple_of(LANES);
        Self {
            layers,
            variances: Aligned::zeros(parameters),
        }
    }

    /// Takes over the values of `weights`, which has the same architecture.
    pub fn load(&mut self, tier: Tier, weights: &GaussianWeights) {
        self.variances[..weights.log_sigmas.len()].copy_from_slice(&weights.log_sigmas);
        exp_in_place(tier, 2.0, &mut self.variances);
        for layer in &mut self.layers {
            let shape = layer.shape;
            for output in 0..shape.outputs {
                let row = shape.row(output)..shape.row(output) + shape.inputs;
                let at = output * layer.columns_in;
                let means = &weights.means[row.clone()];
                let variances = &self.variances[row];
                layer.backward_mean[at..at + shape.inputs].copy_from_slice(means);
                layer.backward_variance[at..at + shape.inputs].copy_from_slice(variances);
            }
            transpose(
                &layer.backward_mean,
                layer.columns_in,
                shape,
                &mut layer.forward_mean,
            );
            transpose(
                &layer.backward_variance,
                layer.columns_in,
                shape,
                &mut layer.forward_variance,
            );
            let biases = shape.bias(0)..shape.end();
            layer.bias_mean[..shape.outputs].copy_from_slice(&weights.means[biases.clone()]);
            layer.bias_variance[..shape.outputs].copy_from_slice(&self.variances[biases]);
        }
    }
}

/// `to[input][output] = from[output][input]`.
fn transpose(from: &[f32], columns_in: usize, shape: LayerShape, to: &mut [f32]) {
    let columns_out = shape.outputs.next_multiple_of(LANES);
    for input in 0..shape.inputs {
        let row = &mut to[input * columns_out..][..shape.outputs];
        for (output, value) in row.iter_mut().enumerate() {
            *value = from[output * columns_in + input];
        }
    }
}
