//! `model-export stress`: blobs against flights and faults that they must survive, and against
//! attack.

use super::blob_file::{self, BlobFileError};
use crate::attack::attack;
use crate::recursive::stress::{campaign, table};
use bnkf::blob::{Blob, Kind};
use bnkf::{Inference, PassesError, TrackerError};
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Runs the firmware's tracker through zenith passes, speeds up to 30 m/s, five-second gaps,
/// outliers, mis-stated sigmas and from a radar that drives; or, with --hostile, attacks it with any input at all.
///
/// Fails if an estimate is not finite, a covariance not positive definite, a step of a flight refused,
/// or under attack a mode or a time not what happened. Restarts are counted by their cause. The attack
/// takes every kind of blob; scripts of calls are drawn at random, and changed towards covariances
/// that are nearly singular.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The blobs; without --hostile recursive ones
    #[arg(required = true, value_name = "MODEL")]
    models: Vec<PathBuf>,
    /// Attack each blob with this many calls instead of flying
    #[arg(long, value_name = "CALLS", value_parser = clap::value_parser!(u64).range(1..=10_000_000_000),
        conflicts_with_all = ["flights", "passes", "moments"])]
    hostile: Option<u64>,
    /// Flights of each of the six kinds
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    flights: u32,
    /// Monte Carlo passes; 1 takes every weight at its mean
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=100))]
    passes: u16,
    /// The network's moments instead of passes
    #[arg(long, conflicts_with = "passes")]
    moments: bool,
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
    /// No such number of passes.
    #[error("{0}")]
    Passes(#[from] PassesError),
    /// The blob's own settings do not fit it.
    #[error("{}: {cause}", path.display())]
    Settings {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        cause: TrackerError,
    },
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
    for model in &args.models {
        let bytes = blob_file::read(model)?;
        let blob = Blob::parse(&bytes).map_err(|cause| BlobFileError::Blob {
            path: model.clone(),
            cause,
        })?;
        match args.hostile {
            Some(calls) => hostile(model, blob, calls, args.seed)?,
            None => fly(model, blob, args)?,
        }
    }
    Ok(())
}

fn fly(model: &Path, blob: Blob<'_>, args: &Args) -> Result<(), StressError> {
    if blob.kind() != Kind::Recursive {
        return Err(StressError::Kind(model.to_path_buf()));
    }
    let inference = if args.moments {
        Inference::Moments
    } else {
        Inference::of_passes(args.passes)?
    };
    let found = campaign(blob, inference, args.flights as usize, args.seed);
    std::io::stdout().write_all(table(&found).as_bytes())?;
    let failed: Vec<&str> = found
        .iter()
        .filter(|(_, tally)| !tally.passed())
        .map(|(hardship, _)| hardship.name())
        .collect();
    if failed.is_empty() {
        Ok(())
    } else {
        Err(StressError::Failed(model.to_path_buf(), failed.join(", ")))
    }
}

fn hostile(model: &Path, blob: Blob<'_>, calls: u64, seed: u64) -> Result<(), StressError> {
    let found = attack(blob, calls, seed).map_err(|cause| StressError::Settings {
        path: model.to_path_buf(),
        cause,
    })?;
    writeln!(
        std::io::stdout(),
        "{}: {} calls, {} refused, {} estimates: {} not finite, {} not positive definite, {} untrue; \
         {} outside, {} rejected, {} restarted, worst pivot {:.1e}",
        model.display(),
        found.calls,
        found.refused,
        found.estimates,
        found.not_finite,
        found.not_definite,
        found.untrue,
        found.outside,
        found.rejected,
        found.restarted,
        found.worst_pivot,
    )?;
    if found.passed() {
        Ok(())
    } else {
        Err(StressError::Failed(
            model.to_path_buf(),
            "attack".to_owned(),
        ))
    }
}
