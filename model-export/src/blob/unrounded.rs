//! The file beside a blob with the weights as they were before rounding; `verify` compares them.

use crate::blob::sealed::{self, SealError};
use crate::flights::data_hash;
use crate::posterior::architecture::Architecture;
use crate::posterior::gaussian_weights::GaussianWeights;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"BNKFf32w";

/// Why the file cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnroundedError {
    /// It is not a whole file of weights.
    #[error("not a file of unrounded weights: it {0}")]
    Seal(#[from] SealError),
    /// Its header or the amount of numbers is not what this version writes.
    #[error("written by another version")]
    OtherVersion,
    /// It was written beside another blob.
    #[error("belongs to another blob")]
    OtherBlob,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    blob_sha256: String,
    architectures: Vec<Architecture>,
}

/// Where the weights of the blob at `blob` lie: `m.bnkf` has `m.bnkf.f32`.
#[must_use]
pub fn path_beside(blob: &Path) -> PathBuf {
    let mut path = blob.as_os_str().to_owned();
    path.push(".f32");
    path.into()
}

/// The bytes of the file for the networks of `blob`.
#[must_use]
pub fn to_bytes(blob: &[u8], networks: &[GaussianWeights]) -> Vec<u8> {
    let header = Header {
        blob_sha256: data_hash::of_bytes(blob),
        architectures: networks
            .iter()
            .map(|weights| weights.architecture.clone())
            .collect(),
    };
    let numbers = networks
        .iter()
        .flat_map(|w| w.means.iter().chain(&w.log_sigmas))
        .copied();
    sealed::seal(MAGIC, &serde_json::json!(header).to_string(), numbers)
}

/// The networks in `bytes`, which were written beside `blob`.
///
/// # Errors
/// See [`UnroundedError`].
pub fn parse(bytes: &[u8], blob: &[u8]) -> Result<Vec<GaussianWeights>, UnroundedError> {
    use UnroundedError::{OtherBlob, OtherVersion};
    let (header, numbers) = sealed::open(MAGIC, bytes)?;
    let header: Header = serde_json::from_slice(header).map_err(|_| OtherVersion)?;
    if header.blob_sha256 != data_hash::of_bytes(blob) {
        return Err(OtherBlob);
    }
    let mut left = numbers.as_slice();
    let networks = header.architectures.into_iter().map(|architecture| {
        let mut take = || {
            let (list, rest) = left.split_at_checked(architecture.parameters())?;
            left = rest;
            Some(list.to_vec())
        };
        let (means, log_sigmas) = (take()?, take()?);
        Some(GaussianWeights {
            architecture,
            means,
            log_sigmas,
        })
    });
    let networks = networks.collect::<Option<Vec<_>>>().ok_or(OtherVersion)?;
    if left.is_empty() {
        Ok(networks)
    } else {
        Err(OtherVersion)
    }
}

#[cfg(test)]
mod tests {
    use super::{UnroundedError, parse, path_beside, to_bytes};
    use crate::blob::sealed::SealError;
    use crate::posterior::architecture::Architecture;
    use crate::posterior::gaussian_weights::GaussianWeights;
    use crate::random_source::RandomSource;
    use std::path::Path;

    #[test]
    fn weights_come_back_for_their_own_blob_only() {
        let network = |seed| {
            let architecture = Architecture::new(vec![3, 4, 1]).unwrap();
            GaussianWeights::random(&architecture, 0.1, &mut RandomSource::new(seed, &[]))
        };
        let networks = [network(1), network(2)];
        let bytes = to_bytes(b"blob", &networks);
        assert_eq!(parse(&bytes, b"blob").unwrap(), networks);
        assert_eq!(parse(&bytes, b"other"), Err(UnroundedError::OtherBlob));
        let cut = parse(&bytes[..bytes.len() - 4], b"blob");
        assert_eq!(cut, Err(UnroundedError::Seal(SealError::Damaged)));
        assert_eq!(
            path_beside(Path::new("a/m.bnkf")),
            Path::new("a/m.bnkf.f32")
        );
    }
}
