//! `host-sim doubt`: whether doubt about the weights helps where motion is unfamiliar.

use std::io::Write as _;
use std::path::PathBuf;

use bnkf_model_export::atomic_file::{self, AtomicWriteError};
use bnkf_model_export::cmd::remarks;
use bnkf_model_export::command_line::command_line;
use bnkf_model_export::flights::csv::options::ReadOptions;
use bnkf_model_export::flights::generator::GeneratorError;
use bnkf_model_export::flights::segment::PAPER_SEGMENT_S;
use bnkf_model_export::flights::set::{FlightSet, FlightSetError, Preparation};
use bnkf_model_export::flights::volume::Volume;
use bnkf_model_export::recursive::committee::{Committee, CommitteeError};

use crate::cmd::progress;
use crate::contest::model::{Model, ModelError};
use crate::doubt::entry::Entry;
use crate::doubt::table::{csv, markdown};
use crate::doubt::world::World;
use crate::doubt::{Candidate, Row, study};
use crate::output_folder::{self, OutputFolderError};

/// Names of the two files.
const PAGE: &str = "doubt.md";
const CSV: &str = "doubt.csv";

/// Compares ways of being in doubt about a recursive network's weights, on familiar and on
/// unfamiliar motion.
///
/// An entry is a blob with mean weights, a blob with sampled passes or with moments (`@moments`), or several blobs that share one
/// filter. Opinions that differ about the mean jerk raise the process noise. Gains are paired by
/// flight against the first entry, with 95% intervals; low, medium and high noise, all sampling
/// rates together.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// A way of being in doubt; the first is what the others are compared with
    #[arg(
        long = "entry",
        value_name = "NAME=BLOB[+BLOB...][@PASSES]",
        required = true
    )]
    entries: Vec<Entry>,
    /// Recorded flights, moved into the paper's volume, as one more world
    #[arg(long, value_name = "PATH")]
    flights: Option<PathBuf>,
    /// Flights of each built-in world
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u16).range(2..=2000))]
    count: u16,
    /// Seed of placement, radar noise and sampled weights
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Also writes doubt.md and doubt.csv into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    reading: ReadOptions,
}

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum DoubtError {
    /// A blob cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The blobs of an entry do not go together.
    #[error("--entry {entry}: {cause}")]
    Committee {
        /// Its name.
        entry: String,
        /// Why.
        cause: CommitteeError,
    },
    /// The recorded flights cannot be read.
    #[error(transparent)]
    Flights(#[from] FlightSetError),
    /// Built-in flights cannot be generated.
    #[error(transparent)]
    Generator(#[from] GeneratorError),
    /// The folder cannot take results.
    #[error(transparent)]
    Folder(#[from] OutputFolderError),
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
/// See [`DoubtError`].
pub fn run(args: &Args) -> Result<(), DoubtError> {
    // Before the run, not after it.
    if let Some(path) = &args.out {
        let mut inputs: Vec<_> = args.entries.iter().flat_map(Entry::paths).collect();
        if let Some(flights) = &args.flights {
            inputs.extend(FlightSet::files(flights)?);
        }
        output_folder::prepare(path, &[PAGE, CSV], &inputs)?;
    }
    let models = args.entries.iter().map(Entry::models);
    let models: Vec<Vec<Model>> = models.collect::<Result<_, _>>()?;
    let mut candidates = Vec::new();
    for (entry, models) in args.entries.iter().zip(&models) {
        let blobs: Vec<_> = models.iter().map(Model::blob).collect();
        let committee = Committee::new(&blobs, entry.inference);
        candidates.push(Candidate {
            name: &entry.name,
            committee: committee.map_err(|cause| DoubtError::Committee {
                entry: entry.name.clone(),
                cause,
            })?,
        });
    }
    let mut worlds = World::built_in(usize::from(args.count))?;
    if let Some(path) = &args.flights {
        let preparation = Preparation {
            reading: args.reading.clone(),
            segment_s: PAPER_SEGMENT_S,
            volume: Some(Volume::PAPER),
            expected: Volume::PAPER,
            radar_m: [0.0; 3],
            seed: args.seed,
        };
        let set = FlightSet::read(path, &preparation)?;
        remarks::say(&set.remarks, &set.unplaced);
        worlds.push(World {
            name: "recorded".to_owned(),
            flights: set.segments,
        });
    }
    let bar = progress::bar(3 * worlds.len() * candidates.len(), "Following");
    let mut rows: Vec<Row> = Vec::new();
    for world in &worlds {
        let told = || bar.inc(1);
        rows.extend(study(
            &world.name,
            &world.flights,
            &candidates,
            args.seed,
            &told,
        ));
    }
    bar.finish_and_clear();
    let table = markdown(&rows);
    if let Some(folder) = &args.out {
        let page = format!("    {}\n{table}", command_line("host-sim"));
        for (name, bytes) in [(PAGE, page.into_bytes()), (CSV, csv(&rows))] {
            atomic_file::write(&folder.join(name), &bytes)?;
        }
    }
    // Only now: a closed pipe costs no results.
    std::io::stdout().write_all(table.as_bytes())?;
    Ok(())
}
