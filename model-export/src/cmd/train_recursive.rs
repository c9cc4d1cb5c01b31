//! `model-export train --kind recursive`: trains the recursive estimator and writes its blob.

use super::flight_source::{FlightSourceError, NamedFlights};
use super::number_within::within;
use super::train::{Outcome, Run, TrainError};
use super::tunable_file;
use crate::atomic_file;
use crate::blob::quantise::layer_errors;
use crate::blob::unrounded;
use crate::flights::data_hash;
use crate::flights::generator::{GeneratorSettings, generate};
use crate::memoryless::provenance::path_beside;
use crate::recursive::comparison::{Comparison, compare, table};
use crate::recursive::model::RecursiveModel;
use crate::recursive::network::sampling::Sampling;
use crate::recursive::provenance::Provenance;
use crate::recursive::recipe::Recipe;
use crate::recursive::scenario::Scenario;
use crate::recursive::step::Weighing;
use crate::recursive::training::Training;
use crate::recursive::training_progress::RecursiveProgress;
use bnkf::Inference;
use bnkf::blob::Blob;
use std::io::Write as _;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Time between two checkpoints.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(30);
/// Largest weight of the distance.
const WEIGHT_MAX: f64 = 1000.0;
/// Seed of the radar's noise over the held-out flights.
const HELD_OUT_SEED: u64 = 3;

/// Options of `--kind recursive`.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Options of --kind recursive")]
pub struct RecursiveArgs {
    /// Targets and radar that the model is for
    #[arg(long, value_enum, default_value_t = Scenario::Paper)]
    scenario: Scenario,
    /// Goes on with the training of this blob, whose unrounded weights lie beside it, as the training
    /// of the shipped model ended: fewer faults of the sensor, fewer flights from elsewhere, more fast
    /// ones but for blunt sensors, and means on the blob's int8 grid
    #[arg(long, value_name = "BLOB", conflicts_with_all = ["scenario", "sampling"])]
    from: Option<PathBuf>,
    /// Batches of new flights; the learning rate reaches zero after the last [default: the
    /// scenario's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    episodes: Option<u64>,
    /// Which layers' weights are distributions; the others' are numbers
    #[arg(long, value_enum, default_value_t = Sampling::EveryLayer)]
    sampling: Sampling,
    /// Hypotheses that the filter weighs while it is trained; the tracker always weighs all
    #[arg(long, value_enum, default_value_t = Recipe::DEFAULT.weighing)]
    weighing: Weighing,
    /// Weight of the distance, in standard deviations, beside the likelihood; 0 trains by likelihood
    /// alone
    #[arg(long, value_name = "WEIGHT", default_value_t = Recipe::DEFAULT.distance_weight, value_parser = within(0.0..=WEIGHT_MAX, "a weight"))]
    distance_weight: f64,
}

impl RecursiveArgs {
    /// The files that these options name and the training reads.
    pub fn inputs(&self) -> Vec<PathBuf> {
        let from = self.from.as_deref().map(tunable_file::paths);
        from.into_iter().flatten().collect()
    }

    /// The first option that is not at its default: the memoryless kind has none of them.
    pub fn first_given(&self) -> Option<&'static str> {
        [
            ("--scenario", self.scenario != Scenario::Paper),
            ("--from", self.from.is_some()),
            ("--episodes", self.episodes.is_some()),
            ("--sampling", self.sampling != Sampling::EveryLayer),
            ("--weighing", self.weighing != Recipe::DEFAULT.weighing),
            (
                "--distance-weight",
                self.distance_weight != Recipe::DEFAULT.distance_weight,
            ),
        ]
        .into_iter()
        .find_map(|(option, given)| given.then_some(option))
    }
}

/// Runs the command.
///
/// # Errors
/// See [`TrainError`].
pub fn train(run: &Run<'_>, args: &RecursiveArgs) -> Result<Outcome, TrainError> {
    let begun = args.from.as_deref().map(tunable_file::read).transpose()?;
    let scenario = begun.as_ref().map_or(args.scenario, |from| from.scenario);
    let (default, sampling) = match &begun {
        None => (scenario.recipe(), args.sampling),
        Some(from) => (
            scenario.recipe().going_on(from.blob_sha256.clone()),
            from.model.sampling,
        ),
    };
    let recipe = Recipe {
        seed: run.seed,
        episodes: args.episodes.unwrap_or(default.episodes),
        sampling,
        weighing: args.weighing,
        distance_weight: args.distance_weight,
        ..default
    };
    let named = flights(run, scenario)?;
    eprintln!(
        "{}: {} flights to learn from",
        named.source,
        named.flights.len()
    );
    let checkpoint = run.interrupted()?;
    let training = match &begun {
        None => Training::new(recipe, &named.flights)?,
        Some(from) => Training::going_on(recipe, &named.flights, &from.model)?,
    };
    let mut training = run.resumed(training, checkpoint)?;
    // What the flights contribute to the blob does not change any more.
    training.model().blob().map_err(TrainError::Statistics)?;
    if complete(run, &mut training)? == Outcome::Interrupted {
        return Ok(Outcome::Interrupted);
    }
    write(run, scenario, &named, &training)?;
    Ok(Outcome::Written)
}

