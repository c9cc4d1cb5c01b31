//! Cross-validation by recording: the full evaluation and its quick form.

use std::io::Write as _;
use std::sync::Mutex;

use bnkf::blob::Kind;
use bnkf_model_export::atomic_file;
use bnkf_model_export::cmd::remarks;
use bnkf_model_export::command_line::command_line_without;
use bnkf_model_export::flights::data_hash;
use bnkf_model_export::pending_file::PendingFile;
use bnkf_model_export::radar::sensors::Sensors;
use clap::ValueEnum;
use indicatif::ProgressBar;

use super::data::Data;
use super::{Args, EvaluateError, methods_or, with_given};
use crate::campaign::shard::Shard;
use crate::campaign::steps_parquet::Detail;
use crate::campaign::work_folder::{Role, WorkFolder};
use crate::campaign::{Campaign, Progress, Watcher};
use crate::cmd::progress;
use crate::contest::fold::Folds;
use crate::contest::model::Model;
use crate::contest::own_filter::OwnFilter;
use crate::contest::{default_models, runtime};
use crate::method::Method;
use crate::report::campaign_results::{self, CampaignProvenance};
use crate::report::results_json::ModelProvenance;
use crate::report::{self, Material, by_motion, forecasts, table};
use crate::scenario::Scenario;

/// Every step.
const STEPS: &str = "steps.parquet";
/// What a step costs.
const TIMES_JSON: &str = "runtime.json";
const TIMES_CSV: &str = "runtime.csv";

/// Folds, unless --folds says otherwise.
const FOLDS: usize = 5;
/// Training epochs of a full and a quick run.
const EPOCHS: u32 = 200;
const EPOCHS_QUICK: u32 = 30;

/// Names of everything that may be written but figures.
pub fn names() -> Vec<&'static str> {
    let own = [STEPS, TIMES_JSON, TIMES_CSV, report::PAGE];
    own.into_iter().chain(campaign_results::NAMES).collect()
}

/// Runs or continues a cross-validation, writes its files and prints its table.
pub fn run(args: &Args, own: Vec<OwnFilter>) -> Result<(), EvaluateError> {
    let scenario = super::scenario(&args.subject)?;
    if let Some(method) = args.methods.iter().find(|method| method.needs_origin())
        && scenario.radar.sensors != Sensors::Origin
    {
        return Err(EvaluateError::NeedsOrigin(*method));
    }
    let (role, folders) = (args.division.role(), args.division.folders(&args.out)?);
    // Before the work, not after it.
    super::prepare(args, &[])?;
    let data = Data::of(&args.subject, &scenario)?;
    remarks::say(&data.remarks, &data.unplaced);
    let (campaign, provenance) = planned(args, scenario, data, own)?;
    if args.subject.quick {
        eprintln!("{}", quick_note(&campaign));
    }
    if role != Role::Merge {
        campaign.check_worlds()?;
    }
    let work = WorkFolder::open_all(&folders, &plan(&campaign, &provenance), role)?;
    let bar: Mutex<Option<ProgressBar>> = Mutex::new(None);
    let watcher = |told| show(&bar, told);
    match role {
        Role::Alone => campaign.make(&work, Shard::WHOLE, &watcher)?,
        Role::Merge => campaign.check(&work)?,
        Role::Shard(shard) => {
            campaign.make(&work, shard, &watcher)?;
            let said = format!(
                "shard {shard}: its pieces are in {}\n",
                work.path().display()
            );
            return Ok(std::io::stdout().write_all(said.as_bytes())?);
        }
    }
    let said = written(args, &campaign, &provenance, &work, &watcher)?;
    // Only now: whoever kills this run before its results are written finds the pieces again. What shards have made
    // is theirs, and a merge that is killed at its very end can be made again.
    if role == Role::Alone {
        work.remove()?;
    }
    // And last what a closed pipe may refuse.
    std::io::stdout().write_all(said.as_bytes())?;
    Ok(())
}

/// What is to be done, and how it will be known.
fn planned(
    args: &Args,
    scenario: Scenario,
    data: Data,
    own: Vec<OwnFilter>,
) -> Result<(Campaign, CampaignProvenance), EvaluateError> {
    let in_origin = scenario.radar.sensors == Sensors::Origin;
    for path in &args.models {
        if Model::read(path)?.form().0 == Kind::Memoryless {
            return Err(EvaluateError::TrainedHere(path.clone()));
        }
    }
    let methods = methods_or(args, &all_methods(in_origin), &own);
    // Of the shipped models only what no fold trains.
    let shipped = default_models::of_scenario(&scenario.name)?;
    let shipped = shipped.map_or_else(default_models::recursive, Ok)?;
    let shipped = with_given(vec![shipped], &args.models, &methods)?;
    let count = args.subject.folds.unwrap_or(FOLDS);
    let campaign = Campaign {
        folds: Folds::new(&data.runs.flights, count, args.subject.seed)?,
        runs: data.runs,
        placed: args.subject.place,
        to_tune_on: data.to_tune_on,
        tuned_on: data.tuned_on,
        methods,
        own,
        shipped,
        passes: args.passes,
        epochs: args.epochs.unwrap_or(if args.subject.quick {
            EPOCHS_QUICK
        } else {
            EPOCHS
        }),
        seed: args.subject.seed,
        detail: if args.steps {
            Detail::Estimates
        } else {
            Detail::Scores
        },
        scenario,
    };
    let provenance = CampaignProvenance {
        remarks: data.remarks,
        ..provenance(args, &campaign, data.source, data.sha256, data.unplaced)
    };
    Ok((campaign, provenance))
}

