//! Why bytes are not a usable blob.

/// A named part of the blob, for [`BlobError`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum BlobField {
    /// Kind of estimator.
    Kind,
    /// Units code.
    Units,
    /// Feature layout id.
    Features,
    /// Number of networks.
    Networks,
    /// Number of inputs.
    Inputs,
    /// Number of outputs.
    Outputs,
    /// Default Monte Carlo passes.
    Passes,
    /// Parameters that follow the header.
    Parameters,
    /// Input normalisation.
    InputNormalisation,
    /// Output normalisation.
    OutputNormalisation,
    /// Number of layers.
    Layers,
    /// What follows the hidden layers.
    Activation,
    /// Size of a layer.
    LayerSize,
    /// Offset of a layer's data.
    LayerOffset,
    /// Largest weight variance of a layer.
    VarianceMax,
    /// Scale of an output channel.
    ChannelScale,
    /// Bias mean.
    BiasMean,
    /// Bias variance.
    BiasVariance,
    /// Bytes that must be zero.
    Padding,
}

/// Why [`super::Blob::parse`] refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum BlobError {
    /// Fewer bytes than the blob needs.
    Truncated {
        /// Bytes needed.
        needed: usize,
        /// Bytes given.
        given: usize,
    },
    /// The first bytes are not `BNKF`.
    NotABlob,
    /// A format version that this code does not know.
    UnknownVersion(u16),
    /// The length field disagrees with the number of bytes given.
    WrongLength {
        /// What the header says.
        header: usize,
        /// Bytes given.
        given: usize,
    },
    /// The checksum does not match the bytes.
    WrongChecksum,
    /// The field's value is outside what the format allows.
    Invalid(BlobField),
    /// The parameter's value is no target's and no model's; `BLOB.md` has the limits.
    Parameter(&'static str),
}

impl core::fmt::Display for BlobField {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Kind => "kind",
            Self::Units => "units",
            Self::Features => "feature layout",
            Self::Networks => "network count",
            Self::Inputs => "input count",
            Self::Outputs => "output count",
            Self::Passes => "default passes",
            Self::Parameters => "parameters",
            Self::InputNormalisation => "input normalisation",
            Self::OutputNormalisation => "output normalisation",
            Self::Layers => "layer count",
            Self::Activation => "activation",
            Self::LayerSize => "layer size",
            Self::LayerOffset => "layer offset",
            Self::VarianceMax => "largest weight variance",
            Self::ChannelScale => "channel scale",
            Self::BiasMean => "bias mean",
            Self::BiasVariance => "bias variance",
            Self::Padding => "padding",
        })
    }
}

impl core::fmt::Display for BlobError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Truncated { needed, given } => {
                write!(f, "blob is truncated: {needed} bytes needed, {given} given")
            }
            Self::NotABlob => f.write_str("not a BNKF blob (wrong first bytes)"),
            Self::UnknownVersion(version) => write!(f, "unknown blob version {version}"),
            Self::WrongLength { header, given } => {
                write!(f, "blob length field says {header} bytes, {given} given")
            }
            Self::WrongChecksum => f.write_str("blob checksum does not match"),
            Self::Invalid(field) => write!(f, "blob field out of range: {field}"),
            Self::Parameter(name) => write!(f, "blob parameter out of range: {name}"),
        }
    }
}

impl core::error::Error for BlobError {}
