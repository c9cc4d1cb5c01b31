//! `model-export tune`: goes on training a shipped model on a user's own flights.

use super::flight_source::FlightSource;
use super::number_within::within;
use super::remarks;
use super::train::{Asked, Outcome, TrainError, check_paths};
use super::train_recursive::{built_in, complete, write};
use super::tunable_file;
use crate::recursive::recipe::Recipe;
use crate::recursive::training::Training;
use crate::recursive::tunable::Tunable;
use crate::recursive::tuning::{
    BLEND, DURATION_MIN_S, EPISODES, Hold, RATE, REHEARSAL, Tuning, too_short, usable,
};
use std::path::PathBuf;

/// Goes on training a recursive model on your own flights, a few of which are enough.
///
/// Half of every batch is built-in flights, so that nothing is forgotten; --blend goes a part of the way only, and --hold adds
/// a prior for the weights. How often targets manoeuvre, and how long an acceleration lasts in a forecast, is learned at the
/// end. MODEL.f32 must lie beside the model. Ctrl-C writes a checkpoint beside the output; --resume continues it to the same
/// bytes.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The model to go on from
    model: PathBuf,
    #[command(flatten)]
    source: FlightSource,
    /// The blob to write; OUT.json (provenance) and OUT.f32 (unrounded weights) go beside it
    #[arg(long, value_name = "OUT")]
    out: PathBuf,
    /// Batches of flights
    #[arg(long, value_name = "N", default_value_t = EPISODES, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    episodes: u64,
    /// Highest learning rate
    #[arg(long, value_name = "RATE", default_value_t = RATE, value_parser = within(1e-7..=1e-2, "a learning rate"))]
    rate: f64,
    /// How far the tuned model goes from the shipped weights to the trained ones, 0 to 1: all the way
    /// it knows most of your flights and least of all others
    #[arg(long, value_name = "SHARE", default_value_t = BLEND, value_parser = within(0.0..=1.0, "a share of the way"))]
    blend: f64,
    /// What holds the weights where they were, beside the built-in flights
    #[arg(long, value_enum, default_value_t = Hold::Nothing)]
    hold: Hold,
    /// Share of every batch that is built-in flights
    #[arg(long, value_name = "SHARE", default_value_t = REHEARSAL, value_parser = within(0.0..=0.95, "a share"))]
    rehearsal: f64,
    /// Continues from OUT.checkpoint; everything else as in the interrupted command
    #[arg(long)]
    resume: bool,
    /// Seed of noise and order
    #[arg(long, default_value_t = Recipe::DEFAULT.seed)]
    seed: u64,
    /// Threads; their number does not change the result [default: all cores, at most 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..))]
    threads: Option<u8>,
}

/// Runs the command.
///
/// # Errors
/// See [`TrainError`].
pub fn run(args: &Args) -> Result<Outcome, TrainError> {
    let mut inputs = args.source.files()?;
    inputs.extend(tunable_file::paths(&args.model));
    check_paths(&args.out, args.resume, &inputs)?;
    let Tunable {
        blob_sha256,
        model,
        scenario,
    } = tunable_file::read(&args.model)?;
    let mut named = args.source.load(args.seed)?;
    let left_out: Vec<String> = named.flights.iter().filter_map(too_short).collect();
    remarks::say(&[], &left_out);
    named.flights = usable(named.flights);
    if named.flights.is_empty() {
        return Err(TrainError::TooShort(DURATION_MIN_S));
    }
    let familiar = built_in(&scenario.training_flights())?;
    let tuning = Tuning {
        hold: args.hold,
        blend: args.blend,
        rehearsal: args.rehearsal,
        ..Tuning::new(blob_sha256, &named.flights, args.source.place)
    };
    let recipe = Recipe {
        seed: args.seed,
        episodes: args.episodes,
        rate: args.rate,
        sampling: model.sampling,
        ..scenario.recipe().tuned(tuning)
    };
    eprintln!(
        "{}: {} flights to learn from, beside {}",
        named.source,
        named.flights.len(),
        familiar.source
    );
    let asked = Asked {
        source: &args.source,
        out: &args.out,
        resume: args.resume,
        seed: args.seed,
        threads: args.threads,
    };
    asked.run(|run| {
        let checkpoint = run.interrupted()?;
        let training = Training::tune(recipe, &familiar.flights, &named.flights, &model)?;
        let mut training = run.resumed(training, checkpoint)?;
        if complete(run, &mut training)? == Outcome::Interrupted {
            return Ok(Outcome::Interrupted);
        }
        write(run, scenario, &named, &training)?;
        Ok(Outcome::Written)
    })
}
