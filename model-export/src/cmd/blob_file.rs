//! A blob file as a subcommand's argument.

use crate::regular_file::{self, ReadFileError};
use bnkf::blob::{Blob, BlobError, field};
use std::path::{Path, PathBuf};

/// Longest blob file that is read, bytes.
pub const BLOB_BYTES_MAX: u64 = 1 << 20;

// The format allows less: three networks of eight layers of 64 by 64.
const _: () = assert!(
    field::NETWORKS_MAX
        * (field::NETWORK_ENTRY_LEN
            + field::LAYERS_MAX
                * (field::LAYER_ENTRY_LEN + field::layer_len(field::WIDTH_MAX, field::WIDTH_MAX)))
        < BLOB_BYTES_MAX as usize / 2
);

/// Why a file is not a usable blob.
#[derive(Debug, thiserror::Error)]
pub enum BlobFileError {
    /// The file cannot be read, is none, or is larger than any blob.
    #[error(transparent)]
    Read(#[from] ReadFileError),
    /// Its bytes are not a blob.
    #[error("{}: {cause}", path.display())]
    Blob {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        cause: BlobError,
    },
}

/// The bytes of the blob at `path`, which parse.
///
/// # Errors
/// See [`BlobFileError`].
pub fn read(path: &Path) -> Result<Vec<u8>, BlobFileError> {
    let bytes = regular_file::read(path, BLOB_BYTES_MAX)?;
    match Blob::parse(&bytes) {
        Ok(_) => Ok(bytes),
        Err(cause) => Err(BlobFileError::Blob {
            path: path.to_owned(),
            cause,
        }),
    }
}
