//! Reads the sections of a blob in their order and checks every field of theirs.

use super::error::{BlobError, BlobField};
use super::field;
use super::floats::{Floats, f32_at, u16_at, u32_at};

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
        Ok(Floats(self.take(4 * count)?))
    }

    pub fn normalisation(&mut self, count: usize, name: BlobField) -> Result<(), BlobError> {
        let values = self.floats(2 * count)?;
        for i in 0..count {
            let (mean, scale) = (values.get(2 * i), values.get(2 * i + 1));
            if !(mean.is_finite() && scale.is_finite() && scale > 0.0) {
                return Err(BlobError::Invalid(name));
            }
        }
        Ok(())
    }

    pub fn layer_table(&mut self) -> Result<&'a [u8], BlobError> {
        let entry = self.take(field::NETWORK_ENTRY_LEN)?;
        let layers = usize::from(u16_at(entry, 0));
        if !(1..=field::LAYERS_MAX).contains(&layers) {
            return Err(BlobError::Invalid(BlobField::Layers));
        }
        if entry[2..4] != [0, 0] {
            return Err(BlobError::Invalid(BlobField::Padding));
        }
        self.take(layers * field::LAYER_ENTRY_LEN)
    }

    pub fn network(
        &mut self,
        table: &[u8],
        network_inputs: usize,
        network_outputs: usize,
    ) -> Result<(), BlobError> {
        use BlobError::Invalid;
        let mut width = network_inputs;
        for entry in table.chunks_exact(field::LAYER_ENTRY_LEN) {
            let inputs = usize::from(u16_at(entry, field::LAYER_INPUTS.start));
            let outputs = usize::from(u16_at(entry, field::LAYER_OUTPUTS.start));
            if inputs != width || !(1..=field::WIDTH_MAX).contains(&outputs) {
                return Err(Invalid(BlobField::LayerSize));
            }
            width = outputs;
            if u32_at(entry, field::LAYER_OFFSET.start) as usize != self.at {
                return Err(Invalid(BlobField::LayerOffset));
            }
            let variance_max = f32_at(entry, field::LAYER_VARIANCE_MAX.start);
            if !(variance_max.is_finite() && variance_max >= 0.0) {
                return Err(Invalid(BlobField::VarianceMax));
            }
            let stride = field::row_stride(inputs);
            for _means_then_codes in 0..2 {
                for row in self.take(outputs * stride)?.chunks_exact(stride) {
                    if row[inputs..].iter().any(|&byte| byte != 0) {
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
