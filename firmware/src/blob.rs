//! Checked zero-copy view over a model blob.
//!
//! [`Blob::parse`] accepts any bytes, and everything a view returns afterwards was checked by it.
//! Nothing here panics: an accessor with an index out of its range says NaN, or a layer without
//! weights.

mod activation;
mod error;
pub mod field;
mod floats;
mod kind;
mod network_view;
mod reader;

pub use activation::Activation;
pub use error::{BlobError, BlobField};
pub use floats::Floats;
pub use kind::{FeatureLayout, Kind, ParameterLimits};
pub use network_view::{LayerView, NetworkView};

use crc::{CRC_32_ISO_HDLC, Crc};

use floats::{u16_at, u32_at};
use reader::Reader;

const CRC32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

type Header = [u8; field::HEADER_LEN];

/// A checked model blob; see `BLOB.md` for the format.
///
/// ```
/// use bnkf::blob::{Activation, Blob, BlobError, BlobField, FeatureLayout, Floats, Kind};
/// use bnkf::blob::{LayerView, NetworkView, ParameterLimits};
/// # static BLOB: &[u8] = include_bytes!("../models/recursive.bnkf");
///
/// match Blob::parse(&BLOB[1..]) {
///     Err(BlobError::NotABlob) => println!("these are other bytes"),
///     Err(BlobError::Invalid(BlobField::Layers)) => println!("no network has so many layers"),
///     other => panic!("{other:?}"),
/// }
///
/// let blob = Blob::parse(BLOB)?;
/// assert_eq!(blob.kind(), Kind::Recursive);
/// let layout: FeatureLayout = blob.features();
/// let parameters: Floats<'_> = blob.parameters();
/// for (value, limits) in parameters.iter().zip(blob.kind().parameter_limits()) {
///     let ParameterLimits { name, least, most } = limits;
///     assert!((*least..=*most).contains(&value), "{name}");
/// }
/// let network: NetworkView<'_> = blob.networks().next().expect("a blob has one at least");
/// assert_eq!(network.activation(), Activation::Gelu);
/// let layer: LayerView<'_> = network.layer(0);
/// assert_eq!(layer.inputs, layout.len());
/// println!("the first weight is {} with variance {}", layer.mean(0, 0), layer.variance(0, 0));
/// # Ok::<(), BlobError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Blob<'a> {
    header: &'a Header,
    kind: Kind,
    features: FeatureLayout,
    parameters: Floats<'a>,
    input_normalisation: Floats<'a>,
    output_normalisation: Floats<'a>,
    networks: [Option<NetworkView<'a>>; field::NETWORKS_MAX],
}

impl<'a> Blob<'a> {
    /// Checks every field of `bytes` and returns the view.
    ///
    /// # Errors
    /// The first thing found wrong, in the order of the fields.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, BlobError> {
        use BlobError::Invalid;
        let header = check_frame(bytes)?;
        let kind = Kind::of_id(header[field::KIND]).ok_or(Invalid(BlobField::Kind))?;
        if header[field::UNITS] != field::UNITS_SI {
            return Err(Invalid(BlobField::Units));
        }
        let features = FeatureLayout::of_id(header[field::FEATURES], kind);
        let features = features.ok_or(Invalid(BlobField::Features))?;
        let networks = usize::from(header[field::NETWORKS]);
        let inputs = usize::from(header[field::INPUTS]);
        let outputs = usize::from(header[field::OUTPUTS]);
        let parameters = usize::from(u16_at::<{ field::PARAMETERS.start }, _>(header));
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
        let passes = u16_at::<{ field::PASSES.start }, _>(header);
        if !(1..=field::PASSES_MAX).contains(&passes) {
            return Err(Invalid(BlobField::Passes));
        }
        let version = u16_at::<{ field::VERSION.start }, _>(header);
        if parameters != kind.parameters(version) {
            return Err(Invalid(BlobField::Parameters));
        }
        let mut reader = Reader {
            bytes,
            at: field::HEADER_LEN,
        };
        let parameters = reader.floats(parameters)?;
        for (value, parameter) in parameters.iter().zip(kind.parameter_limits()) {
            if !(parameter.least..=parameter.most).contains(&value) {
                return Err(BlobError::Parameter(parameter.name));
            }
        }
        let input_normalisation = reader.normalisation(inputs, BlobField::InputNormalisation)?;
        let output_normalisation =
            reader.normalisation(networks * outputs, BlobField::OutputNormalisation)?;

