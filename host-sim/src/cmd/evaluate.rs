//! `host-sim evaluate`: the table of methods, on recorded flights or cross-validated.

mod cross_validated;
pub mod data;
mod recorded;

use std::path::{Path, PathBuf};

use bnkf::blob::field::PASSES_MAX;
use bnkf_model_export::atomic_file::{self, AtomicWriteError};
use bnkf_model_export::flights::csv::options::ReadOptions;
use bnkf_model_export::flights::generator::GeneratorError;
use bnkf_model_export::flights::segment::PAPER_SEGMENT_S;
use bnkf_model_export::flights::set::{FlightSet, FlightSetError};
use bnkf_model_export::flights::track_error::COORDINATE_M_MAX;
use bnkf_model_export::memoryless::training_settings::EPOCHS_MAX;
use bnkf_model_export::radar::noise::NoiseTable;
use clap::ValueEnum as _;

use crate::baseline::tuning::FLIGHTS_MAX;
use crate::campaign::CampaignError;
use crate::campaign::fold_kit::TUNING_SEED;
use crate::campaign::shard::Shard;
use crate::campaign::work_folder::{Role, WorkFolderError};
use crate::contest::fold::FoldError;
use crate::contest::model::{Model, ModelError};
use crate::contest::own_filter::OwnFilter;
use crate::contest::roster::RosterError;
use crate::method::Method;
use crate::output_folder::{self, OutputFolderError};
use crate::scenario::{self, Scenario, ScenarioError};

/// Scores every method on the same readings, at three noise levels and three sampling rates.
///
/// With --flights alone: the built-in models on recorded flights. With --folds or --quick:
/// cross-validation, every fold's networks trained on the other folds' recordings; interrupted runs
/// continue where they were, and several machines divide one among themselves (--shard, --merge). Filters are tuned on generated flights of another seed; with --flights
/// also on the other folds' recordings and on both, and each cell shows the best of the three, which
/// favours the filters (all three: tunings.csv).
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// What is measured.
    #[command(flatten)]
    pub subject: Subject,
    /// Blob that replaces the built-in one of its kind: one network serves BNN and BNKF, three BNKFe;
    /// a cross-validation trains those itself and takes recursive blobs only
    #[arg(long = "model", value_name = "BLOB")]
    pub models: Vec<PathBuf>,
    /// Methods, separated by commas [default: the paper's five and the recursive tracker; with --folds or --quick all but those
    /// with moments and the tuned tracker, which run when they are named]
    #[arg(long, value_enum, value_delimiter = ',')]
    pub methods: Vec<Method>,
    /// Monte Carlo passes per estimate [default: each model's own number]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=i64::from(PASSES_MAX)))]
    pub passes: Option<u16>,
    /// Writes cells and provenance to this file
    #[arg(long, value_name = "FILE", conflicts_with_all = ["folds", "quick"])]
    pub json: Option<PathBuf>,
    /// Training epochs of a cross-validation [default: 200, with --quick 30]
    #[arg(long, value_name = "N", requires = "cross-validation", value_parser = clap::value_parser!(u32).range(1..=i64::from(EPOCHS_MAX)))]
    pub epochs: Option<u32>,
    /// Folder for the results of a cross-validation; made if it is missing
    #[arg(
        long,
        value_name = "DIR",
        requires = "cross-validation",
        default_value = "out/evaluation"
    )]
    pub out: PathBuf,
    /// Writes truth, reading, estimate, covariance and mode of every step into steps.parquet, beside the scores
    #[arg(long, requires = "cross-validation")]
    pub steps: bool,
    /// Leaves out what a step costs, which no two runs measure alike: then the page is the same bytes, too
    #[arg(long, requires = "cross-validation")]
    pub no_times: bool,
    /// How several processes or machines divide a cross-validation.
    #[command(flatten)]
    pub division: Division,
}

