//! The built-in or given models on recorded flights.

use std::io::Write as _;
use std::path::Path;

use bnkf_model_export::cmd::remarks;
use bnkf_model_export::command_line::command_line;
use bnkf_model_export::flights::set::{FlightSet, Preparation};
use bnkf_model_export::flights::volume::Volume;

use super::{Args, EvaluateError, methods_or, with_given};
use crate::cmd::progress;
use crate::contest::default_models;
use crate::contest::evaluation::Evaluation;
use crate::contest::model::Model;
use crate::contest::own_filter::OwnFilter;
use crate::contest::roster::{Roster, Supplies};
use crate::method::Method;
use crate::report::results_json::{self, ModelProvenance, Provenance, Results};
use crate::report::{by_motion, forecasts, table};
use crate::scenario::radar::Radar;

/// Writes the JSON file, if one was asked for, and prints the table.
pub fn run(args: &Args, flights: &Path, own: &[OwnFilter]) -> Result<(), EvaluateError> {
    super::prepare(args, &[])?;
    let results = evaluate(args, flights, own)?;
    if let Some(path) = &args.json {
        results_json::write(path, &results)?;
    }
    // Only now: a closed pipe costs no results.
    let (table, motion) = (
        table::render(&results.cells),
        by_motion::text(&results.cells),
    );
    let ahead = forecasts::text(&results.forecasts);
    std::io::stdout().write_all(format!("{table}\n{ahead}\n{motion}").as_bytes())?;
    Ok(())
}

fn evaluate(args: &Args, flights: &Path, own: &[OwnFilter]) -> Result<Results, EvaluateError> {
    let methods = methods_or(args, &Method::DEFAULT, own);
    let models = with_given(default_models::load()?, &args.models, &methods)?;
    let mut given = models.iter().rev().take(args.models.len());
    let expected = given.find_map(Model::volume);
    let preparation = Preparation {
        reading: args.subject.reading.clone(),
        expected: expected.unwrap_or(Volume::PAPER),
        segment_s: args.subject.segment_s,
        volume: args.subject.place.then_some(Volume::PAPER),
        radar_m: args.subject.radar.0,
        seed: args.subject.seed,
    };
    let set = FlightSet::read(flights, &preparation)?;
    remarks::say(&set.remarks, &set.unplaced);
    let supplies = Supplies {
        models: &models,
        passes: args.passes,
        tunings: None,
        tuned: None,
        own,
    };
    let roster = Roster::new(&methods, supplies)?;
    let noise_table = args.subject.noise_table.unwrap_or_default();
    let radar = Radar::paper(noise_table);
    let evaluation = Evaluation {
        segments: &set.segments,
        roster: &roster,
        conditions: &radar.conditions(),
        radar: &radar,
        seed: args.subject.seed,
    };
    let bar = progress::bar(evaluation.units(), "Evaluating");
    let cells = evaluation.run(&|| bar.inc(1));
    bar.finish_and_clear();
    let provenance = Provenance {
        command: command_line("host-sim"),
        version: env!("CARGO_PKG_VERSION"),
        tree: env!("BNKF_TREE"),
        seed: args.subject.seed,
        data: flights.display().to_string(),
        data_sha256: set.sha256,
        flights: set.flights,
        segments: set.segments.len(),
        unplaced: set.unplaced,
        remarks: set.remarks,
        segment_s: args.subject.segment_s,
        placed: args.subject.place,
        radar_m: args.subject.radar.0,
        noise_table,
        passes: args.passes,
        models: models.iter().map(ModelProvenance::from).collect(),
    };
    Ok(Results {
        cells: cells.tracking,
        forecasts: cells.forecasts,
        provenance,
    })
}
