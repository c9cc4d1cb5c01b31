//! One Bayesian dense layer: moments of its pre-activations for given inputs.
//!
//! For a fixed input x the pre-activations of a mean-field Gaussian layer are independent
//! Gaussians with mean `mu.x + mu_b` and variance `sigma^2.x^2 + sigma_b^2`, so drawing them is
//! drawing the weights (local reparameterisation, Kingma et al. 2015).

use crate::blob::LayerView;
use crate::blob::field::row_stride;
use crate::gaussian::standard_normal;
use crate::kernel::{Packed, sqrt};
use rand_core::Rng;

/// Calls `each(output, mean, variance)` with the moments of every pre-activation, for `L` passes.
#[inline]
pub fn moments<const L: usize>(
    layer: &LayerView<'_>,
    packed: &Packed<L>,
    mut each: impl FnMut(usize, [f32; L], [f32; L]),
) {
    let stride = row_stride(layer.inputs);
    let rows = layer
        .means
        .chunks_exact(stride)
        .zip(layer.variance_codes.chunks_exact(stride));
    for (output, (means, codes)) in rows.enumerate() {
        let scale = layer.channel_scale.get(output);
        let bias_mean = layer.bias_mean.get(output);
        let bias_variance = layer.bias_variance.get(output);
        let (mean, variance) = packed.dots(means, codes);
        each(
            output,
            mean.map(|dot| dot * scale + bias_mean),
            variance.map(|dot| dot * layer.variance_max + bias_variance),
        );
    }
}

/// The means of the pre-activations alone: the layer with every weight at its mean.
#[inline]
pub fn means<const L: usize>(
    layer: &LayerView<'_>,
    packed: &Packed<L>,
    mut each: impl FnMut(usize, [f32; L]),
) {
    let rows = layer.means.chunks_exact(row_stride(layer.inputs));
    for (output, means) in rows.enumerate() {
        let scale = layer.channel_scale.get(output);
        let bias = layer.bias_mean.get(output);
        each(
            output,
            packed.dot_means(means).map(|dot| dot * scale + bias),
        );
    }
}

/// The layer for one draw of every weight and bias, in f32 throughout: the definition that
/// [`moments`] is verified against. Writes `outputs` pre-activations.
pub fn sample_weights(
    layer: &LayerView<'_>,
    inputs: &[f32],
    rng: &mut impl Rng,
    outputs: &mut [f32],
) {
    for (output, sum) in outputs.iter_mut().enumerate().take(layer.outputs) {
        let bias_sigma = sqrt(layer.bias_variance.get(output));
        *sum = layer.bias_mean.get(output) + bias_sigma * standard_normal(rng);
        for (input, &x) in inputs.iter().enumerate().take(layer.inputs) {
            let sigma = sqrt(layer.variance(output, input));
            *sum += (layer.mean(output, input) + sigma * standard_normal(rng)) * x;
        }
    }
}