/// One share of a cross-validation, or all of them put together.
#[derive(Clone, Debug, clap::Args)]
pub struct Division {
    /// Makes share K of N of a cross-validation and no results; every share has the same other arguments. A share
    /// that dies is run again and goes on where it was; --merge makes the results
    #[arg(
        long,
        value_name = "K/N",
        requires = "cross-validation",
        conflicts_with = "merge"
    )]
    pub shard: Option<Shard>,
    /// Makes the results of what all shards have made, the same bytes as one run's; names the pieces that are missing
    #[arg(long, requires = "cross-validation")]
    pub merge: bool,
    /// Folder of the finished pieces, which shards may share [default: work in --out]; --merge takes several
    #[arg(long, value_name = "DIR", requires = "cross-validation")]
    pub work: Vec<PathBuf>,
}

impl Division {
    /// Whose work this process does.
    fn role(&self) -> Role {
        match self.shard {
            Some(shard) => Role::Shard(shard),
            None if self.merge => Role::Merge,
            None => Role::Alone,
        }
    }

    /// The folders of the pieces; `out` is that of the results.
    fn folders(&self, out: &Path) -> Result<Vec<PathBuf>, EvaluateError> {
        match &self.work[..] {
            [] => Ok(vec![out.join("work")]),
            [_, _, ..] if !self.merge => Err(EvaluateError::WorkFolders),
            folders => Ok(folders.to_vec()),
        }
    }
}

/// Which flights are measured by which radar, how often, and which of them filters may learn from.
#[derive(Clone, Debug, clap::Args)]
#[command(group(clap::ArgGroup::new("cross-validation").args(["folds", "quick"]).multiple(true)))]
pub struct Subject {
    /// Folder of flight files (.csv or .txt: timestamp,tx,ty,tz and other forms), or one file; with --folds or
    /// --quick generated flights are the default
    #[arg(long, value_name = "PATH", required_unless_present_any = ["folds", "quick"])]
    pub flights: Option<PathBuf>,
    /// Moves every segment at random (yaw, mirror, shift) into the scenario's volume
    #[arg(long, requires = "flights")]
    pub place: bool,
    /// Position of the radar in the flights' frame, metres
    #[arg(long, value_name = "X,Y,Z", default_value = "0,0,0", value_parser = position_m, allow_hyphen_values = true)]
    pub radar: Position,
    /// Length of the segments that flights are cut into, seconds; 0 keeps them whole
    #[arg(long, value_name = "S", requires = "flights", default_value_t = PAPER_SEGMENT_S)]
    pub segment_s: f64,
    /// How the angle figures of the noise levels are read: radians, or degrees as printed
    /// [default: radians; with --folds the scenario's]
    #[arg(long, value_enum)]
    pub noise_table: Option<NoiseTable>,
    /// Seed of flights, placement, radar noise, training and Monte Carlo passes
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Cross-validates with this many folds, by recording
    #[arg(long, value_name = "N")]
    pub folds: Option<usize>,
    /// Cross-validates in minutes: fewer flights and epochs, one noise table
    #[arg(long)]
    pub quick: bool,
    /// Radar and flights of a cross-validation.
    #[arg(
        long,
        help = scenarios(),
        value_name = "NAME|FILE",
        requires = "cross-validation",
        default_value = "paper"
    )]
    pub scenario: PathBuf,
    /// How often a cross-validation measures every flight, and places it if --place is given; the
    /// first time is what trains and tunes, and intervals draw all runs of a flight together
    #[arg(long, value_name = "N", requires = "cross-validation", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub runs: u16,
    /// How many flights are generated to tune filters on; but for the scenario no other option changes
    /// them [default: 75 minutes of flight, 300 at most]
    #[arg(long, value_name = "N", requires = "cross-validation", value_parser = clap::value_parser!(u16).range(2..=FLIGHTS_MAX as i64))]
    pub tuning_flights: Option<u16>,
    /// How flight files are read.
    #[command(flatten)]
    pub reading: ReadOptions,
}

/// A point, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position(pub [f64; 3]);

