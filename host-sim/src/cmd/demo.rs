//! `host-sim` without a command: the default methods on built-in flights, a table and two figures.

use std::io::Write as _;
use std::path::PathBuf;

use bnkf_model_export::atomic_file::{self, AtomicWriteError};
use bnkf_model_export::command_line::command_line;
use bnkf_model_export::flights::data_hash;
use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::generator::{GeneratorError, GeneratorSettings, generate};
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};

use super::progress;
use crate::contest::default_models;
use crate::contest::evaluation::{Cells, Evaluation};
use crate::contest::example::Example;
use crate::contest::flight_kind::first_of_each;
use crate::contest::model::{Model, ModelError};
use crate::contest::roster::{Roster, RosterError, Supplies};
use crate::method::Method;
use crate::output_folder::{self, OutputFolderError};
use crate::plot::metrics_figure;
use crate::plot::trajectory_figure;
use crate::report::results_json::{self, ModelProvenance, Provenance, Results};
use crate::report::table;
use crate::scenario::radar::{Condition, Radar};

/// Built-in flights of the main job: as many as half a minute on two cores allows.
const FLIGHTS: usize = 14;
/// Their seed; no shipped model was trained on it.
const FLIGHT_SEED: u64 = 20_260_322;
/// Seed of the radar noise and the Monte Carlo passes.
const SEED: u64 = 1;

/// Scores the built-in models on built-in flights and draws what they did.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Folder for the figures and the results; made if it is missing
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
}

/// Why the main job failed.
#[derive(Debug, thiserror::Error)]
pub enum DemoError {
    /// The flights cannot be generated.
    #[error("built-in flights: {0}")]
    Generator(#[from] GeneratorError),
    /// A built-in blob cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A method cannot run.
    #[error(transparent)]
    Roster(#[from] RosterError),
    /// The output folder cannot take results.
    #[error(transparent)]
    Folder(#[from] OutputFolderError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] AtomicWriteError),
    /// Standard output was closed.
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
}

/// Runs the main job.
///
/// # Errors
/// See [`DemoError`].
pub fn run(args: &Args) -> Result<(), DemoError> {
    output_folder::prepare(&args.out, &[], &[])?;
    let settings = GeneratorSettings {
        flights: FLIGHTS,
        seed: FLIGHT_SEED,
        ..GeneratorSettings::default()
    };
    let flights = generate(&settings)?;
    let models = default_models::load()?;
    let supplies = Supplies {
        models: &models,
        passes: None,
        tunings: None,
        tuned: None,
        own: &[],
    };
    let roster = Roster::new(&Method::DEFAULT, supplies)?;
    let radar = Radar::paper(NoiseTable::default());
    let evaluation = Evaluation {
        segments: &flights,
        roster: &roster,
        conditions: &radar.conditions(),
        radar: &radar,
        seed: SEED,
    };
    let bar = progress::bar(evaluation.units(), "Evaluating");
    let Cells {
        tracking: cells,
        forecasts,
    } = evaluation.run(&|| bar.inc(1));
    bar.finish_and_clear();

    let mut said = format!(
        "{FLIGHTS} built-in flights of 15 s, six methods on the same readings\n\n{}\n",
        table::render(&cells)
    );
    let figures = [
        (
            "trajectory.svg",
            trajectory_figure::draw(&examples(&evaluation)),
        ),
        ("metrics.svg", metrics_figure::draw(&cells, &[])),
    ];
    for (name, figure) in figures {
        let path = args.out.join(name);
        atomic_file::write(&path, figure.as_bytes())?;
        said += &format!("{}\n", path.display());
    }
    let path = args.out.join("results.json");
    let results = Results {
        cells,
        forecasts,
        provenance: provenance(&flights, &models),
    };
    results_json::write(&path, &results)?;
    said += &format!("{}\n", path.display());
    // Only now: a closed pipe costs no results.
    std::io::stdout().write_all(said.as_bytes())?;
    Ok(())
}

/// One flight of a kind of its own per noise level, with gaps.
fn examples<'a>(evaluation: &Evaluation<'a>) -> Vec<Example<'a>> {
    let rate = SamplingRate::THREE_QUARTERS;
    let example = |(noise, index): (NoiseLevel, usize)| {
        let flight = &evaluation.segments[index];
        let table = NoiseTable::default();
        let condition = Condition { table, noise, rate };
        let readings = evaluation.readings(flight, condition);
        let tracks = evaluation.roster.tracks(flight, &readings, condition, SEED);
        Example {
            flight,
            noise,
            rate,
            readings,
            tracks,
        }
    };
    NoiseLevel::ALL
        .into_iter()
        .zip(first_of_each(evaluation.segments))
        .map(example)
        .collect()
}

fn provenance(flights: &[Flight], models: &[Model]) -> Provenance {
    Provenance {
        command: command_line("host-sim"),
        version: env!("CARGO_PKG_VERSION"),
        tree: env!("BNKF_TREE"),
        seed: SEED,
        data: format!("built-in generator, seed {FLIGHT_SEED}"),
        data_sha256: data_hash::of_flights(flights),
        flights: flights.len(),
        segments: flights.len(),
        unplaced: Vec::new(),
        remarks: Vec::new(),
        segment_s: 0.0,
        placed: false,
        radar_m: [0.0; 3],
        noise_table: NoiseTable::default(),
        passes: None,
        models: models.iter().map(ModelProvenance::from).collect(),
    }
}
