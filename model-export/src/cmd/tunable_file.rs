//! The files of a model that training goes on from, as a subcommand's argument.

use super::blob_file;
use super::train::TrainError;
use crate::blob::unrounded;
use crate::recursive::tunable::{Tunable, tunable};
use crate::regular_file;
use std::path::{Path, PathBuf};

/// The files that [`read`] reads.
pub fn paths(path: &Path) -> [PathBuf; 2] {
    [path.to_owned(), unrounded::path_beside(path)]
}

/// Reads a blob and the unrounded weights beside it.
///
/// # Errors
/// One of them cannot be read, or training cannot go on from them.
pub fn read(path: &Path) -> Result<Tunable, TrainError> {
    let bytes = blob_file::read(path)?;
    let beside = regular_file::read(&unrounded::path_beside(path), unrounded::BYTES_MAX)?;
    tunable(&bytes, &beside).map_err(|cause| TrainError::Untunable {
        path: path.to_owned(),
        cause,
    })
}
