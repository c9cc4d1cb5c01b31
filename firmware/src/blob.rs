//! Checked zero-copy view over a model blob.
//!
//! Panic contract: [`Blob::parse`] accepts any bytes and never panics. Everything a view returns
//! afterwards was checked by it, so accessors with an index in the stated range cannot fail.

mod error;
pub mod field;

pub use error::{BlobError, BlobField};

use crc::{CRC_32_ISO_HDLC, Crc};

const CRC32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// What the networks of a blob estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Position from the previous and the current measurement (the paper's BNN, BNKF, BNKFe).
    Memoryless,
    /// A schedule of the motion model of a recursive filter.
    Recursive,
}

/// What the inputs of the network are, in order.
///
/// The polar layouts start with range, elevation, azimuth and range-rate of the previous
/// measurement, then the same four of the current one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeatureLayout {
    /// The paper's twelve: both measurements, then the four sigmas as they are.
    Polar12,
    /// Both measurements with the previous azimuth unwrapped towards the current one, the natural
    /// logarithms of the four sigmas, and the time between the measurements in seconds.
    Polar13,
    /// State, covariance and statistics of the recursive filter; `BLOB.md` lists them.
    Recursive64,
}

impl FeatureLayout {
    /// The id in the blob.
    pub const fn id(self) -> u8 {
        match self {
            Self::Polar12 => 1,
            Self::Polar13 => 2,
            Self::Recursive64 => 3,
        }
    }

    /// Number of features.
    pub const fn len(self) -> usize {
        match self {
            Self::Polar12 => 12,
            Self::Polar13 => 13,
            Self::Recursive64 => 64,
        }
    }

    /// Never: every layout has features.
    pub const fn is_empty(self) -> bool {
        false
    }
}

impl Kind {
    /// The id in the blob.
    pub const fn id(self) -> u8 {
        match self {
            Self::Memoryless => 1,
            Self::Recursive => 2,
        }
    }

    /// Number of parameters that follow the header.
    pub const fn parameters(self) -> usize {
        match self {
            Self::Memoryless => field::MEMORYLESS_PARAMETERS,
            Self::Recursive => field::RECURSIVE_PARAMETERS,
        }
    }
}

/// Little-endian f32 values inside a blob.
#[derive(Clone, Copy, Debug)]
pub struct Floats<'a>(&'a [u8]);

impl<'a> Floats<'a> {
    /// Number of values.
    pub fn len(&self) -> usize {
        self.0.len() / 4
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Value `index`, which must be below [`Floats::len`].
    #[inline]
    pub fn get(&self, index: usize) -> f32 {
        let b = &self.0[4 * index..4 * index + 4];
        f32::from_le_bytes([b[0], b[1], b[2], b[3]])
    }

    /// All values in order.
    pub fn iter(&self) -> impl Iterator<Item = f32> + use<'a> {
        self.0
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    }
}

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
    bytes: &'a [u8],
    table: &'a [u8],
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

/// A checked model blob; see `BLOB.md` for the format.
#[derive(Clone, Copy, Debug)]
pub struct Blob<'a> {
    bytes: &'a [u8],
    kind: Kind,
    features: FeatureLayout,
    networks: [Option<NetworkView<'a>>; field::NETWORKS_MAX],
}

impl<'a> Blob<'a> {
    /// Checks every field of `bytes` and returns the view.
    ///
    /// # Errors
    /// The first thing found wrong, in the order of the fields.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, BlobError> {
        use BlobError::Invalid;
        check_frame(bytes)?;
        let kind = match bytes[field::KIND] {
            1 => Kind::Memoryless,
            2 => Kind::Recursive,
            _ => return Err(Invalid(BlobField::Kind)),
        };
        if bytes[field::UNITS] != field::UNITS_SI {
            return Err(Invalid(BlobField::Units));
        }
        let features = match (kind, bytes[field::FEATURES]) {
            (Kind::Memoryless, 1) => FeatureLayout::Polar12,
            (Kind::Memoryless, 2) => FeatureLayout::Polar13,
            (Kind::Recursive, 3) => FeatureLayout::Recursive64,
            _ => return Err(Invalid(BlobField::Features)),
        };
        let networks = usize::from(bytes[field::NETWORKS]);
        let inputs = usize::from(bytes[field::INPUTS]);
        let outputs = usize::from(bytes[field::OUTPUTS]);
        let parameters = usize::from(u16_at(bytes, field::PARAMETERS.start));
        if inputs != features.len() {
            return Err(Invalid(BlobField::Inputs));
        }
        match (kind, networks, outputs) {
            (Kind::Memoryless, 1, 3) | (Kind::Memoryless, 3, 1) => {}
            (Kind::Recursive, 1, field::RECURSIVE_OUTPUTS) => {}
            (Kind::Memoryless, 1 | 3, _) | (Kind::Recursive, 1, _) => {
                return Err(Invalid(BlobField::Outputs));
            }
            _ => return Err(Invalid(BlobField::Networks)),
        }
        if !(1..=field::PASSES_MAX).contains(&u16_at(bytes, field::PASSES.start)) {
            return Err(Invalid(BlobField::Passes));
        }
        if parameters != kind.parameters() {
            return Err(Invalid(BlobField::Parameters));
        }
        let mut reader = Reader {
            bytes,
            at: field::HEADER_LEN,
        };
        for (index, value) in reader.floats(parameters)?.iter().enumerate() {
            // A mean elevation may lie below the horizon; everything else is a size.
            let signed = kind == Kind::Recursive && index == field::PARAMETER_ELEVATION;
            if !(value.is_finite() && (value > 0.0 || signed)) {
                return Err(Invalid(BlobField::Parameters));
            }
        }
        reader.normalisation(inputs, BlobField::InputNormalisation)?;
        reader.normalisation(networks * outputs, BlobField::OutputNormalisation)?;

