//! `model-export train`: trains an estimator and writes its blob.

use super::blob_file::BlobFileError;
use super::flight_source::{FlightSource, FlightSourceError};
use super::train_memoryless::{self, MemorylessArgs};
use super::train_recursive::{self, RecursiveArgs};
use crate::atomic_file::{self, AtomicWriteError};
use crate::blob::unrounded;
use crate::command_line::command_line_without;
use crate::flights::held_out::HeldOutError;
use crate::interrupt::Interrupt;
use crate::memoryless::checkpoint::CheckpointError;
use crate::memoryless::gradient::SHARDS;
use crate::memoryless::provenance;
use crate::memoryless::training::DivergedError;
use crate::memoryless::training_settings::{TrainingSettings, TrainingSettingsError};
use crate::recursive::training::{ResumeError, Training, TrainingError};
use crate::recursive::tunable::UntunableError;
use crate::regular_file::{self, ReadFileError};
use bnkf::TrackerError;
use bnkf::blob::BlobError;
use std::path::{Path, PathBuf};

/// Trains a Bayesian network on radar-sampled flights and writes it as a blob.
///
/// Every epoch samples all flights anew at three noise levels and three sampling rates, with fresh
/// noise. Ctrl-C writes a checkpoint beside the output; --resume continues it to the same bytes.
///
/// --kind recursive trains the tracker's motion model through the unrolled filter instead, from
/// built-in flights unless --flights is given.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// What is trained
    #[arg(long, value_enum, default_value_t = Kind::Memoryless)]
    kind: Kind,
    #[command(flatten)]
    source: FlightSource,
    /// The blob to write; OUT.json (provenance) and OUT.f32 (unrounded weights) go beside it
    #[arg(long, value_name = "OUT")]
    out: PathBuf,
    /// Continues from OUT.checkpoint; everything else as in the interrupted command
    #[arg(long)]
    resume: bool,
    /// Seed of initial weights, noise and order
    #[arg(long, default_value_t = TrainingSettings::default().seed)]
    seed: u64,
    /// Threads; their number does not change the result [default: all cores, at most 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..))]
    threads: Option<u8>,
    #[command(flatten)]
    memoryless: MemorylessArgs,
    #[command(flatten)]
    recursive: RecursiveArgs,
}

/// Longest checkpoint that is read, bytes: ten numbers for every weight of the largest networks are
/// a few megabytes.
const CHECKPOINT_BYTES_MAX: u64 = 1 << 26;

/// What a blob estimates with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Kind {
    /// A network from two measurements to a position: BNN, BNKF, BNKFe
    Memoryless,
    /// A network that schedules the motion model of a filter
    Recursive,
}

/// What every kind of training is told.
#[derive(Clone, Copy, Debug)]
pub struct Run<'a> {
    /// Flights, where the command names them.
    pub source: &'a FlightSource,
    /// The blob to write.
    pub out: &'a Path,
    /// The checkpoint.
    pub checkpoint: &'a Path,
    /// Whether to go on from the checkpoint.
    pub resume: bool,
    /// Seed of everything random.
    pub seed: u64,
    /// Asked between episodes.
    pub interrupt: &'a Interrupt,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The blob is written.
    Written,
    /// Interrupted; the checkpoint is written.
    Interrupted,
}

