//! `host-sim readings`: truth and readings of an evaluation, for filters that are not of this program.

use std::io::Write as _;
use std::path::PathBuf;

use bnkf_model_export::atomic_file::AtomicWriteError;
use bnkf_model_export::cmd::remarks;
use bnkf_model_export::pending_file::PendingFile;
use parquet::errors::ParquetError;
use rayon::prelude::*;

use super::evaluate::data::Data;
use super::evaluate::{self, EvaluateError, Subject};
use crate::cmd::progress;
use crate::csv_text::CsvText;
use crate::exchange::readings::{self, ReadingsFile, Sighting};
use crate::output_folder::{self, OutputFolderError};

/// Names of the two files.
pub const CSV: &str = "readings.csv";
/// The same rows.
pub const PARQUET: &str = "readings.parquet";

/// Flights whose rows stand in memory at a time.
const FLIGHTS_AT_ONCE: usize = 256;

/// Writes truth and readings of an evaluation: `readings.csv` and `readings.parquet`.
///
/// With the arguments of `evaluate` that choose flights, radar, runs and seed (add --folds or --quick for generated
/// flights) these are the very readings that its methods get, row for row: one for every sample of every flight
/// at every noise level and rate; empty where nothing was measured. Units stand in the columns' names; x
/// east, y north, z up. `score` takes estimates of them.
#[derive(Clone, Debug, clap::Args)]
#[group(id = "readings")]
pub struct Args {
    /// What is measured.
    #[command(flatten)]
    pub subject: Subject,
    /// Folder for the two files; made if it is missing
    #[arg(long, value_name = "DIR", default_value = "out/readings")]
    pub out: PathBuf,
}

/// Why no readings were written.
#[derive(Debug, thiserror::Error)]
pub enum ReadingsError {
    /// Flights or radar cannot be had.
    #[error(transparent)]
    Evaluation(#[from] EvaluateError),
    /// The folder cannot take results.
    #[error(transparent)]
    Folder(#[from] OutputFolderError),
    /// The rows make no Parquet file.
    #[error("{PARQUET}: {0}")]
    Parquet(#[from] ParquetError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] AtomicWriteError),
    /// Standard output was closed.
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
}

/// Runs the command.
///
/// # Errors
/// See [`ReadingsError`].
pub fn run(args: &Args) -> Result<(), ReadingsError> {
    let scenario = evaluate::scenario(&args.subject).map_err(EvaluateError::from)?;
    let inputs = args.subject.inputs().map_err(EvaluateError::from)?;
    output_folder::prepare(&args.out, &[PARQUET, CSV], &inputs)?;
    let data = Data::of(&args.subject, &scenario)?;
    remarks::say(&data.remarks, &data.unplaced);
    let conditions = scenario.radar.conditions();
    let bar = progress::bar(conditions.len(), "Measuring");
    let paths = [PARQUET, CSV].map(|name| args.out.join(name));
    let [mut parquet, mut csv] = [PendingFile::new(&paths[0])?, PendingFile::new(&paths[1])?];
    let mut file = ReadingsFile::new(&mut parquet)?;
    let (mut text, mut rows) = (CsvText::new(&readings::header()), 0);
    for condition in conditions {
        // A few flights at a time: as fields, all rows would take gigabytes.
        for flights in data.runs.flights.chunks(FLIGHTS_AT_ONCE) {
            let sighting = |flight| Sighting {
                flight,
                condition,
                readings: scenario
                    .radar
                    .readings(flight, condition, args.subject.seed),
            };
            let sightings: Vec<_> = flights.par_iter().map(sighting).collect();
            file.add(&sightings)?;
            for sighting in &sightings {
                rows += sighting.readings.len();
                text.add(readings::csv_rows(sighting));
            }
            let text = std::mem::replace(&mut text, CsvText::continued());
            csv.write_all(&text.finish())
                .map_err(|cause| AtomicWriteError {
                    path: paths[1].clone(),
                    cause,
                })?;
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    file.finish()?;
    parquet.finish()?;
    csv.finish()?;
    let said = |name: &str| format!("{}\n", args.out.join(name).display());
    let said = format!("{rows} rows\n{}{}", said(PARQUET), said(CSV));
    std::io::stdout().write_all(said.as_bytes())?;
    Ok(())
}
