//! `model-export verify`: what the rounding of a model costs.

use super::blob_file::{self, BlobFileError};
use super::flight_source::{FlightSource, FlightSourceError};
use super::rounding::{BUILTIN_FLIGHTS, BUILTIN_SEED, Rounding, Way, layer_table};
use super::verify_recursive::{self, RecursiveArgs, VerifyRecursiveError};
use crate::blob::unrounded::{self, UnroundedError};
use crate::memoryless::verification::{SHIFT_MAX, SIGMA_ERROR_MAX};
use crate::radar::noise::NoiseTable;
use crate::regular_file::{self, ReadFileError};
use bnkf::blob::{Blob, Kind};
use std::io::Write as _;
use std::path::PathBuf;

/// Compares a blob, run by the firmware's code, with the unrounded weights beside it.
///
/// Prints the rounding errors of every layer, and how far they move the estimate and its predictive
/// standard deviation. Fails if the mean shift passes 5 % of the predictive standard deviation, or
/// if that is wrong by more than 10 % on average.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The blob; MODEL.f32 must lie beside it
    model: PathBuf,
    #[command(flatten)]
    source: FlightSource,
    /// Moments of the blob without passes: for its predictive standard deviation, or for the tracker of a
    /// recursive blob
    #[arg(long, conflicts_with = "tracker_passes")]
    moments: bool,
    /// Seed of placement and radar noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    memoryless: MemorylessArgs,
    #[command(flatten)]
    recursive: RecursiveArgs,
}

/// Measurements per noise level by default.
const ROWS: u16 = 100;
/// Passes by default.
const PASSES: u16 = 1000;

/// Options that only a memoryless blob has.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Options for a memoryless blob")]
struct MemorylessArgs {
    /// How the angle figures of the noise levels are read: radians, or degrees as printed
    #[arg(long, value_enum, default_value_t = NoiseTable::Radians)]
    noise_table: NoiseTable,
    /// Measurements per noise level that are compared
    #[arg(long, value_name = "N", default_value_t = ROWS, value_parser = clap::value_parser!(u16).range(1..))]
    rows: u16,
    /// Monte Carlo passes for each predictive standard deviation
    #[arg(long, value_name = "N", default_value_t = PASSES, value_parser = clap::value_parser!(u16).range(2..=10_000))]
    passes: u16,
}

impl MemorylessArgs {
    /// The first option that is not at its default: a recursive blob has none of them.
    fn first_given(&self) -> Option<&'static str> {
        [
            ("--noise-table", self.noise_table != NoiseTable::Radians),
            ("--rows", self.rows != ROWS),
            ("--passes", self.passes != PASSES),
        ]
        .into_iter()
        .find_map(|(option, given)| given.then_some(option))
    }
}

/// Why a model is not verified.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// The file is not a usable blob.
    #[error(transparent)]
    File(#[from] BlobFileError),
    /// An option that means nothing to the kind of blob.
    #[error("{0} does not apply to a {1} blob")]
    OtherKind(&'static str, &'static str),
    /// A recursive blob is not verified.
    #[error("{}: {cause}", path.display())]
    Recursive {
        /// The blob.
        path: PathBuf,
        /// Why.
        #[source]
        cause: VerifyRecursiveError,
    },
    /// The unrounded weights cannot be read.
    #[error(transparent)]
    Read(#[from] ReadFileError),
    /// The unrounded weights cannot be used.
    #[error("{}: {cause}", path.display())]
    Unrounded {
        /// Their file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        cause: UnroundedError,
    },
    /// No flights.
    #[error(transparent)]
    Source(#[from] FlightSourceError),
    /// The rounding moves the estimates too far.
    #[error("{}: rounding moves the estimates further than {:.0} % of sigma, or sigma by more than {:.0} %", .0.display(), 100.0 * SHIFT_MAX, 100.0 * SIGMA_ERROR_MAX)]
    Rejected(PathBuf),
    /// Standard output was closed.
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
}

/// Runs the command.
///
/// # Errors
/// See [`VerifyError`].
pub fn run(args: &Args) -> Result<(), VerifyError> {
    let bytes = blob_file::read(&args.model)?;
    let blob = Blob::parse(&bytes).map_err(|cause| BlobFileError::Blob {
        path: args.model.clone(),
        cause,
    })?;
    let (other, kind) = match blob.kind() {
        Kind::Memoryless => (args.recursive.first_given(), "memoryless"),
        Kind::Recursive => (args.memoryless.first_given(), "recursive"),
    };
    if let Some(option) = other {
        return Err(VerifyError::OtherKind(option, kind));
    }
    let path = unrounded::path_beside(&args.model);
    let weights = regular_file::read(&path, unrounded::BYTES_MAX)?;
    let networks = unrounded::parse(&weights, &bytes)
        .and_then(|networks| unrounded::check_shape(&networks, &blob).map(|()| networks))
        .map_err(|cause| VerifyError::Unrounded { path, cause })?;
    if let (Kind::Recursive, [weights]) = (blob.kind(), &networks[..]) {
        let verified = verify_recursive::verify(
            blob,
            weights,
            &args.source,
            &args.recursive,
            args.moments,
            args.seed,
        );
        return verified.map_err(|cause| VerifyError::Recursive {
            path: args.model.clone(),
            cause,
        });
    }
    let flights = args
        .source
        .load_or_builtin(BUILTIN_FLIGHTS, BUILTIN_SEED, args.seed)?;

    let way = Way {
        noise_table: args.memoryless.noise_table,
        rows: args.memoryless.rows,
        passes: args.memoryless.passes,
        moments: args.moments,
        seed: args.seed,
    };
    let rounding = Rounding::of(&blob, &networks, &flights, &way);
    let text = layer_table(&networks) + &rounding.table;
    std::io::stdout().write_all(text.as_bytes())?;
    if rounding.is_accepted {
        Ok(())
    } else {
        Err(VerifyError::Rejected(args.model.clone()))
    }
}
