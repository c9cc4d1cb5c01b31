//! From real-valued posteriors to a blob's int8 means and logarithmic variance codes.

use bnkf::blob::field::{CODES_PER_OCTAVE, MEAN_CODE_MAX, VARIANCE_CODE_MAX, octaves, row_stride};
use serde::Serialize;

use crate::posterior::architecture::LayerShape;
use crate::posterior::gaussian_weights::GaussianWeights;

/// One layer as a blob holds it; see `firmware/BLOB.md`.
#[derive(Clone, Debug, PartialEq)]
pub struct QuantisedLayer {
    /// Inputs.
    pub inputs: usize,
    /// Outputs.
    pub outputs: usize,
    /// Weight means, `[outputs][row_stride(inputs)]`, padding zero.
    pub mean_codes: Vec<i8>,
    /// Weight variances, same shape.
    pub variance_codes: Vec<u8>,
    /// Variance of code 255.
    pub variance_max: f32,
    /// Scale of each output's mean codes.
    pub channel_scale: Vec<f32>,
    /// Bias means.
    pub bias_mean: Vec<f32>,
    /// Bias variances.
    pub bias_variance: Vec<f32>,
}

/// What rounding did to one layer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LayerError {
    /// Inputs.
    pub inputs: usize,
    /// Outputs.
    pub outputs: usize,
    /// Root mean square of the means' errors over that of the means.
    pub mean_rms_relative: f64,
    /// Largest error of a mean, in steps of its channel (at most one half).
    pub mean_max_steps: f64,
    /// Root mean square of the means' errors in standard deviations of their own weights, of those that have one;
    /// `None` where none has.
    pub mean_rms_sigmas: Option<f64>,
    /// Largest error of the logarithm of a standard deviation.
    pub ln_sigma_max: f64,
    /// Weights whose variance lies so far below the layer's largest that it became zero.
    pub vanished: usize,
}

/// Rounds the posterior of every layer.
#[must_use]
pub fn quantise(weights: &GaussianWeights) -> Vec<QuantisedLayer> {
    let shapes = weights.architecture.layers();
    shapes
        .iter()
        .map(|shape| quantise_layer(weights, shape))
        .collect()
}

fn variance(weights: &GaussianWeights, index: usize) -> f64 {
    (2.0 * f64::from(weights.log_sigmas[index])).exp()
}

fn quantise_layer(weights: &GaussianWeights, shape: &LayerShape) -> QuantisedLayer {
    let (inputs, outputs) = (shape.inputs, shape.outputs);
    let stride = row_stride(inputs);
    let weight_range = shape.start..shape.bias(0);
    let variance_max = weight_range
        .map(|index| variance(weights, index))
        .fold(0.0, f64::max) as f32;
    let mut layer = QuantisedLayer {
        inputs,
        outputs,
        mean_codes: vec![0; outputs * stride],
        variance_codes: vec![0; outputs * stride],
        variance_max,
        channel_scale: Vec::with_capacity(outputs),
        bias_mean: Vec::with_capacity(outputs),
        bias_variance: Vec::with_capacity(outputs),
    };
    for output in 0..outputs {
        let row = shape.row(output)..shape.row(output) + inputs;
        let largest = weights.means[row.clone()]
            .iter()
            .fold(0.0_f32, |m, w| m.max(w.abs()));
        // A row of zeros needs no scale, but a zero one would divide by zero below.
        let scale = if largest > 0.0 {
            largest / f32::from(MEAN_CODE_MAX)
        } else {
            1.0
        };
        layer.channel_scale.push(scale);
        for (input, index) in row.enumerate() {
            let slot = output * stride + input;
            layer.mean_codes[slot] = (weights.means[index] / scale).round() as i8;
            layer.variance_codes[slot] =
                variance_code(variance(weights, index), f64::from(variance_max));
        }
        layer.bias_mean.push(weights.means[shape.bias(output)]);
        layer
            .bias_variance
            .push(variance(weights, shape.bias(output)) as f32);
    }
    layer
}

/// Nearest code of a variance beside the layer's largest; zero when it vanishes beside it.
fn variance_code(variance: f64, variance_max: f64) -> u8 {
    if variance <= 0.0 || variance_max <= 0.0 {
        return 0;
    }
    let most = f64::from(VARIANCE_CODE_MAX);
    (most + CODES_PER_OCTAVE * (variance / variance_max).log2())
        .round()
        .clamp(0.0, most) as u8
}

