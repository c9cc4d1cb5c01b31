//! `host-sim replicate`: the paper as written, as its code does it, and what lies between.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use bnkf_model_export::atomic_file::{self, AtomicWriteError};
use bnkf_model_export::cmd::flight_source::flight_count;
use bnkf_model_export::cmd::remarks;
use bnkf_model_export::command_line::command_line;
use bnkf_model_export::flights::csv::options::ReadOptions;
use bnkf_model_export::flights::data_hash;
use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::generator::{GeneratorError, GeneratorSettings, generate};
use bnkf_model_export::flights::segment::PAPER_SEGMENT_S;
use bnkf_model_export::flights::set::{FlightSet, FlightSetError, Preparation};
use bnkf_model_export::flights::volume::Volume;
use bnkf_model_export::regular_file::{self, ReadFileError};

use crate::cmd::progress;
use crate::output_folder::{self, OutputFolderError};
use crate::replication::entry::entries;
use crate::replication::page::{has_place, page};
use crate::replication::results::{Provenance, Results};
use crate::replication::study::{FOLDS, Study, StudyError};

/// Flights and epochs of a full and of a quick run.
const FLIGHTS: usize = 300;
const FLIGHTS_QUICK: usize = 60;
const EPOCHS: u32 = 30;
const EPOCHS_QUICK: u32 = 12;

/// Names of the files of figures.
const JSON: &str = "replication.json";
const CSV: &str = "replication.csv";

/// Longest page that is read again, bytes.
const PAGE_BYTES_MAX: u64 = 1 << 22;

/// Replicates the paper twice and measures every difference between text and code.
///
/// Trains BNN, BNKF and BNKFe as the paper describes them and as its published code makes them,
/// then BNKF with each difference switched by itself; beside them the paper's EKF and UKF, the
/// converted measurement, and the reading's direction at a constant range. Writes a page, a CSV
/// and a JSON file.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Folder of flight files (.csv or .txt: timestamp,tx,ty,tz), or one file [default: generated
    /// flights]
    #[arg(long, value_name = "PATH", conflicts_with = "builtin")]
    pub flights: Option<PathBuf>,
    /// Moves every segment at random (yaw, mirror, shift) into the paper's volume
    #[arg(long, requires = "flights")]
    pub place: bool,
    /// Length of the segments that flights are cut into, seconds; 0 keeps them whole
    #[arg(long, value_name = "S", default_value_t = PAPER_SEGMENT_S, requires = "flights")]
    pub segment_s: f64,
    /// Number of generated flights [default: 300, with --quick 60]
    #[arg(long, value_name = "N", value_parser = flight_count,
        conflicts_with_all = ["time_unit", "frame", "columns", "resample", "segment_s", "place"])]
    pub builtin: Option<usize>,
    /// Rough figures in a tenth of the time: fewer flights and epochs
    #[arg(long)]
    pub quick: bool,
    /// Training epochs of every network [default: 30, with --quick 12]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub epochs: Option<u32>,
    /// Monte Carlo passes per estimate
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u16).range(8..=10_000))]
    pub passes: u16,
    /// Seed of flights, placement, radar noise, training and Monte Carlo passes
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Folder for replication.json and replication.csv; made if it is missing
    #[arg(long, value_name = "DIR", default_value = "out/replication")]
    pub out: PathBuf,
    /// The page; what stands around the tables of an existing one is kept
    /// [default: replication.md in the folder]
    #[arg(long, value_name = "FILE")]
    pub page: Option<PathBuf>,
    /// How flight files are read.
    #[command(flatten)]
    pub reading: ReadOptions,
}

