//! The file beside a blob with the weights as they were before rounding; `verify` compares them.

use crate::blob::sealed::{self, SealError};
use crate::flights::data_hash;
use crate::posterior::architecture::Architecture;
use crate::posterior::gaussian_weights::GaussianWeights;
use bnkf::blob::Blob;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"BNKFf32w";

/// Longest file that is read, bytes: more than three networks of the largest shape need.
pub const BYTES_MAX: u64 = 1 << 22;

/// Why the file cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnroundedError {
    /// It is not a whole file of weights.
    #[error("not a file of unrounded weights: it {0}")]
    Seal(#[from] SealError),
    /// Its header or the amount of numbers is not what this version writes.
    #[error("written by another version")]
    OtherVersion,
    /// It holds other networks than the blob: more, fewer, or of another shape.
    #[error("holds networks {found}, the blob {blob}")]
    OtherNetworks {
        /// Widths in the file.
        found: String,
        /// Widths in the blob.
        blob: String,
    },
    /// A weight or its deviation is NaN or infinite.
    #[error("holds a number that is not finite")]
    NotFinite,
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

/// Checks that `networks` are those of `blob`, one for one and layer for layer: the file's seal is
/// no secret, so whoever can write it can seal anything. A deviation of zero is ln 0.
///
/// # Errors
/// [`UnroundedError::OtherNetworks`], [`UnroundedError::NotFinite`].
pub fn check_shape(networks: &[GaussianWeights], blob: &Blob<'_>) -> Result<(), UnroundedError> {
    let of_blob = blob.networks().map(|view| {
        let layers = (0..view.layers()).map(|index| view.layer(index));
        let inputs = view.layer(0).inputs;
        let outputs = layers.map(|layer| layer.outputs);
        std::iter::once(inputs)
            .chain(outputs)
            .collect::<Vec<usize>>()
    });
    let of_blob: Vec<Vec<usize>> = of_blob.collect();
    let own = networks
        .iter()
        .map(|weights| weights.architecture.clone().into());
    let own: Vec<Vec<usize>> = own.collect();
    if own != of_blob {
        return Err(UnroundedError::OtherNetworks {
            found: spelt(&own),
            blob: spelt(&of_blob),
        });
    }
    let finite = |weights: &GaussianWeights| {
        let sigmas = &weights.log_sigmas;
        weights.means.iter().all(|mean| mean.is_finite())
            && sigmas.iter().all(|sigma| *sigma < f32::INFINITY)
    };
    if networks.iter().all(finite) {
        Ok(())
    } else {
        Err(UnroundedError::NotFinite)
    }
}

fn spelt(networks: &[Vec<usize>]) -> String {
    let widths = |network: &Vec<usize>| {
        let widths: Vec<String> = network.iter().map(usize::to_string).collect();
        widths.join("-")
    };
    let networks: Vec<String> = networks.iter().map(widths).collect();
    networks.join(", ")
}

#[cfg(test)]
mod tests {
    use super::{UnroundedError, check_shape, parse, path_beside, to_bytes};
    use crate::blob::sealed::SealError;
    use crate::posterior::architecture::Architecture;
    use crate::posterior::gaussian_weights::GaussianWeights;
    use crate::random_source::RandomSource;
    use bnkf::blob::Blob;
    use std::path::Path;

    const BLOB: &[u8] = include_bytes!("../../../models/bnkf.bnkf");
    const WEIGHTS: &[u8] = include_bytes!("../../../models/bnkf.bnkf.f32");

    /// What `check_shape` says after `change` and a new seal.
    fn resealed(change: impl FnOnce(&mut Vec<GaussianWeights>)) -> Result<(), UnroundedError> {
        let mut networks = parse(WEIGHTS, BLOB).unwrap();
        change(&mut networks);
        let networks = parse(&to_bytes(BLOB, &networks), BLOB).unwrap();
        check_shape(&networks, &Blob::parse(BLOB).unwrap())
    }

    #[test]
    fn networks_that_the_blob_does_not_have_are_refused() {
        assert_eq!(resealed(|_| ()), Ok(()));
        let more = resealed(|networks| networks.push(networks[0].clone())).unwrap_err();
        let one = "13-64-64-64-64-64-3";
        assert_eq!(
            more.to_string(),
            format!("holds networks {one}, {one}, the blob {one}")
        );
        let none = resealed(Vec::clear).unwrap_err();
        assert!(matches!(none, UnroundedError::OtherNetworks { .. }));
        let other = resealed(|networks| {
            let architecture = Architecture::new(vec![13, 64, 64, 64, 64, 3]).unwrap();
            let mut random = RandomSource::new(1, &[]);
            networks[0] = GaussianWeights::random(&architecture, 0.1, &mut random);
        });
        assert!(matches!(other, Err(UnroundedError::OtherNetworks { .. })));
        for number in [f32::NAN, f32::INFINITY] {
            let mean = resealed(|networks| networks[0].means[7] = number);
            assert_eq!(mean, Err(UnroundedError::NotFinite));
            let sigma = resealed(|networks| networks[0].log_sigmas[7] = number);
            assert_eq!(sigma, Err(UnroundedError::NotFinite));
        }
    }

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
