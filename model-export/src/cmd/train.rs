//! `model-export train`: trains a memoryless estimator and writes its blob.

use super::flight_source::{FlightSource, FlightSourceError};
use super::train_recursive::{self, RecursiveArgs, Run};
use crate::atomic_file::{self, AtomicWriteError};
use crate::checkpoint::{self, CheckpointError};
use crate::command_line::command_line;
use crate::data_hash;
use crate::gradient::SHARDS;
use crate::held_out::HeldOutError;
use crate::interrupt::Interrupt;
use crate::kernel::Tier;
use crate::memoryless_model::MemorylessModel;
use crate::provenance::{self, Provenance};
use crate::quantise::{layer_errors, quantise};
use crate::recursive::training::{ResumeError, TrainingError};
use crate::training::{Control, DivergedError, End, Event, State, Training};
use crate::training_data::TrainingData;
use crate::training_progress::TrainingProgress;
use crate::training_settings::{
    Divergence, ErrorScale, Features, TrainingSettings, TrainingSettingsError,
};
use crate::unrounded;
use bnkf::TrackerError;
use bnkf::blob::BlobError;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time between two checkpoints.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(10);
/// With fewer recordings than this the held-out loss says little.
const SOURCES_FEW: usize = 10;

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
    recursive: RecursiveArgs,
    #[command(flatten)]
    source: FlightSource,
    /// The blob to write; OUT.json (provenance) and OUT.f32 (unrounded weights) go beside it
    #[arg(long, value_name = "OUT")]
    out: PathBuf,
    /// Continues from OUT.checkpoint; everything else as in the interrupted command
    #[arg(long)]
    resume: bool,
    /// Three networks, one for each axis (BNKFe), instead of one (BNKF)
    #[arg(long)]
    ensemble: bool,
    /// Widths of the hidden layers [default: 64,64,64,64,64, with --ensemble 32,32,32,32,32]
    #[arg(long, value_name = "WIDTHS", value_delimiter = ',')]
    hidden: Option<Vec<usize>>,
    /// Features of the network
    #[arg(long, value_enum, default_value_t = Features::Polar13)]
    features: Features,
    /// How the angle figures of the noise levels are read: radians, or degrees as printed
    #[arg(long, value_enum, default_value_t = TrainingSettings::default().noise_table)]
    noise_table: crate::noise::NoiseTable,
    /// What squared errors are measured in
    #[arg(long, value_enum, default_value_t = TrainingSettings::default().error_scale)]
    error_scale: ErrorScale,
    /// How the divergence from the prior enters the loss
    #[arg(long, value_enum, default_value_t = TrainingSettings::default().divergence)]
    kl: Divergence,
    /// Factor on the divergence
    #[arg(long, value_name = "FACTOR", default_value_t = TrainingSettings::default().kl_weight)]
    kl_weight: f64,
    /// Standard deviation of the prior of every weight (the paper: 0.01)
    #[arg(long, value_name = "SIGMA", default_value_t = TrainingSettings::default().prior_sigma)]
    prior_sigma: f64,
    /// Initial standard deviation of every weight
    #[arg(long, value_name = "SIGMA", default_value_t = TrainingSettings::default().initial_sigma)]
    initial_sigma: f64,
    /// Epochs; the learning rate reaches zero after the last
    #[arg(long, value_name = "N", default_value_t = TrainingSettings::default().epochs)]
    epochs: u32,
    /// Stops after this many epochs without a better held-out loss
    #[arg(long, value_name = "N", default_value_t = TrainingSettings::default().patience)]
    patience: u32,
    /// Rows of a minibatch
    #[arg(long, value_name = "ROWS", default_value_t = TrainingSettings::default().batch)]
    batch: usize,
    /// Learning rate at the start
    #[arg(long, value_name = "RATE", default_value_t = TrainingSettings::default().rate)]
    rate: f64,
    /// Epochs after these with the weight means on the int8 grid; 0 rounds at the end only
    #[arg(long, value_name = "N", default_value_t = TrainingSettings::default().grid_epochs)]
    grid_epochs: u32,
    /// Learning rate at their start
    #[arg(long, value_name = "RATE", default_value_t = TrainingSettings::default().grid_rate)]
    grid_rate: f64,
    /// Part of the recordings that is held out
    #[arg(long, value_name = "PART", default_value_t = TrainingSettings::default().held_out)]
    held_out: f64,
    /// Seed of initial weights, noise and order
    #[arg(long, default_value_t = TrainingSettings::default().seed)]
    seed: u64,
    /// Threads; their number does not change the result [default: all cores, at most 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..))]
    threads: Option<u8>,
}