/// Why a replication failed.
#[derive(Debug, thiserror::Error)]
pub enum ReplicateError {
    /// No flights.
    #[error(transparent)]
    Flights(#[from] FlightSetError),
    /// Flights cannot be generated.
    #[error("generated flights: {0}")]
    Generator(#[from] GeneratorError),
    /// Training or scoring failed.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// A folder cannot take results.
    #[error(transparent)]
    Folder(#[from] OutputFolderError),
    /// The old page is not of this command.
    #[error(
        "{0}: a page without the lines that this command writes between; name another, or remove it"
    )]
    NoPlace(PathBuf),
    /// The old page cannot be read.
    #[error(transparent)]
    Page(#[from] ReadFileError),
    /// A result cannot be written.
    #[error(transparent)]
    Write(#[from] AtomicWriteError),
    /// Standard output was closed.
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
}

/// Flights of a run and where they came from.
struct Data {
    segments: Vec<Flight>,
    source: String,
    sha256: String,
    unplaced: Vec<String>,
}

/// Runs the command.
///
/// # Errors
/// See [`ReplicateError`].
pub fn run(args: &Args) -> Result<(), ReplicateError> {
    // Before the run, not after it: a place that cannot be written to, a page that cannot be read.
    let inputs = args.flights.as_deref().map(FlightSet::files).transpose()?;
    let inputs = inputs.unwrap_or_default();
    output_folder::prepare(&args.out, &[JSON, CSV], &inputs)?;
    let page_path = args
        .page
        .clone()
        .unwrap_or_else(|| args.out.join("replication.md"));
    match page_path.parent() {
        Some(parent) if parent != args.out && !parent.as_os_str().is_empty() => {
            std::fs::create_dir_all(parent).map_err(|cause| OutputFolderError::Folder {
                path: parent.to_owned(),
                cause,
            })?;
        }
        _ => {}
    }
    atomic_file::check(&[&page_path], &inputs)?;
    let existing = read_page(&page_path)?;
    if existing.as_deref().is_some_and(|page| !has_place(page)) {
        return Err(ReplicateError::NoPlace(page_path));
    }
    let data = flights(args)?;
    let mut recordings: Vec<&str> = data.segments.iter().map(|f| f.source.as_str()).collect();
    recordings.sort_unstable();
    recordings.dedup();
    let recordings = recordings.len();
    let entries = entries(recordings < data.segments.len());
    let study = Study {
        flights: data.segments,
        epochs: args
            .epochs
            .unwrap_or(if args.quick { EPOCHS_QUICK } else { EPOCHS }),
        passes: usize::from(args.passes),
        seed: args.seed,
    };
    let bar = progress::bar(study.units(&entries) as usize, "Replicating");
    let cells = study.run(&entries, &|units| bar.inc(units));
    bar.finish_and_clear();
    let provenance = Provenance {
        command: command_line("host-sim"),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        tree: env!("BNKF_TREE").to_owned(),
        seed: args.seed,
        data: data.source,
        data_sha256: data.sha256,
        flights: study.flights.len(),
        recordings,
        unplaced: data.unplaced.len(),
        folds: FOLDS,
        epochs: study.epochs,
        passes: study.passes,
        quick: args.quick,
    };
    let results = Results::new(provenance, &entries, cells?);
    let text =
        page(existing.as_deref(), &results).ok_or(ReplicateError::NoPlace(page_path.clone()))?;
    let files = [
        (args.out.join(JSON), results.json()),
        (args.out.join(CSV), results.csv()),
        (page_path, text.clone().into_bytes()),
    ];
    for (path, bytes) in &files {
        atomic_file::write(path, bytes)?;
    }
    // Only now: a closed pipe costs no results.
    let mut stdout = std::io::stdout();
    writeln!(stdout, "{text}")?;
    for (path, _) in &files {
        writeln!(stdout, "{}", path.display())?;
    }
    Ok(())
}

fn read_page(path: &Path) -> Result<Option<String>, ReplicateError> {
    match regular_file::read_text(path, PAGE_BYTES_MAX) {
        Ok(text) => Ok(Some(text)),
        Err(error) if error.is_missing() => Ok(None),
        Err(error) => Err(error.into()),
    }
}

fn flights(args: &Args) -> Result<Data, ReplicateError> {
    if let Some(path) = &args.flights {
        let preparation = Preparation {
            reading: args.reading.clone(),
            expected: Volume::PAPER,
            segment_s: args.segment_s,
            volume: args.place.then_some(Volume::PAPER),
            radar_m: [0.0; 3],
            seed: args.seed,
        };
        let set = FlightSet::read(path, &preparation)?;
        remarks::say(&set.remarks, &set.unplaced);
        return Ok(Data {
            segments: set.segments,
            source: path.display().to_string(),
            sha256: set.sha256,
            unplaced: set.unplaced,
        });
    }
    let count = if args.quick { FLIGHTS_QUICK } else { FLIGHTS };
    let settings = GeneratorSettings {
        flights: args.builtin.unwrap_or(count),
        seed: args.seed,
        ..GeneratorSettings::default()
    };
    let segments = generate(&settings)?;
    Ok(Data {
        source: format!("built-in generator, seed {}", args.seed),
        sha256: data_hash::of_flights(&segments),
        segments,
        unplaced: Vec::new(),
    })
}