        let mut tables: [&[u8]; field::NETWORKS_MAX] = [&[]; field::NETWORKS_MAX];
        for table in tables.iter_mut().take(networks) {
            *table = reader.layer_table()?;
        }
        let mut views = [None; field::NETWORKS_MAX];
        for (table, view) in tables.into_iter().zip(&mut views).take(networks) {
            reader.network(table, inputs, outputs)?;
            *view = Some(NetworkView { bytes, table });
        }
        if reader.at != bytes.len() {
            return Err(BlobError::WrongLength {
                header: bytes.len(),
                given: reader.at,
            });
        }
        Ok(Self {
            bytes,
            kind,
            features,
            networks: views,
        })
    }

    /// What the networks estimate.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// What the inputs are.
    pub fn features(&self) -> FeatureLayout {
        self.features
    }

    /// The networks: one (BNKF) or three, for x, y and z (BNKFe).
    pub fn networks(&self) -> impl Iterator<Item = NetworkView<'a>> + use<'a> {
        self.networks.into_iter().flatten()
    }

    /// Number of networks.
    pub fn network_count(&self) -> usize {
        usize::from(self.bytes[field::NETWORKS])
    }

    /// Outputs of each network.
    pub fn outputs(&self) -> usize {
        usize::from(self.bytes[field::OUTPUTS])
    }

    /// Monte Carlo passes by default.
    pub fn passes(&self) -> u16 {
        u16_at(self.bytes, field::PASSES.start)
    }

    /// Checksum of the blob: its identity in logs and reports.
    pub fn checksum(&self) -> u32 {
        u32_at(self.bytes, field::CRC.start)
    }

    /// The parameters that follow the header; their meaning depends on the kind (see [`field`]).
    pub fn parameters(&self) -> Floats<'a> {
        let count = usize::from(u16_at(self.bytes, field::PARAMETERS.start));
        Floats(&self.bytes[field::HEADER_LEN..field::HEADER_LEN + 4 * count])
    }

    /// Pairs (mean, inverse scale) per input: the network sees `(feature - mean) * inverse scale`.
    pub fn input_normalisation(&self) -> Floats<'a> {
        let start = field::HEADER_LEN + 4 * self.parameters().len();
        Floats(&self.bytes[start..start + field::NORMALISATION_LEN * self.features.len()])
    }

    /// Pairs (mean, scale) per output, all networks in order: estimate = `mean + scale * output`.
    pub fn output_normalisation(&self) -> Floats<'a> {
        let start = field::HEADER_LEN
            + 4 * self.parameters().len()
            + field::NORMALISATION_LEN * self.features.len();
        let outputs = self.network_count() * self.outputs();
        Floats(&self.bytes[start..start + field::NORMALISATION_LEN * outputs])
    }
}

/// Checksum of a blob's bytes, skipping the checksum field itself. `bytes` holds at least a header.
pub fn checksum(bytes: &[u8]) -> u32 {
    let mut digest = CRC32.digest();
    digest.update(&bytes[..field::CRC.start]);
    digest.update(&bytes[field::CRC.end..]);
    digest.finalize()
}

fn check_frame(bytes: &[u8]) -> Result<(), BlobError> {
    if bytes.len() < field::HEADER_LEN {
        return Err(BlobError::Truncated {
            needed: field::HEADER_LEN,
            given: bytes.len(),
        });
    }
    if bytes[field::MAGIC] != field::MAGIC_BYTES {
        return Err(BlobError::NotABlob);
    }
    let version = u16_at(bytes, field::VERSION.start);
    if version != field::FORMAT_VERSION {
        return Err(BlobError::UnknownVersion(version));
    }
    let length = u32_at(bytes, field::LENGTH.start) as usize;
    if bytes.len() < length {
        return Err(BlobError::Truncated {
            needed: length,
            given: bytes.len(),
        });
    }
    if length != bytes.len() {
        return Err(BlobError::WrongLength {
            header: length,
            given: bytes.len(),
        });
    }
    if checksum(bytes) != u32_at(bytes, field::CRC.start) {
        return Err(BlobError::WrongChecksum);
    }
    Ok(())
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, len: usize) -> Result<&'a [u8], BlobError> {
        let end = self.at.saturating_add(len);
        let taken = self.bytes.get(self.at..end).ok_or(BlobError::Truncated {
            needed: end,
            given: self.bytes.len(),
        })?;
        self.at = end;
        Ok(taken)
    }

    fn floats(&mut self, count: usize) -> Result<Floats<'a>, BlobError> {
        Ok(Floats(self.take(4 * count)?))
    }

    fn normalisation(&mut self, count: usize, name: BlobField) -> Result<(), BlobError> {
        let values = self.floats(2 * count)?;
        for i in 0..count {
            let (mean, scale) = (values.get(2 * i), values.get(2 * i + 1));
            if !(mean.is_finite() && scale.is_finite() && scale > 0.0) {
                return Err(BlobError::Invalid(name));
            }
        }
        Ok(())
    }

    fn layer_table(&mut self) -> Result<&'a [u8], BlobError> {
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

    fn network(
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

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

fn f32_at(bytes: &[u8], at: usize) -> f32 {
    f32::from_bits(u32_at(bytes, at))
}
