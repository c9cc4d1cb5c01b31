//! Views of a checked blob's networks and layers.

use super::activation::Activation;
use super::field;
use super::floats::{Floats, u16_at, u32_at};
use super::reader::LayerEntry;

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

impl<'a> LayerView<'a> {
    /// A layer without weights.
    const EMPTY: Self = Self {
        inputs: 0,
        outputs: 0,
        means: &[],
        variance_codes: &[],
        channel_scale: Floats(&[]),
        bias_mean: Floats(&[]),
        bias_variance: Floats(&[]),
        variance_max: 0.0,
    };

    /// The layer of a table's entry; `None` if `bytes` are too short.
    #[inline]
    fn of(entry: &LayerEntry, bytes: &'a [u8]) -> Option<Self> {
        let inputs = usize::from(u16_at::<{ field::LAYER_INPUTS.start }, _>(entry));
        let outputs = usize::from(u16_at::<{ field::LAYER_OUTPUTS.start }, _>(entry));
        let offset = u32_at::<{ field::LAYER_OFFSET.start }, _>(entry) as usize;
        let variance_max = u32_at::<{ field::LAYER_VARIANCE_MAX.start }, _>(entry);
        let weights = outputs * field::row_stride(inputs);
        let data = bytes.get(offset..)?;
        let (means, data) = data.split_at_checked(weights)?;
        let (variance_codes, data) = data.split_at_checked(weights)?;
        let (floats, _) = data.as_chunks();
        let (channel_scale, floats) = floats.split_at_checked(outputs)?;
        let (bias_mean, floats) = floats.split_at_checked(outputs)?;
        Some(Self {
            inputs,
            outputs,
            means,
            variance_codes,
            channel_scale: Floats(channel_scale),
            bias_mean: Floats(bias_mean),
            bias_variance: Floats(floats.get(..outputs)?),
            variance_max: f32::from_bits(variance_max),
        })
    }

    /// Mean of the weight from input `input` to output `output`; NaN where there is none.
    pub fn mean(&self, output: usize, input: usize) -> f32 {
        let code = self.means.get(self.place(output, input));
        code.map_or(f32::NAN, |&code| {
            f32::from(code as i8) * self.channel_scale.get(output)
        })
    }

    /// Variance of the weight from input `input` to output `output`:
    /// `variance_max * 2^((code - 255) / 8)`, and exactly zero for code 0; NaN where there is none.
    pub fn variance(&self, output: usize, input: usize) -> f32 {
        match self.variance_codes.get(self.place(output, input)) {
            None => f32::NAN,
            Some(0) => 0.0,
            Some(&code) => self.variance_max * libm::exp2f(field::octaves(code) as f32),
        }
    }

    fn place(&self, output: usize, input: usize) -> usize {
        let row = output.wrapping_mul(field::row_stride(self.inputs));
        row.wrapping_add(input)
    }
}

/// One network inside a blob: its layers from input to output.
#[derive(Clone, Copy, Debug)]
pub struct NetworkView<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) table: &'a [LayerEntry],
    pub(super) activation: Activation,
}

impl<'a> NetworkView<'a> {
    /// What every layer but the last ends in.
    pub fn activation(&self) -> Activation {
        self.activation
    }

    /// Number of layers.
    pub fn layers(&self) -> usize {
        self.table.len()
    }

    /// Layer `index`; from [`NetworkView::layers`] on one without weights.
    #[inline]
    pub fn layer(&self, index: usize) -> LayerView<'a> {
        let entry = self.table.get(index);
        // Whoever parsed the blob has seen that each entry's bytes are there.
        entry
            .and_then(|entry| LayerView::of(entry, self.bytes))
            .unwrap_or(LayerView::EMPTY)
    }
}