/// Compares layers with the posterior that they were rounded from.
#[must_use]
pub fn layer_errors(weights: &GaussianWeights, layers: &[QuantisedLayer]) -> Vec<LayerError> {
    let shapes = weights.architecture.layers();
    shapes
        .iter()
        .zip(layers)
        .map(|(shape, layer)| layer_error(weights, shape, layer))
        .collect()
}

fn layer_error(
    weights: &GaussianWeights,
    shape: &LayerShape,
    layer: &QuantisedLayer,
) -> LayerError {
    let stride = row_stride(shape.inputs);
    let (mut squares, mut errors, mut in_sigmas, mut uncertain) = (0.0, 0.0, 0.0, 0_usize);
    let (mut mean_max_steps, mut ln_sigma_max, mut vanished) = (0.0_f64, 0.0_f64, 0);
    for output in 0..shape.outputs {
        let scale = f64::from(layer.channel_scale[output]);
        for input in 0..shape.inputs {
            let (index, slot) = (shape.row(output) + input, output * stride + input);
            let mean = f64::from(weights.means[index]);
            let error = f64::from(layer.mean_codes[slot]) * scale - mean;
            let variance = variance(weights, index);
            squares += mean * mean;
            errors += error * error;
            if variance > 0.0 {
                in_sigmas += error * error / variance;
                uncertain += 1;
            }
            mean_max_steps = mean_max_steps.max(error.abs() / scale);
            match layer.variance_codes[slot] {
                0 => vanished += 1,
                code => {
                    let coded = f64::from(layer.variance_max) * octaves(code).exp2();
                    ln_sigma_max = ln_sigma_max.max(0.5 * (coded / variance).ln().abs());
                }
            }
        }
    }
    LayerError {
        inputs: shape.inputs,
        outputs: shape.outputs,
        mean_rms_relative: if squares > 0.0 {
            (errors / squares).sqrt()
        } else {
            0.0
        },
        mean_max_steps,
        mean_rms_sigmas: (uncertain > 0).then(|| (in_sigmas / uncertain as f64).sqrt()),
        ln_sigma_max,
        vanished,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::posterior::architecture::Architecture;
    use crate::random_source::RandomSource;

    fn weights() -> GaussianWeights {
        let architecture = Architecture::new(vec![13, 9, 3]).expect("small");
        let mut random = RandomSource::new(4, &[]);
        let mut weights = GaussianWeights::random(&architecture, 0.02, &mut random);
        for log_sigma in &mut weights.log_sigmas {
            *log_sigma += random.uniform(-4.0, 1.0) as f32;
        }
        weights
    }

    #[test]
    fn errors_are_half_a_step_and_a_sixteenth_of_an_octave_at_most() {
        let weights = weights();
        for error in layer_errors(&weights, &quantise(&weights)) {
            assert!(error.mean_max_steps < 0.5 + 1e-4, "{error:?}");
            assert!(error.mean_max_steps > 0.3, "{error:?}");
            // Half a code of an eighth of an octave of variance, as a standard deviation.
            assert!(
                error.ln_sigma_max < 0.5 * 2.0_f64.ln() / 16.0 + 1e-6,
                "{error:?}"
            );
            assert_eq!(error.vanished, 0);
        }
    }

    #[test]
    fn a_deterministic_network_has_zero_codes() {
        let mut weights = weights();
        weights.log_sigmas.fill(f32::NEG_INFINITY);
        for layer in quantise(&weights) {
            assert!(layer.variance_codes.iter().all(|&code| code == 0));
            assert!(layer.bias_variance.iter().all(|&variance| variance == 0.0));
            assert_eq!(layer.variance_max, 0.0);
        }
        for error in layer_errors(&weights, &quantise(&weights)) {
            assert_eq!(error.mean_rms_sigmas, None);
        }
        // One weight that is sure beside others that are not.
        weights.log_sigmas.fill(-3.0);
        weights.log_sigmas[0] = f32::NEG_INFINITY;
        for error in layer_errors(&weights, &quantise(&weights)) {
            assert!(
                error.mean_rms_sigmas.is_some_and(f64::is_finite),
                "{error:?}"
            );
        }
    }

    #[test]
    fn a_row_of_zeros_stays_zero() {
        let mut weights = weights();
        let shape = weights.architecture.layers()[0];
        weights.means[shape.row(2)..shape.row(3)].fill(0.0);
        let layer = &quantise(&weights)[0];
        assert!(
            layer.mean_codes[2 * 16..3 * 16]
                .iter()
                .all(|&code| code == 0)
        );
        assert_eq!(layer.channel_scale[2], 1.0);
    }
}
