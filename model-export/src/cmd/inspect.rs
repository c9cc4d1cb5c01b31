//! `model-export inspect`: what a blob holds.

use super::blob_file::{self, BlobFileError};
use crate::blob::description::describe;
use bnkf::blob::Blob;
use std::io::Write as _;
use std::path::PathBuf;

/// Prints header, units, normalisation, layers, sizes and sigmas of a blob.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The blob
    model: PathBuf,
}

/// Why nothing was printed.
#[derive(Debug, thiserror::Error)]
pub enum InspectError {
    /// The file is not a usable blob.
    #[error(transparent)]
    File(#[from] BlobFileError),
    /// Standard output was closed.
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
}

/// Runs the command.
///
/// # Errors
/// See [`InspectError`].
pub fn run(args: &Args) -> Result<(), InspectError> {
    let bytes = blob_file::read(&args.model)?;
    let blob = Blob::parse(&bytes).map_err(|cause| BlobFileError::Blob {
        path: args.model.clone(),
        cause,
    })?;
    std::io::stdout().write_all(describe(&bytes, &blob).as_bytes())?;
    Ok(())
}
