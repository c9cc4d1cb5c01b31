//! Files of `torch.save(model.state_dict())`: a zip archive of a pickle and of the tensors' bytes.

use super::archive::{Archive, ArchiveError};
use super::pickle::{self, PickleError};
use super::tensor::{Tensor, TensorError};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// How such files begin; those before version 1.6 of PyTorch, a pickle as a whole, do not.
pub const MAGIC: [u8; 4] = *b"PK\x03\x04";
const PICKLE: &str = "data.pkl";
/// Longest pickle that is read, bytes: a hundred times what the largest network has.
const PICKLE_BYTES_MAX: usize = 1 << 20;

/// Why a file is not read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TorchFileError {
    /// The archive.
    #[error(transparent)]
    Archive(#[from] ArchiveError),
    /// The pickle in it.
    #[error(transparent)]
    Pickle(#[from] PickleError),
    /// The pickle is longer than any.
    #[error("its pickle has more than {PICKLE_BYTES_MAX} bytes")]
    PickleBytes,
    /// Written by a machine with the other order of bytes.
    #[error("written on a big-endian machine")]
    BigEndian,
    /// One tensor.
    #[error("tensor {name:?} {cause}")]
    Tensor {
        /// Its name.
        name: String,
        /// What is wrong.
        #[source]
        cause: TensorError,
    },
}

/// The tensors in `bytes`, in the state dict's order.
///
/// # Errors
/// See [`TorchFileError`].
pub fn parse(bytes: &[u8]) -> Result<Vec<Tensor>, TorchFileError> {
    let archive = Archive::parse(bytes)?;
    // All lie in one folder, which is named after the file.
    let folder = archive.names().find_map(|name| {
        let folder = name.strip_suffix(PICKLE)?;
        (folder.is_empty() || folder.ends_with('/')).then_some(folder)
    });
    let folder = folder.ok_or_else(|| ArchiveError::Missing(PICKLE.to_owned()))?;
    let order = archive.read(&format!("{folder}byteorder"));
    if order.is_ok_and(|order| order.trim_ascii() != b"little") {
        return Err(TorchFileError::BigEndian);
    }
    let pickle = archive.read(&format!("{folder}{PICKLE}"))?;
    if pickle.len() > PICKLE_BYTES_MAX {
        return Err(TorchFileError::PickleBytes);
    }
    let records = pickle::state_dict(pickle)?;
    // Each is checked once, however many tensors lie in it.
    let mut storages = BTreeMap::new();
    for record in &records {
        if let Entry::Vacant(place) = storages.entry(record.storage) {
            place.insert(archive.read(&format!("{folder}data/{}", record.storage))?);
        }
    }
    let tensor = |record: pickle::TensorRecord<'_>| {
        let storage = storages.get(record.storage).copied().unwrap_or_default();
        let (shape, strides) = (&record.shape, &record.strides);
        let numbers = (record.format, storage);
        Tensor::gather(record.name, numbers, record.offset, shape, strides).map_err(|cause| {
            TorchFileError::Tensor {
                name: record.name.to_owned(),
                cause,
            }
        })
    };
    records.into_iter().map(tensor).collect()
}