/// Why nothing was trained or written.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// No flights.
    #[error(transparent)]
    Source(#[from] FlightSourceError),
    /// Too few flights.
    #[error(transparent)]
    HeldOut(#[from] HeldOutError),
    /// An option makes no sense.
    #[error(transparent)]
    Settings(#[from] TrainingSettingsError),
    /// A checkpoint would be lost.
    #[error("{}: an interrupted run lies here; continue it with --resume or delete it", .0.display())]
    CheckpointExists(PathBuf),
    /// The checkpoint cannot be read.
    #[error(transparent)]
    Read(#[from] ReadFileError),
    /// The checkpoint does not belong to this run.
    #[error("{}: {cause}", path.display())]
    Checkpoint {
        /// The checkpoint.
        path: PathBuf,
        /// What is wrong.
        #[source]
        cause: CheckpointError,
    },
    /// Training failed.
    #[error(transparent)]
    Diverged(#[from] DivergedError),
    /// An option that means nothing to the kind.
    #[error("{0} does not apply to --kind {1}")]
    OtherKind(&'static str, &'static str),
    /// The recursive training cannot start.
    #[error(transparent)]
    Recursive(#[from] TrainingError),
    /// The recursive checkpoint does not belong to this run.
    #[error("{}: {cause}", path.display())]
    RecursiveCheckpoint {
        /// The checkpoint.
        path: PathBuf,
        /// What is wrong.
        #[source]
        cause: ResumeError,
    },
    /// The model to tune is no usable blob.
    #[error(transparent)]
    Model(#[from] BlobFileError),
    /// The model to tune cannot be.
    #[error("{}: {cause}", path.display())]
    Untunable {
        /// The blob.
        path: PathBuf,
        /// What is wrong.
        #[source]
        cause: UntunableError,
    },
    /// No flight is long enough.
    #[error("no flight lasts {0} s, which is the least to learn from")]
    TooShort(f64),
    /// The tracker refuses the trained model.
    #[error("the trained model: {0}")]
    Tracker(TrackerError),
    /// No blob can hold what the flights' statistics are; found before the first epoch.
    #[error("these flights are too few or too alike for a model, which no blob would hold: {0}")]
    Statistics(BlobError),
    /// The weights fit into no blob.
    #[error("the trained weights fit into no blob: {0}")]
    Blob(#[from] BlobError),
    /// A file cannot be written; as far as that can be known, found before the run.
    #[error(transparent)]
    Write(#[from] AtomicWriteError),
    /// The finished run's checkpoint cannot be removed.
    #[error("{}: cannot remove: {cause}", path.display())]
    Remove {
        /// The checkpoint.
        path: PathBuf,
        /// What the system said.
        #[source]
        cause: std::io::Error,
    },
    /// Threads or the handler of Ctrl-C cannot be had.
    #[error("{0}")]
    System(String),
    /// Standard output was closed.
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
}

/// Where an interrupted run that makes `out` lies.
fn checkpoint_path(out: &Path) -> PathBuf {
    let mut path = out.as_os_str().to_owned();
    path.push(".checkpoint");
    path.into()
}

impl Run<'_> {
    /// The command that makes what the run makes: a resumed run ends with the same bytes as the whole one.
    pub fn command(&self) -> String {
        command_line_without("model-export", &["--resume"], &[])
    }

    /// The checkpoint to go on from; `None` for a run from the start.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn interrupted(&self) -> Result<Option<Vec<u8>>, ReadFileError> {
        if self.resume {
            regular_file::read(self.checkpoint, CHECKPOINT_BYTES_MAX).map(Some)
        } else {
            Ok(None)
        }
    }

    /// A recursive training where its checkpoint left it, if there is one.
    ///
    /// # Errors
    /// The checkpoint does not fit the run.
    pub fn resumed<'f>(
        &self,
        training: Training<'f>,
        checkpoint: Option<Vec<u8>>,
    ) -> Result<Training<'f>, TrainError> {
        let Some(bytes) = checkpoint else {
            return Ok(training);
        };
        let resumed = training.resumed(&bytes);
        resumed.map_err(|cause| TrainError::RecursiveCheckpoint {
            path: self.checkpoint.to_owned(),
            cause,
        })
    }

    /// Removes the checkpoint of a finished run.
    ///
    /// # Errors
    /// It cannot be removed.
    pub fn forget_checkpoint(&self) -> Result<(), TrainError> {
        if self.checkpoint.exists() {
            let path = self.checkpoint.to_owned();
            std::fs::remove_file(&path).map_err(|cause| TrainError::Remove { path, cause })?;
        }
        Ok(())
    }
}

/// Runs the command.
///
/// # Errors
/// See [`TrainError`].
pub fn run(args: &Args) -> Result<Outcome, TrainError> {
    let mut inputs = args.source.files()?;
    inputs.extend(args.recursive.inputs());
    check_paths(&args.out, args.resume, &inputs)?;
    let asked = Asked {
        source: &args.source,
        out: &args.out,
        resume: args.resume,
        seed: args.seed,
        threads: args.threads,
    };
    asked.run(|run| match args.kind {
        Kind::Memoryless => match args.recursive.first_given() {
            Some(option) => Err(TrainError::OtherKind(option, "memoryless")),
            None => train_memoryless::train(run, &args.memoryless),
        },
        Kind::Recursive => match args.memoryless.first_given() {
            Some(option) => Err(TrainError::OtherKind(option, "recursive")),
            None => train_recursive::train(run, &args.recursive),
        },
    })
}

/// What every training is asked for.
pub struct Asked<'a> {
    /// The flights to learn from.
    pub source: &'a FlightSource,
    /// The blob to write.
    pub out: &'a Path,
    /// Goes on from the checkpoint beside it.
    pub resume: bool,
    /// Seed of everything random.
    pub seed: u64,
    /// Threads; all cores, at most as many as there are shards, by default.
    pub threads: Option<u8>,
}

impl Asked<'_> {
    /// Trains on these threads, and stops where it is interrupted.
    ///
    /// # Errors
    /// The system gives no threads or no signals; what `train` says.
    pub fn run(
        &self,
        train: impl FnOnce(&Run<'_>) -> Result<Outcome, TrainError> + Send,
    ) -> Result<Outcome, TrainError> {
        let system = |error: &dyn std::fmt::Display| TrainError::System(error.to_string());
        let pool = threads(self.threads).map_err(|error| system(&error))?;
        let interrupt = Interrupt::catch().map_err(|error| system(&error))?;
        let run = Run {
            source: self.source,
            out: self.out,
            checkpoint: &checkpoint_path(self.out),
            resume: self.resume,
            seed: self.seed,
            interrupt: &interrupt,
        };
        pool.install(|| train(&run))
    }
}

/// As many threads as asked for, or as there are cores, up to two.
///
/// # Errors
/// The system gives none.
fn threads(asked: Option<u8>) -> Result<rayon::ThreadPool, rayon::ThreadPoolBuildError> {
    let default = || std::thread::available_parallelism().map_or(1, usize::from);
    let threads = asked.map_or_else(|| default().min(SHARDS), usize::from);
    rayon::ThreadPoolBuilder::new().num_threads(threads).build()
}

/// Finds out before the work whether its results can be written, and neither an interrupted run nor one of `inputs`
/// is lost.
///
/// # Errors
/// See [`TrainError`].
pub fn check_paths(out: &Path, resume: bool, inputs: &[PathBuf]) -> Result<(), TrainError> {
    let checkpoint = checkpoint_path(out);
    let [beside, unrounded] = [provenance::path_beside(out), unrounded::path_beside(out)];
    atomic_file::check(&[out, &beside, &unrounded, &checkpoint], inputs)?;
    if !resume && checkpoint.exists() {
        return Err(TrainError::CheckpointExists(checkpoint));
    }
    Ok(())
}
