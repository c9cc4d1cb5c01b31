//! `host-sim evaluate`: the table of methods on recorded flights.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use bnkf_model_export::atomic_file::AtomicWriteError;
use bnkf_model_export::command_line::command_line;
use bnkf_model_export::noise::NoiseTable;
use bnkf_model_export::segment::PAPER_SEGMENT_S;
use bnkf_model_export::volume::Volume;

use crate::evaluation::Evaluation;
use crate::method::Method;
use crate::model::{Model, ModelError};
use crate::radar::Radar;
use crate::results_json::{self, ModelProvenance, Provenance, Results};
use crate::roster::{Roster, RosterError, Supplies};
use crate::{default_models, progress, table};
use bnkf_model_export::flight_set::{FlightSet, FlightSetError, Preparation};

/// Scores every method on recorded flights, at three noise levels and three sampling rates.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Folder of flight files (.csv or .txt: timestamp,tx,ty,tz), or one file
    #[arg(long, value_name = "PATH")]
    pub flights: PathBuf,
    /// Moves every segment at random (yaw, mirror, shift) into the paper's volume
    #[arg(long)]
    pub place: bool,
    /// Position of the radar in the flights' frame, metres
    #[arg(long, value_name = "X,Y,Z", default_value = "0,0,0", value_parser = position_m, allow_hyphen_values = true)]
    pub radar: Position,
    /// Length of the segments that flights are cut into, seconds; 0 keeps them whole
    #[arg(long, value_name = "S", default_value_t = PAPER_SEGMENT_S)]
    pub segment_s: f64,
    /// How the angle figures of the noise levels are read: radians, or degrees as printed
    #[arg(long, value_enum, default_value_t = NoiseTable::Radians)]
    pub noise_table: NoiseTable,
    /// Blob that replaces the built-in one of its kind: one network serves BNN and BNKF, three BNKFe
    #[arg(long = "model", value_name = "BLOB")]
    pub models: Vec<PathBuf>,
    /// Methods, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = Method::PAPER)]
    pub methods: Vec<Method>,
    /// Monte Carlo passes per estimate (default: each model's own number)
    #[arg(long, value_name = "N")]
    pub passes: Option<u16>,
    /// Seed of placement, radar noise and Monte Carlo passes
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Writes cells and provenance to this file
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// A point, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position(pub [f64; 3]);

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
        Ok(position) if position.iter().all(|value| value.is_finite()) => Ok(Position(position)),
        Ok(_) => Err("a coordinate is not finite".to_owned()),
        Err(numbers) => Err(format!("{} numbers, three are needed", numbers.len())),
    }
}

/// Why an evaluation failed.
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// No flights.
    #[error(transparent)]
    Flights(#[from] FlightSetError),
    /// A blob cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A method cannot run.
    #[error(transparent)]
    Roster(#[from] RosterError),
    /// A method is named twice.
    #[error("method {0} is named twice")]
    Twice(Method),
    /// The folder of the result file is missing. Found before the run, not after it.
    #[error("{}: its folder does not exist", .0.display())]
    NoFolder(PathBuf),
    /// The result file cannot be written.
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
    let results = evaluate(args)?;
    std::io::stdout().write_all(table::render(&results.cells).as_bytes())?;
    if let Some(path) = &args.json {
        results_json::write(path, &results)?;
    }
    Ok(())
}

fn evaluate(args: &Args) -> Result<Results, EvaluateError> {
    for (index, method) in args.methods.iter().enumerate() {
        if args.methods[..index].contains(method) {
            return Err(EvaluateError::Twice(*method));
        }
    }
    if let Some(path) = &args.json {
        check_folder(path)?;
    }
    let preparation = Preparation {
        segment_s: args.segment_s,
        volume: args.place.then_some(Volume::PAPER),
        radar_m: args.radar.0,
        seed: args.seed,
    };
    let set = FlightSet::read(&args.flights, &preparation)?;
    for reason in &set.unplaced {
        eprintln!("warning: left out: {reason}");
    }
    let mut models = default_models::load()?;
    for path in &args.models {
        models.push(Model::read(path)?);
    }
    let supplies = Supplies {
        models: &models,
        passes: args.passes,
        tunings: None,
    };
    let roster = Roster::new(&args.methods, supplies)?;
    let radar = Radar::paper(args.noise_table);
    let evaluation = Evaluation {
        segments: &set.segments,
        roster: &roster,
        conditions: &radar.conditions(),
        radar: &radar,
        seed: args.seed,
    };
    let bar = progress::bar(evaluation.units(), "Evaluating");
    let cells = evaluation.run(&|| bar.inc(1));
    bar.finish_and_clear();
    let provenance = Provenance {
        command: command_line("host-sim"),
        version: env!("CARGO_PKG_VERSION"),
        seed: args.seed,
        data: args.flights.display().to_string(),
        data_sha256: set.sha256,
        flights: set.flights,
        segments: set.segments.len(),
        unplaced: set.unplaced,
        segment_s: args.segment_s,
        placed: args.place,
        radar_m: args.radar.0,
        noise_table: args.noise_table,
        passes: args.passes,
        models: models.iter().map(ModelProvenance::from).collect(),
    };
    Ok(Results { cells, provenance })
}

fn check_folder(path: &Path) -> Result<(), EvaluateError> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => {
            Err(EvaluateError::NoFolder(path.to_owned()))
        }
        _ => Ok(()),
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
    }
}
