//! Reads the sections of a blob in their order and checks every field of theirs.

use super::activation::Activation;
use super::error::{BlobError, BlobField};
use super::field;
use super::floats::{Floats, u16_at, u32_at};

/// Bytes of one entry of a layer table.
pub type LayerEntry = [u8; field::LAYER_ENTRY_LEN];

/// What of a blob has been checked so far.
pub struct Reader<'a> {
    pub bytes: &'a [u8],
    /// Offset of what comes next.
    pub at: usize,
}

impl<'a> Reader<'a> {
    pub fn take(&mut self, len: usize) -> Result<&'a [u8], BlobError> {
        let end = self.at.saturating_add(len);
        let taken = self.bytes.get(self.at..end).ok_or(BlobError::Truncated {
            needed: end,
            given: self.bytes.len(),
        })?;
        self.at = end;
        Ok(taken)
    }

    pub fn floats(&mut self, count: usize) -> Result<Floats<'a>, BlobError> {
        Ok(Floats(self.take(4 * count)?.as_chunks().0))
    }

    /// Pairs of mean and scale.
    pub fn normalisation(
        &mut self,
        count: usize,
        name: BlobField,
    ) -> Result<Floats<'a>, BlobError> {
        let values = self.floats(2 * count)?;
        for [mean, scale] in values.pairs() {
            if !(mean.is_finite() && scale.is_finite() && scale > 0.0) {
                return Err(BlobError::Invalid(name));
            }
        }
        Ok(values)
    }

    /// What the next network's hidden layers end in, and its layers.
    pub fn layer_table(
        &mut self,
        version: u16,
    ) -> Result<(Activation, &'a [LayerEntry]), BlobError> {
        let entry = self.take(field::NETWORK_ENTRY_LEN)?;
        let entry = entry.first_chunk::<{ field::NETWORK_ENTRY_LEN }>();
        let &[low, high, activation, padding] =
            entry.ok_or(BlobError::Invalid(BlobField::Layers))?;
        let layers = usize::from(u16::from_le_bytes([low, high]));
        if !(1..=field::LAYERS_MAX).contains(&layers) {
            return Err(BlobError::Invalid(BlobField::Layers));
        }
        // Where no version says otherwise the byte is padding too.
        if padding != 0 || (version == field::VERSION_GELU && activation != 0) {
            return Err(BlobError::Invalid(BlobField::Padding));
        }
        let activation =
            Activation::of_id(activation).ok_or(BlobError::Invalid(BlobField::Activation))?;
        let table = self.take(layers * field::LAYER_ENTRY_LEN)?.as_chunks().0;
        Ok((activation, table))
    }

    pub fn network(
        &mut self,
        table: &[LayerEntry],
        network_inputs: usize,
        network_outputs: usize,
    ) -> Result<(), BlobError> {
        use BlobError::Invalid;
        let mut width = network_inputs;
        for entry in table {
            let inputs = usize::from(u16_at::<{ field::LAYER_INPUTS.start }, _>(entry));
            let outputs = usize::from(u16_at::<{ field::LAYER_OUTPUTS.start }, _>(entry));
            if inputs != width || !(1..=field::WIDTH_MAX).contains(&outputs) {
                return Err(Invalid(BlobField::LayerSize));
            }
            width = outputs;
            if u32_at::<{ field::LAYER_OFFSET.start }, _>(entry) as usize != self.at {
                return Err(Invalid(BlobField::LayerOffset));
            }
            let variance_max = u32_at::<{ field::LAYER_VARIANCE_MAX.start }, _>(entry);
            let variance_max = f32::from_bits(variance_max);
            if !(variance_max.is_finite() && variance_max >= 0.0) {
                return Err(Invalid(BlobField::VarianceMax));
            }
            let stride = field::row_stride(inputs).max(1);
            for _means_then_codes in 0..2 {
                for row in self.take(outputs * stride)?.chunks_exact(stride) {
                    if row.iter().skip(inputs).any(|&byte| byte != 0) {
                        return Err(Invalid(BlobField::Padding));
                    }
                }
            }
            let scales = self.floats(outputs)?;
            if scales
                .iter()
                .any(|scale| !(scale.is_finite() && scale >= 0.0))
            {
                return Err(Invalid(BlobField::ChannelScale));
            }
            if self.floats(outputs)?.iter().any(|bias| !bias.is_finite()) {
                return Err(Invalid(BlobField::BiasMean));
            }
            let variances = self.floats(outputs)?;
            if variances.iter().any(|v| !(v.is_finite() && v >= 0.0)) {
                return Err(Invalid(BlobField::BiasVariance));
            }
        }
        if width != network_outputs {
            return Err(Invalid(BlobField::Outputs));
        }
        Ok(())
    }
}
