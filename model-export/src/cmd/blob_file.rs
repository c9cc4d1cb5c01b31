//! A blob file as a subcommand's argument.

use bnkf::blob::{Blob, BlobError};
use std::path::{Path, PathBuf};

/// Why a file is not a usable blob.
#[derive(Debug, thiserror::Error)]
pub enum BlobFileError {
    /// The file cannot be read.
    #[error("{}: cannot read: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        #[source]
        cause: std::io::Error,
    },
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
    let bytes = std::fs::read(path).map_err(|cause| BlobFileError::Read {
        path: path.to_owned(),
        cause,
    })?;
    match Blob::parse(&bytes) {
        Ok(_) => Ok(bytes),
        Err(cause) => Err(BlobFileError::Blob {
            path: path.to_owned(),
            cause,
        }),
    }
}
