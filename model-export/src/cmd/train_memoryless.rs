//! `model-export train --kind memoryless`: trains BNN, BNKF or BNKFe and writes the blob.

use super::train::{Outcome, Run, TrainError};
use crate::atomic_file;
use crate::blob::quantise::{layer_errors, quantise};
use crate::blob::unrounded;
use crate::flights::data_hash;
use crate::flights::held_out::HeldOut;
use crate::kernel::Tier;
use crate::memoryless::checkpoint;
use crate::memoryless::model::MemorylessModel;
use crate::memoryless::provenance::{self, Provenance};
use crate::memoryless::training::{Control, End, Event, State, Training};
use crate::memoryless::training_data::TrainingData;
use crate::memoryless::training_progress::TrainingProgress;
use crate::memoryless::training_settings::{
    Divergence, ErrorScale, Features, TrainingSettings, TrainingSettingsError,
};
use crate::posterior::gaussian_weights::GaussianWeights;
use crate::radar::noise::NoiseTable;
use std::io::Write as _;
use std::time::{Duration, Instant};

/// Time between two checkpoints.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(10);
/// With fewer recordings than this the held-out loss says little.
const SOURCES_FEW: usize = 10;

/// Options of `--kind memoryless`.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Options of --kind memoryless")]
pub struct MemorylessArgs {
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
    noise_table: NoiseTable,
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
}

impl MemorylessArgs {
    fn settings(&self, seed: u64) -> Result<TrainingSettings, TrainingSettingsError> {
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
            seed,
        };
        settings.check()?;
        Ok(settings)
    }

    /// The first of these options that differs from its default.
    pub fn first_given(&self) -> Option<&'static str> {
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
            ("--grid-epochs", self.grid_epochs != d.grid_epochs),
            ("--grid-rate", self.grid_rate != d.grid_rate),
            ("--held-out", self.held_out != d.held_out),
        ]
        .into_iter()
        .find_map(|(option, given)| given.then_some(option))
    }
}

/// Runs the command.
///
/// # Errors
/// See [`TrainError`].
pub fn train(run: &Run<'_>, args: &MemorylessArgs) -> Result<Outcome, TrainError> {
    let settings = &args.settings(run.seed)?;
    let source = run.source.load(settings.seed)?;
    let data = TrainingData::new(source.flights, settings)?;
    describe(&source.source, &data);
    let state = start(run, settings, &data)?;
    // What the flights contribute to the blob does not change any more.
    let networks = state.members.iter().map(|member| member.weights.clone());
    model(settings, &data, networks.collect())
        .blob()
        .map_err(TrainError::Statistics)?;

    let mut progress = TrainingProgress::new(settings.epochs + settings.grid_epochs, state.epoch);
    let mut saved = Instant::now();
    let mut failed = None;
    let mut training = Training::new(settings, &data, Tier::detect(), state);
    let end = training.run(|state, event| {
        let mut stop = run.interrupt.asked();
        match event {
            Event::Batch { done, loss } => progress.batch(state.epoch, done, loss),
            Event::Epoch(report) => {
                progress.epoch(&report);
                if !stop && saved.elapsed() >= CHECKPOINT_EVERY {
                    let bytes = checkpoint::to_bytes(settings, &data.sha256, state);
                    failed = atomic_file::write(run.checkpoint, &bytes).err();
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
        atomic_file::write(run.checkpoint, &bytes)?;
        let path = run.checkpoint.display();
        eprintln!("interrupted; continue with --resume ({path})");
        return Ok(Outcome::Interrupted);
    }
    write(run, settings, source.source, &data, &training.state)?;
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
    if let Some(warning) = few_recordings(split) {
        eprintln!("warning: {warning}");
    }
}

/// What to say where the held-out loss says little.
fn few_recordings(split: &HeldOut) -> Option<String> {
    match &split.sources {
        None => Some(
            "one recording only: its last segments are held out, which measures memory too"
                .to_owned(),
        ),
        Some(sources) if sources.all < SOURCES_FEW => Some(format!(
            "{} recordings only: the held-out loss is that of {}",
            sources.all,
            sources.held_out.join(", ")
        )),
        Some(_) => None,
    }
}

fn start(
    run: &Run<'_>,
    settings: &TrainingSettings,
    data: &TrainingData,
) -> Result<State, TrainError> {
    let Some(bytes) = run.interrupted()? else {
        return Ok(State::start(settings)?);
    };
    checkpoint::parse(&bytes, settings, &data.sha256).map_err(|cause| TrainError::Checkpoint {
        path: run.checkpoint.to_owned(),
        cause,
    })
}

fn model(
    settings: &TrainingSettings,
    data: &TrainingData,
    networks: Vec<GaussianWeights>,
) -> MemorylessModel {
    MemorylessModel {
        layout: settings.features.layout(),
        normalisation: data.normalisation.clone(),
        speed_sigma_mps: data.speed_sigma_mps,
        acceleration_sigma_mps2: data.acceleration_sigma_mps2,
        networks,
    }
}

fn write(
    run: &Run<'_>,
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
    let networks = best.clone().map(|best| best.weights.clone()).collect();
    let model = model(settings, data, networks);
    let blob = model.blob()?;
    let provenance = Provenance {
        command: run.command(),
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
        &unrounded::path_beside(run.out),
        &unrounded::to_bytes(&blob, &model.networks),
    )?;
    atomic_file::write(&provenance::path_beside(run.out), json.as_bytes())?;
    // The blob last: a new one is never without the files beside it.
    atomic_file::write(run.out, &blob)?;
    // Before what a closed pipe may refuse.
    run.forget_checkpoint()?;
    let mut out = std::io::stdout().lock();
    writeln!(
        out,
        "{}: {} bytes, SHA-256 {}",
        run.out.display(),
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

#[cfg(test)]
mod tests {
    use super::few_recordings;
    use crate::flights::flight::Flight;
    use crate::flights::held_out::{HeldOut, hold_out};

    /// Forty segments of `recordings` files.
    fn split(recordings: usize) -> HeldOut {
        let rows = [[0.0; 4], [1.0; 4], [2.0; 4]];
        let segment = |i: usize| {
            let source = format!("{}.csv", i % recordings);
            Flight::from_track(&format!("{source}#{i}"), &source, &rows).unwrap()
        };
        hold_out((0..40).map(segment).collect(), 0.2, 1).unwrap()
    }

    #[test]
    fn recordings_are_counted_and_not_their_segments() {
        assert!(few_recordings(&split(1)).unwrap().contains("one recording"));
        let warning = few_recordings(&split(4)).unwrap();
        assert!(warning.starts_with("4 recordings only"), "{warning}");
        assert_eq!(few_recordings(&split(10)), None);
    }
}