/// What a blob estimates with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Kind {
    /// A network from two measurements to a position: BNN, BNKF, BNKFe
    Memoryless,
    /// A network that schedules the motion model of a filter
    Recursive,
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
    /// The folder of the output is missing. Found before the run, not after it.
    #[error("{}: its folder does not exist", .0.display())]
    NoFolder(PathBuf),
    /// A checkpoint would be lost.
    #[error("{}: an interrupted run lies here; continue it with --resume or delete it", .0.display())]
    CheckpointExists(PathBuf),
    /// The checkpoint cannot be read.
    #[error("{}: cannot read: {cause}", path.display())]
    Read {
        /// The checkpoint.
        path: PathBuf,
        /// What the system said.
        #[source]
        cause: std::io::Error,
    },
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
    /// An option that means nothing to the recursive kind.
    #[error("{0} does not apply to --kind recursive")]
    NotRecursive(&'static str),
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
    /// The tracker refuses the trained model.
    #[error("the trained model: {0}")]
    Passes(TrackerError),
    /// The weights fit into no blob.
    #[error("the trained weights fit into no blob: {0}")]
    Blob(#[from] BlobError),
    /// A file cannot be written.
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

impl Args {
    fn settings(&self) -> Result<TrainingSettings, TrainingSettingsError> {
        let width = if self.ensemble { 32 } else { 64 };
        let settings = TrainingSettings {
            features: self.features,
            ensemble: self.ensemble,
            hidden: self.hidden.clone().unwrap_or_else(|| vec![width; 5]),
            noise_table: self.noise_table,
            error_scale: self.error_scale,
            divergence: self.kl,
            kl_weight: self.kl_weight,
            prior_sigma: self.prior_sigma,
            initial_sigma: self.initial_sigma,
            epochs: self.epochs,
            patience: self.patience,
            batch: self.batch,
            rate: self.rate,
            grid_epochs: self.grid_epochs,
            grid_rate: self.grid_rate,
            held_out: self.held_out,
            seed: self.seed,
        };
        settings.check()?;
        Ok(settings)
    }

    /// The first option that only the memoryless kind has and that differs from its default.
    fn memoryless_only(&self) -> Option<&'static str> {
        let d = TrainingSettings::default();
        [
            ("--ensemble", self.ensemble),
            ("--hidden", self.hidden.is_some()),
            ("--features", self.features != d.features),
            ("--noise-table", self.noise_table != d.noise_table),
            ("--error-scale", self.error_scale != d.error_scale),
            ("--kl", self.kl != d.divergence),
            ("--kl-weight", self.kl_weight != d.kl_weight),
            ("--prior-sigma", self.prior_sigma != d.prior_sigma),
            ("--initial-sigma", self.initial_sigma != d.initial_sigma),
            ("--epochs", self.epochs != d.epochs),
            ("--patience", self.patience != d.patience),
            ("--batch", self.batch != d.batch),
            ("--rate", self.rate != d.rate),
            ("--held-out", self.held_out != d.held_out),
        ]
        .into_iter()
        .find_map(|(option, given)| given.then_some(option))
    }

    fn checkpoint_path(&self) -> PathBuf {
        let mut path = self.out.as_os_str().to_owned();
        path.push(".checkpoint");
        path.into()
    }
}

/// Runs the command.
///
/// # Errors
/// See [`TrainError`].
pub fn run(args: &Args) -> Result<Outcome, TrainError> {
    let settings = args.settings()?;
    check_paths(args)?;
    let threads = args.threads.map_or_else(default_threads, usize::from);
    let system = |error: &dyn std::fmt::Display| TrainError::System(error.to_string());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let interrupt = Interrupt::catch().map_err(|error| system(&error))?;
    pool.map_err(|error| system(&error))?
        .install(|| match args.kind {
            Kind::Memoryless => train(args, &settings, &interrupt),
            Kind::Recursive => recursive(args, &interrupt),
        })
}

fn recursive(args: &Args, interrupt: &Interrupt) -> Result<Outcome, TrainError> {
    if let Some(option) = args.memoryless_only() {
        return Err(TrainError::NotRecursive(option));
    }
    let run = Run {
        source: &args.source,
        out: &args.out,
        checkpoint: &args.checkpoint_path(),
        resume: args.resume,
        seed: args.seed,
        interrupt,
    };
    train_recursive::train(&run, &args.recursive)
}

fn default_threads() -> usize {
    std::thread::available_parallelism()
        .map_or(1, usize::from)
        .min(SHARDS)
}

fn check_paths(args: &Args) -> Result<(), TrainError> {
    let folder = args
        .out
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    if folder.is_some_and(|folder| !folder.is_dir()) {
        return Err(TrainError::NoFolder(args.out.clone()));
    }
    let checkpoint = args.checkpoint_path();
    if !args.resume && checkpoint.exists() {
        return Err(TrainError::CheckpointExists(checkpoint));
    }
    Ok(())
}

fn train(
    args: &Args,
    settings: &TrainingSettings,
    interrupt: &Interrupt,
) -> Result<Outcome, TrainError> {
    let source = args.source.load(settings.seed)?;
    let data = TrainingData::new(source.flights, settings)?;
    describe(&source.source, &data);
    let path = args.checkpoint_path();
    let state = start(args, settings, &data, &path)?;

    let mut progress = TrainingProgress::new(settings.epochs + settings.grid_epochs, state.epoch);
    let mut saved = Instant::now();
    let mut failed = None;
    let mut training = Training::new(settings, &data, Tier::detect(), state);
    let end = training.run(|state, event| {
        let mut stop = interrupt.asked();
        match event {
            Event::Batch { done, loss } => progress.batch(state.epoch, done, loss),
            Event::Epoch(report) => {
                progress.epoch(&report);
                if !stop && saved.elapsed() >= CHECKPOINT_EVERY {
                    let bytes = checkpoint::to_bytes(settings, &data.sha256, state);
                    failed = atomic_file::write(&path, &bytes).err();
                    stop = failed.is_some();
                    saved = Instant::now();
                }
            }
        }
        if stop {
            Control::Stop
        } else {
            Control::Continue
        }
    });
    progress.finish();
    if let Some(error) = failed {
        return Err(error.into());
    }
    if end? == End::Interrupted {
        let bytes = checkpoint::to_bytes(settings, &data.sha256, &training.state);
        atomic_file::write(&path, &bytes)?;
        eprintln!("interrupted; continue with --resume ({})", path.display());
        return Ok(Outcome::Interrupted);
    }
    write(args, settings, source.source, &data, &training.state)?;
    if path.exists() {
        std::fs::remove_file(&path).map_err(|cause| TrainError::Remove { path, cause })?;
    }
    Ok(Outcome::Written)
}

fn describe(source: &str, data: &TrainingData) {
    let split = &data.split;
    eprintln!(
        "{source}: {} flights ({} positions) to learn from, {} held out",
        split.training.len(),
        data.positions,
        split.validation.len()
    );
    match &split.sources {
        None => eprintln!(
            "warning: one recording only: its last segments are held out, which measures memory too"
        ),
        Some(held_out) if split.training.len() + held_out.len() < SOURCES_FEW => eprintln!(
            "warning: few recordings: the held-out loss is that of {}",
            held_out.join(", ")
        ),
        Some(_) => {}
    }
}

fn start(
    args: &Args,
    settings: &TrainingSettings,
    data: &TrainingData,
    path: &Path,
) -> Result<State, TrainError> {
    if !args.resume {
        return Ok(State::start(settings)?);
    }
    let path = path.to_owned();
    match std::fs::read(&path) {
        Ok(bytes) => checkpoint::parse(&bytes, settings, &data.sha256)
            .map_err(|cause| TrainError::Checkpoint { path, cause }),
        Err(cause) => Err(TrainError::Read { path, cause }),
    }
}

fn write(
    args: &Args,
    settings: &TrainingSettings,
    source: String,
    data: &TrainingData,
    state: &State,
) -> Result<(), TrainError> {
    let best = state
        .members
        .iter()
        .filter_map(|member| member.best.as_ref());
    let unrounded = state
        .members
        .iter()
        .filter_map(|member| member.unrounded.as_ref());
    let model = MemorylessModel {
        layout: settings.features.layout(),
        normalisation: data.normalisation.clone(),
        speed_sigma_mps: data.speed_sigma_mps,
        acceleration_sigma_mps2: data.acceleration_sigma_mps2,
        networks: best.clone().map(|best| best.weights.clone()).collect(),
    };
    let blob = model.blob()?;
    let provenance = Provenance {
        command: command_line("model-export"),
        version: env!("CARGO_PKG_VERSION"),
        data: source,
        data_sha256: data.sha256.clone(),
        training_flights: data.split.training.len(),
        held_out_flights: data.split.validation.len(),
        settings: settings.clone(),
        epochs: state.epoch,
        best: best.map(|best| (best.epoch, best.loss)).collect(),
        best_unrounded: unrounded.map(|best| (best.epoch, best.loss)).collect(),
        blob_sha256: data_hash::of_bytes(&blob),
        blob_bytes: blob.len(),
        quantisation: model
            .networks
            .iter()
            .map(|w| layer_errors(w, &quantise(w)))
            .collect(),
    };
    let json = format!("{:#}\n", serde_json::json!(provenance));
    atomic_file::write(
        &unrounded::path_beside(&args.out),
        &unrounded::to_bytes(&blob, &model.networks),
    )?;
    atomic_file::write(&provenance::path_beside(&args.out), json.as_bytes())?;
    // The blob last: where it is, the files beside it are its own.
    atomic_file::write(&args.out, &blob)?;
    let mut out = std::io::stdout().lock();
    writeln!(
        out,
        "{}: {} bytes, SHA-256 {}",
        args.out.display(),
        blob.len(),
        provenance.blob_sha256
    )?;
    for (index, (epoch, loss)) in provenance.best.iter().enumerate() {
        writeln!(
            out,
            "network {index}: held-out loss {loss:.4} after epoch {epoch} of {}",
            state.epoch
        )?;
    }
    Ok(())
}
