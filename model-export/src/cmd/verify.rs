//! `model-export verify`: what the rounding of a model costs.

use super::blob_file::{self, BlobFileError};
use super::flight_source::{FlightSource, FlightSourceError};
use super::verify_recursive::{self, RecursiveArgs, VerifyRecursiveError};
use crate::blob::quantise::{LayerError, layer_errors, quantise};
use crate::blob::unrounded::{self, UnroundedError};
use crate::memoryless::example::ExampleSettings;
use crate::memoryless::verification::{
    Comparison, SHIFT_MAX, SIGMA_ERROR_MAX, Summary, compare, measured_rows,
};
use crate::radar::noise::{NoiseLevel, NoiseTable};
use crate::regular_file::{self, ReadFileError};
use bnkf::blob::{Blob, Kind};
use std::io::Write as _;
use std::path::PathBuf;

/// Flights when none are named; no shipped model was trained on their seed.
const BUILTIN_FLIGHTS: usize = 20;
const BUILTIN_SEED: u64 = 424_242;

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
    recursive: RecursiveArgs,
    #[command(flatten)]
    source: FlightSource,
    /// How the angle figures of the noise levels are read: radians, or degrees as printed
    #[arg(long, value_enum, default_value_t = NoiseTable::Radians)]
    noise_table: NoiseTable,
    /// Measurements per noise level that are compared
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u16).range(1..))]
    rows: u16,
    /// Monte Carlo passes for each predictive standard deviation
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u16).range(2..=10_000))]
    passes: u16,
    /// Moments of the blob without passes: for its predictive standard deviation, or for the tracker of a
    /// recursive blob
    #[arg(long, conflicts_with = "tracker_passes")]
    moments: bool,
    /// Seed of placement and radar noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Why a model is not verified.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// The file is not a usable blob.
    #[error(transparent)]
    File(#[from] BlobFileError),
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

    let errors: Vec<LayerError> = networks
        .iter()
        .flat_map(|weights| layer_errors(weights, &quantise(weights)))
        .collect();
    let mut text = layer_table(&errors);
    let mut all = Vec::new();
    text += &format!(
        "\n{:<8}{:>8}{:>12}{:>12}{:>14}{:>18}\n",
        "noise", "values", "shift mean", "shift p95", "sigma ratio", "ratio p5 .. p95"
    );
    let settings = ExampleSettings {
        layout: blob.features(),
        table: args.noise_table,
        // Only the loss depends on it.
        range_spread_m: 1.0,
    };
    for level in NoiseLevel::ALL {
        let count = usize::from(args.rows);
        let rows = measured_rows(&blob, &flights.flights, level, &settings, count, args.seed);
        let pairs = blob.networks().zip(&networks);
        let found: Vec<Comparison> = pairs
            .flat_map(|(view, weights)| compare(view, weights, &rows, args.passes, args.moments))
            .collect();
        text += &summary_line(&level.to_string(), &found);
        all.extend(found);
    }
    text += &summary_line("all", &all);
    text += &format!(
        "\nshift: |estimate of the blob - estimate of the unrounded weights| at the mean weights, in predictive\n\
         sigmas; accepted up to {SHIFT_MAX} on average, and a mean sigma ratio within {SIGMA_ERROR_MAX} of 1 ({}, {} passes{})\n",
        flights.source,
        args.passes,
        if args.moments {
            ", the blob's sigma from moments"
        } else {
            ""
        }
    );
    std::io::stdout().write_all(text.as_bytes())?;
    if Summary::of(&all).is_some_and(|summary| summary.accepted()) {
        Ok(())
    } else {
        Err(VerifyError::Rejected(args.model.clone()))
    }
}

fn layer_table(errors: &[LayerError]) -> String {
    let mut text = format!(
        "{:>9}{:>16}{:>16}{:>17}{:>16}{:>10}\n",
        "layer", "mean rms/rms", "mean max/step", "mean rms/sigma", "ln sigma max", "vanished"
    );
    for error in errors {
        let shape = format!("{}x{}", error.outputs, error.inputs);
        text += &format!(
            "{shape:>9}{:>16.5}{:>16.3}{:>17.4}{:>16.4}{:>10}\n",
            error.mean_rms_relative,
            error.mean_max_steps,
            error.mean_rms_sigmas,
            error.ln_sigma_max,
            error.vanished
        );
    }
    text
}

fn summary_line(name: &str, comparisons: &[Comparison]) -> String {
    match Summary::of(comparisons) {
        None => format!("{name:<8}{:>8}\n", 0),
        Some(s) => format!(
            "{name:<8}{:>8}{:>12.4}{:>12.4}{:>14.4}{:>9.3} .. {:.3}\n",
            s.count,
            s.shift_mean,
            s.shift_p95,
            s.sigma_ratio_mean,
            s.sigma_ratio_p5,
            s.sigma_ratio_p95
        ),
    }
}
