//! `model-export stress`: a recursive blob against flights and faults that it must survive.

use super::blob_file::{self, BlobFileError};
use crate::recursive::stress::{campaign, table};
use bnkf::blob::{Blob, Kind};
use std::io::Write as _;
use std::path::PathBuf;

/// Runs the firmware's tracker through zenith passes, speeds up to 30 m/s, five-second gaps,
/// outliers and mis-stated sigmas.
///
/// Fails if an estimate is not finite, a covariance not positive definite or a step refused.
/// Restarts are counted by their cause.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The recursive blob
    model: PathBuf,
    /// Flights of each of the five kinds
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    flights: u32,
    /// Monte Carlo passes; 1 takes every weight at its mean
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=100))]
    passes: u16,
    /// Seed of flights and noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Why a model did not survive.
#[derive(Debug, thiserror::Error)]
pub enum StressError {
    /// The file is not a usable blob.
    #[error(transparent)]
    File(#[from] BlobFileError),
    /// Another kind of blob.
    #[error("{}: not a recursive model", .0.display())]
    Kind(PathBuf),
    /// Something happened that must not.
    #[error("{}: failed under: {}", .0.display(), .1)]
    Failed(PathBuf, String),
    /// Standard output was closed.
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
}

/// Runs the command.
///
/// # Errors
/// See [`StressError`].
pub fn run(args: &Args) -> Result<(), StressError> {
    let bytes = blob_file::read(&args.model)?;
    let blob = Blob::parse(&bytes).map_err(|cause| BlobFileError::Blob {
        path: args.model.clone(),
        cause,
    })?;
    if blob.kind() != Kind::Recursive {
        return Err(StressError::Kind(args.model.clone()));
    }
    let found = campaign(blob, args.passes, args.flights as usize, args.seed);
    std::io::stdout().write_all(table(&found).as_bytes())?;
    let failed: Vec<&str> = found
        .iter()
        .filter(|(_, tally)| !tally.passed())
        .map(|(hardship, _)| hardship.name())
        .collect();
    if failed.is_empty() {
        Ok(())
    } else {
        Err(StressError::Failed(args.model.clone(), failed.join(", ")))
    }
}
