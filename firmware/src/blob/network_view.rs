//! Views of a checked blob's networks and layers.

use super::field;
use super::floats::{Floats, f32_at, u16_at, u32_at};

/// One Bayesian dense layer inside a blob.
#[derive(Clone, Copy, Debug)]
pub struct LayerView<'a> {
    /// Number of inputs.
    pub inputs: usize,
    /// Number of outputs.
    pub outputs: usize,
    /// Weight means as int8, row-major `[outputs][row_stride(inputs)]`, padded with zeros.
    pub means: &'a [u8],
    /// Weight variance codes in the same shape; see [`LayerView::variance`].
    pub variance_codes: &'a [u8],
    /// Scale of the int8 means, one per output.
    pub channel_scale: Floats<'a>,
    /// Bias means, one per output.
    pub bias_mean: Floats<'a>,
    /// Bias variances, one per output.
    pub bias_variance: Floats<'a>,
    /// Variance that code 255 stands for.
    pub variance_max: f32,
}

impl LayerView<'_> {
    /// Mean of the weight from input `input` to output `output`.
    pub fn mean(&self, output: usize, input: usize) -> f32 {
        let code = self.means[output * field::row_stride(self.inputs) + input] as i8;
        f32::from(code) * self.channel_scale.get(output)
    }

    /// Variance of the weight from input `input` to output `output`:
    /// `variance_max * 2^((code - 255) / 8)`, and exactly zero for code 0.
    pub fn variance(&self, output: usize, input: usize) -> f32 {
        let code = self.variance_codes[output * field::row_stride(self.inputs) + input];
        if code == 0 {
            return 0.0;
        }
        self.variance_max * libm::exp2f((f32::from(code) - 255.0) / 8.0)
    }
}

/// One network inside a blob: its layers from input to output.
#[derive(Clone, Copy, Debug)]
pub struct NetworkView<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) table: &'a [u8],
}

impl<'a> NetworkView<'a> {
    /// Number of layers.
    pub fn layers(&self) -> usize {
        self.table.len() / field::LAYER_ENTRY_LEN
    }

    /// Layer `index`, which must be below [`NetworkView::layers`].
    pub fn layer(&self, index: usize) -> LayerView<'a> {
        let entry = &self.table[index * field::LAYER_ENTRY_LEN..][..field::LAYER_ENTRY_LEN];
        let inputs = usize::from(u16_at(entry, field::LAYER_INPUTS.start));
        let outputs = usize::from(u16_at(entry, field::LAYER_OUTPUTS.start));
        let offset = u32_at(entry, field::LAYER_OFFSET.start) as usize;
        let weights = outputs * field::row_stride(inputs);
        let data = &self.bytes[offset..offset + field::layer_len(inputs, outputs)];
        let (means, data) = data.split_at(weights);
        let (variance_codes, data) = data.split_at(weights);
        let (channel_scale, data) = data.split_at(4 * outputs);
        let (bias_mean, bias_variance) = data.split_at(4 * outputs);
        LayerView {
            inputs,
            outputs,
            means,
            variance_codes,
            channel_scale: Floats(channel_scale),
            bias_mean: Floats(bias_mean),
            bias_variance: Floats(bias_variance),
            variance_max: f32_at(entry, field::LAYER_VARIANCE_MAX.start),
        }
    }
}