/// Sums the finished pieces up and writes every file of the results; what is said of them.
fn written(
    args: &Args,
    campaign: &Campaign,
    provenance: &CampaignProvenance,
    work: &WorkFolder,
    watcher: Watcher<'_>,
) -> Result<String, EvaluateError> {
    let path = args.out.join(STEPS);
    let mut steps = PendingFile::new(&path)?;
    let outcome = campaign.sum_up(work, &mut steps, watcher)?;
    steps.finish()?;
    let mut said = String::new();
    for noise_table in &campaign.scenario.radar.tables {
        let cells = outcome.plain_cells(*noise_table);
        said += &format!(
            "angle figures as {noise_table}\n\n{}\n{}\n{}\n",
            table::render(&cells),
            forecasts::text(&outcome.forecast_cells(*noise_table)),
            by_motion::text(&cells)
        );
    }
    if campaign.tuned_on.len() > 1 && !outcome.candidates.is_empty() {
        said += "Tuned filters: the best in each cell of three fits, to generated flights, to the other recordings and to both.\n\n";
    }
    said += &format!("{}\n", path.display());
    for name in campaign_results::write(&args.out, &outcome, provenance)? {
        said += &format!("{}\n", args.out.join(name).display());
    }
    let times = if args.no_times {
        Vec::new()
    } else {
        campaign.times(work)?
    };
    // Apart from the results, which are the same bytes on every run: times are not.
    if !times.is_empty() {
        let json = serde_json::to_vec_pretty(&times).expect("every value has a representation");
        atomic_file::write(&args.out.join(TIMES_JSON), &json)?;
        atomic_file::write(&args.out.join(TIMES_CSV), &runtime::csv(&times))?;
    }
    let examples = campaign.examples(work, &outcome.candidates, &report::SHOWN)?;
    let material = Material {
        campaign,
        outcome: &outcome,
        provenance,
        examples: &examples,
        times: &times,
    };
    for file in report::files(&material) {
        let path = args.out.join(&file.name);
        atomic_file::write(&path, file.text.as_bytes())?;
        said += &format!("{}\n", path.display());
    }
    Ok(said)
}

/// Every method that has what it needs, with a radar in the origin or without. Tuning the tracker takes minutes a fold, so it must
/// be named; so must those that take moments, which are other ways to run the same networks.
fn all_methods(in_origin: bool) -> Vec<Method> {
    let without = |method: &Method| match method {
        Method::RecursiveTuned => false,
        method if method.takes_moments() => false,
        method => in_origin || !method.needs_origin(),
    };
    Method::value_variants()
        .iter()
        .copied()
        .filter(without)
        .collect()
}

fn provenance(
    args: &Args,
    campaign: &Campaign,
    data: String,
    sha256: String,
    unplaced: Vec<String>,
) -> CampaignProvenance {
    let mut recordings: Vec<&str> = campaign
        .runs
        .flights
        .iter()
        .map(|flight| flight.source.as_str())
        .collect();
    recordings.sort_unstable();
    recordings.dedup();
    CampaignProvenance {
        // What was done, not who did which part of it: the same in every shard, a merge and a single run.
        command: command_line_without(
            "host-sim",
            &["--merge", "--no-times"],
            &["--shard", "--work"],
        ),
        version: env!("CARGO_PKG_VERSION"),
        tree: env!("BNKF_TREE"),
        seed: args.subject.seed,
        scenario: campaign.scenario.name.clone(),
        scenario_sha256: campaign.scenario.sha256.clone(),
        data,
        data_sha256: sha256,
        flights: campaign.runs.segments(),
        runs: usize::from(args.subject.runs),
        recordings: recordings.len(),
        unplaced,
        remarks: Vec::new(),
        folds: campaign.folds.count,
        quick: args.subject.quick,
        tuning_flights: campaign.to_tune_on.len(),
        tuning_sha256: data_hash::of_flights(&campaign.to_tune_on),
        tuned_on: campaign.tuned_on.clone(),
        epochs: campaign.epochs,
        passes: args.passes,
        shipped: campaign.shipped.iter().map(ModelProvenance::from).collect(),
        methods: campaign.methods.clone(),
        recorded: campaign
            .own
            .iter()
            .filter_map(|own| Some((own.method(), own.recorded_sha256()?.to_owned())))
            .collect(),
        noise_tables: campaign.scenario.radar.tables.clone(),
    }
}

/// What the pieces depend on: not how a path or a command is spelt, but what stands there.
fn plan(campaign: &Campaign, provenance: &CampaignProvenance) -> String {
    let said = "every value has a representation";
    let mut plan = serde_json::to_value(provenance).expect(said);
    for key in ["command", "data", "remarks"] {
        plan.as_object_mut().expect(said).remove(key);
    }
    // Of the flights as they are measured: cut, placed, from where the radar stands.
    plan["segments_sha256"] = data_hash::of_flights(&campaign.runs.flights).into();
    plan["placed"] = campaign.placed.into();
    plan["steps"] = (campaign.detail == Detail::Estimates).into();
    serde_json::to_string_pretty(&plan).expect(said)
}

fn quick_note(campaign: &Campaign) -> String {
    format!(
        "quick run: {} flights, {} epochs instead of {EPOCHS}, angle figures as {} only; its figures are rough",
        campaign.runs.segments(),
        campaign.epochs,
        campaign.scenario.radar.tables[0],
    )
}

fn show(bar: &Mutex<Option<ProgressBar>>, told: Progress) {
    // A panic elsewhere has poisoned nothing that a progress bar needs.
    let mut bar = bar
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    match told {
        Progress::Stage(name, pieces) => {
            if let Some(before) = bar.replace(progress::bar(1000 * pieces, name)) {
                before.finish_and_clear();
            }
        }
        Progress::Advance(thousandths) => {
            if let Some(bar) = bar.as_ref() {
                bar.inc(thousandths);
            }
        }
    }
}