/// Trains to the end, or until it is interrupted and a checkpoint written.
///
/// # Errors
/// The checkpoint cannot be written.
pub fn complete(run: &Run<'_>, training: &mut Training<'_>) -> Result<Outcome, TrainError> {
    let mut progress = RecursiveProgress::new(training.recipe.episodes, training.episode);
    let mut saved = Instant::now();
    while training.episode < training.recipe.episodes {
        if run.interrupt.asked() {
            progress.finish();
            atomic_file::write(run.checkpoint, &training.checkpoint())?;
            let path = run.checkpoint.display();
            eprintln!("interrupted; continue with --resume ({path})");
            return Ok(Outcome::Interrupted);
        }
        progress.episode(&training.episode());
        if saved.elapsed() >= CHECKPOINT_EVERY {
            atomic_file::write(run.checkpoint, &training.checkpoint())?;
            saved = Instant::now();
        }
    }
    progress.finish();
    Ok(Outcome::Written)
}

/// The flights that the command names, or the scenario's built-in ones.
fn flights(run: &Run<'_>, scenario: Scenario) -> Result<NamedFlights, FlightSourceError> {
    if run.source.flights.is_some() {
        return run.source.load(run.seed);
    }
    let mut settings = scenario.training_flights();
    if let Some(count) = run.source.builtin {
        settings.flights = count;
        settings.seed = run.source.builtin_seed;
    }
    built_in(&settings)
}

/// Generated flights and their name.
///
/// # Errors
/// The generator refuses the settings.
pub fn built_in(settings: &GeneratorSettings) -> Result<NamedFlights, FlightSourceError> {
    Ok(NamedFlights {
        source: format!(
            "{} built-in flights of {} s, seed {}",
            settings.flights, settings.duration_s, settings.seed
        ),
        flights: generate(settings)?,
    })
}

/// Writes the blob and what goes beside it.
///
/// # Errors
/// See [`TrainError`].
pub fn write(
    run: &Run<'_>,
    scenario: Scenario,
    named: &NamedFlights,
    training: &Training<'_>,
) -> Result<(), TrainError> {
    let model = training.model();
    let blob = model.blob()?;
    let held_out = held_out(&model, Blob::parse(&blob)?, scenario)?;
    let weights = model.weights();
    let provenance = Provenance {
        command: run.command(),
        version: env!("CARGO_PKG_VERSION"),
        data: named.source.clone(),
        data_sha256: data_hash::of_flights(&named.flights),
        training_flights: named.flights.len(),
        scenario,
        recipe: training.recipe.clone(),
        blob_sha256: data_hash::of_bytes(&blob),
        blob_bytes: blob.len(),
        quantisation: layer_errors(&weights, &model.layers()),
        held_out,
    };
    let json = format!("{:#}\n", serde_json::json!(provenance));
    let unrounded = unrounded::to_bytes(&blob, core::slice::from_ref(&weights));
    atomic_file::write(&unrounded::path_beside(run.out), &unrounded)?;
    atomic_file::write(&path_beside(run.out), json.as_bytes())?;
    // The blob last: a new one is never without the files beside it.
    atomic_file::write(run.out, &blob)?;
    // Before what a closed pipe may refuse.
    run.forget_checkpoint()?;
    let mut out = std::io::stdout().lock();
    writeln!(
        out,
        "{}: {} bytes, SHA-256 {}\n\n{}",
        run.out.display(),
        blob.len(),
        provenance.blob_sha256,
        table(&provenance.held_out)
    )?;
    Ok(())
}

/// The model and its blob over the scenario's held-out flights.
fn held_out(
    model: &RecursiveModel,
    blob: Blob<'_>,
    scenario: Scenario,
) -> Result<Vec<Comparison>, TrainError> {
    let flights = built_in(&scenario.held_out_flights())?.flights;
    let cells = scenario.cells(&flights, HELD_OUT_SEED);
    compare(model, blob, &cells, Inference::Mean).map_err(TrainError::Tracker)
}