/// Why an evaluation failed.
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// No flights.
    #[error(transparent)]
    Flights(#[from] FlightSetError),
    /// Flights cannot be generated.
    #[error("generated flights: {0}")]
    Generator(#[from] GeneratorError),
    /// The scenario cannot be used.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// Flights to tune on and flights to evaluate would be the same.
    #[error("seed {TUNING_SEED} generates the flights that filters are tuned on: choose another")]
    TuningSeed,
    /// The flights cannot be divided.
    #[error(transparent)]
    Folds(#[from] FoldError),
    /// A blob cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A blob that every fold trains for itself.
    #[error("{0}: every fold trains its memoryless networks; --model takes recursive blobs here")]
    TrainedHere(PathBuf),
    /// A blob that no method runs on.
    #[error("{0}: none of --methods runs on it")]
    Unused(PathBuf),
    /// A blob in the place of one that was named already.
    #[error("{0}: a second --model for the same methods")]
    SecondModel(PathBuf),
    /// A method that the scenario's radars are too much for.
    #[error("method {0} knows one radar at rest in the origin only, and this scenario has others")]
    NeedsOrigin(Method),
    /// A method cannot run.
    #[error(transparent)]
    Roster(#[from] RosterError),
    /// A method is named twice.
    #[error("method {0} is named twice")]
    Twice(Method),
    /// The folder cannot take results.
    #[error(transparent)]
    Folder(#[from] OutputFolderError),
    /// Pieces are written into one folder.
    #[error("--work: several folders are for --merge")]
    WorkFolders,
    /// The pieces of the cross-validation.
    #[error(transparent)]
    Work(#[from] WorkFolderError),
    /// The cross-validation.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// A result file cannot be written; as far as that can be known, found before the run.
    #[error(transparent)]
    Write(#[from] AtomicWriteError),
    /// Standard output was closed.
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
}

/// Runs the command.
///
/// # Errors
/// See [`EvaluateError`].
pub fn run(args: &Args) -> Result<(), EvaluateError> {
    evaluate_with(args, Vec::new())
}

/// Runs the command with methods from outside, which take part whatever --methods names: the same readings,
/// metrics, intervals, page.
///
/// # Errors
/// See [`EvaluateError`].
pub fn evaluate_with(args: &Args, own: Vec<OwnFilter>) -> Result<(), EvaluateError> {
    for (index, method) in own.iter().map(OwnFilter::method).enumerate() {
        let built_in = Method::value_variants().iter();
        if own[..index].iter().any(|other| other.method() == method)
            || built_in
                .into_iter()
                .any(|other| other.label() == method.label())
        {
            return Err(EvaluateError::Twice(method));
        }
    }
    for (index, method) in args.methods.iter().enumerate() {
        if args.methods[..index].contains(method) {
            return Err(EvaluateError::Twice(*method));
        }
    }
    match &args.subject.flights {
        Some(flights) if !args.is_cross_validation() => recorded::run(args, flights, &own),
        _ => cross_validated::run(args, own),
    }
}

/// Tries where the results are to be written, before the work: the file of a single pass over flights, else the
/// folder, which is made; a shard makes no results. `more` is read beside what `args` name.
///
/// # Errors
/// They cannot be written there, or what is read would be lost.
pub fn prepare(args: &Args, more: &[PathBuf]) -> Result<(), EvaluateError> {
    let inputs = || {
        let mut inputs = args.subject.inputs()?;
        inputs.extend(args.models.iter().chain(more).cloned());
        Ok::<_, FlightSetError>(inputs)
    };
    if !args.is_cross_validation() {
        if let Some(path) = &args.json {
            atomic_file::check(std::slice::from_ref(path), &inputs()?)?;
        }
        return Ok(());
    }
    match args.division.role() {
        Role::Shard(_) => Ok(()),
        _ => Ok(output_folder::prepare(
            &args.out,
            &cross_validated::names(),
            &inputs()?,
        )?),
    }
}

impl Subject {
    /// The files that it names: of flights and of a scenario.
    ///
    /// # Errors
    /// There are no flights.
    pub fn inputs(&self) -> Result<Vec<PathBuf>, FlightSetError> {
        let flights = self.flights.as_deref().map(FlightSet::files);
        let mut inputs = flights.transpose()?.unwrap_or_default();
        inputs.push(self.scenario.clone());
        Ok(inputs)
    }
}

impl Args {
    /// Whether there are folds, or will be: flights of one's own are else passed over once.
    fn is_cross_validation(&self) -> bool {
        let subject = &self.subject;
        subject.flights.is_none() || subject.folds.is_some() || subject.quick
    }
}

/// The scenario, with the noise tables that are evaluated.
///
/// # Errors
/// It cannot be used.
pub fn scenario(args: &Subject) -> Result<Scenario, ScenarioError> {
    let mut scenario = Scenario::find(&args.scenario)?;
    let is_cross_validated = args.folds.is_some() || args.quick;
    match args.noise_table {
        Some(table) => scenario.radar.tables = vec![table],
        None if !is_cross_validated => scenario.radar.tables = vec![NoiseTable::default()],
        None if args.quick => scenario.radar.tables.truncate(1),
        None => {}
    }
    Ok(scenario)
}

/// The blobs of --model, each of a form of its own and for some method to run on, in the place of those of
/// `built_in` that have their forms.
fn with_given(
    mut built_in: Vec<Model>,
    paths: &[PathBuf],
    methods: &[Method],
) -> Result<Vec<Model>, EvaluateError> {
    let mut given: Vec<Model> = Vec::new();
    for path in paths {
        let model = Model::read(path)?;
        if !methods.iter().any(|m| m.model() == Some(model.form())) {
            return Err(EvaluateError::Unused(path.clone()));
        }
        if given.iter().any(|other| other.form() == model.form()) {
            return Err(EvaluateError::SecondModel(path.clone()));
        }
        given.push(model);
    }
    built_in.retain(|model| given.iter().all(|other| other.form() != model.form()));
    built_in.extend(given);
    Ok(built_in)
}

/// The methods that were named, else `default`; then those from outside.
fn methods_or(args: &Args, default: &[Method], own: &[OwnFilter]) -> Vec<Method> {
    let named = if args.methods.is_empty() {
        default
    } else {
        &args.methods
    };
    let own = own.iter().map(OwnFilter::method);
    named.iter().copied().chain(own).collect()
}

/// What `--scenario` takes: every one that there is, by name.
fn scenarios() -> String {
    format!(
        "Scenario of a cross-validation: {}, or a TOML file; with radars that are not in the origin BNN, BNKF and BNKFe do not run",
        scenario::known()
    )
}

fn position_m(text: &str) -> Result<Position, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|part| {
            part.trim()
                .parse()
                .map_err(|_| format!("`{part}` is not a number"))
        })
        .collect::<Result<_, _>>()?;
    match <[f64; 3]>::try_from(numbers) {
        Ok(position) if position.iter().any(|value| !value.is_finite()) => {
            Err("a coordinate is not finite".to_owned())
        }
        Ok(position) if position.iter().any(|value| value.abs() > COORDINATE_M_MAX) => {
            Err(format!("a coordinate is beyond +-{COORDINATE_M_MAX} m"))
        }
        Ok(position) => Ok(Position(position)),
        Err(numbers) => Err(format!("{} numbers, three are needed", numbers.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::{Position, position_m};

    #[test]
    fn positions_are_three_finite_numbers() {
        assert_eq!(position_m("1,-2.5, 3e1"), Ok(Position([1.0, -2.5, 30.0])));
        assert!(position_m("1,2").unwrap_err().contains("2 numbers"));
        assert!(position_m("1,x,3").unwrap_err().contains("`x`"));
        assert!(position_m("1,2,inf").unwrap_err().contains("not finite"));
        assert!(position_m("1,2,1e300").unwrap_err().contains("beyond"));
    }
}
