//! Checked zero-copy view over a model blob.
//!
//! Panic contract: [`Blob::parse`] accepts any bytes and never panics. Everything a view returns
//! afterwards was checked by it, so accessors with an index in the stated range cannot fail.

mod error;
pub mod field;
mod floats;
mod kind;
mod network_view;
mod reader;

pub use error::{BlobError, BlobField};
pub use floats::Floats;
pub use kind::{FeatureLayout, Kind, ParameterLimits};
pub use network_view::{LayerView, NetworkView};

use crc::{CRC_32_ISO_HDLC, Crc};

use floats::{u16_at, u32_at};
use reader::Reader;

const CRC32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

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
        if parameters != kind.parameter_limits().len() {
            return Err(Invalid(BlobField::Parameters));
        }
        let mut reader = Reader {
            bytes,
            at: field::HEADER_LEN,
        };
        for (value, parameter) in reader
            .floats(parameters)?
            .iter()
            .zip(kind.parameter_limits())
        {
            if !(parameter.least..=parameter.most).contains(&value) {
                return Err(BlobError::Parameter(parameter.name));
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

#[cfg(test)]
pub(crate) mod draft;
#[cfg(test)]
mod tests;