        let mut views = [None; field::NETWORKS_MAX];
        for view in views.iter_mut().take(networks) {
            let (activation, table) = reader.layer_table(version)?;
            // The trainer and the twin in f64 know no other.
            if kind == Kind::Recursive && activation != Activation::Gelu {
                return Err(Invalid(BlobField::Activation));
            }
            *view = Some(NetworkView {
                bytes,
                table,
                activation,
            });
        }
        for view in views.iter().flatten() {
            reader.network(view.table, inputs, outputs)?;
        }
        if reader.at != bytes.len() {
            return Err(BlobError::WrongLength {
                header: bytes.len(),
                given: reader.at,
            });
        }
        Ok(Self {
            header,
            kind,
            features,
            parameters,
            input_normalisation,
            output_normalisation,
            networks: views,
        })
    }

    /// Version of the format that it is written in.
    pub fn version(&self) -> u16 {
        u16_at::<{ field::VERSION.start }, _>(self.header)
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
        usize::from(self.header[field::NETWORKS])
    }

    /// Outputs of each network.
    pub fn outputs(&self) -> usize {
        usize::from(self.header[field::OUTPUTS])
    }

    /// Monte Carlo passes by default.
    pub fn passes(&self) -> u16 {
        u16_at::<{ field::PASSES.start }, _>(self.header)
    }

    /// Checksum of the blob: its identity in logs and reports.
    pub fn checksum(&self) -> u32 {
        u32_at::<{ field::CRC.start }, _>(self.header)
    }

    /// The parameters that follow the header; their meaning depends on the kind (see [`field`]).
    pub fn parameters(&self) -> Floats<'a> {
        self.parameters
    }

    /// Pairs (mean, inverse scale) per input: the network sees `(feature - mean) * inverse scale`.
    pub fn input_normalisation(&self) -> Floats<'a> {
        self.input_normalisation
    }

    /// Pairs (mean, scale) per output, all networks in order: estimate = `mean + scale * output`.
    pub fn output_normalisation(&self) -> Floats<'a> {
        self.output_normalisation
    }
}

/// Checksum of a blob's bytes, skipping the checksum field itself.
pub fn checksum(bytes: &[u8]) -> u32 {
    let mut digest = CRC32.digest();
    digest.update(bytes.get(..field::CRC.start).unwrap_or(bytes));
    digest.update(bytes.get(field::CRC.end..).unwrap_or_default());
    digest.finalize()
}

/// The header of `bytes` that are as long as it says and have its checksum.
fn check_frame(bytes: &[u8]) -> Result<&Header, BlobError> {
    let header: &Header = bytes.first_chunk().ok_or(BlobError::Truncated {
        needed: field::HEADER_LEN,
        given: bytes.len(),
    })?;
    if header[field::MAGIC] != field::MAGIC_BYTES {
        return Err(BlobError::NotABlob);
    }
    let version = u16_at::<{ field::VERSION.start }, _>(header);
    if !(field::VERSION_GELU..=field::VERSION_BEND).contains(&version) {
        return Err(BlobError::UnknownVersion(version));
    }
    let length = u32_at::<{ field::LENGTH.start }, _>(header) as usize;
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
    if checksum(bytes) != u32_at::<{ field::CRC.start }, _>(header) {
        return Err(BlobError::WrongChecksum);
    }
    Ok(header)
}

#[cfg(test)]
pub(crate) mod draft;
#[cfg(test)]
mod tests;
