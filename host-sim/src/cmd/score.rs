//! `host-sim score`: anybody's estimates beside the built-in methods.

use std::path::{Path, PathBuf};

use super::evaluate::data::Data;
use super::evaluate::{self, EvaluateError};
use super::positive::positive;
use crate::contest::own_filter::OwnFilter;
use crate::exchange::columns::TableError;
use crate::exchange::estimates::{Estimates, Subject};
use crate::exchange::recorded_estimates;
use crate::own_name::{OwnName, OwnNameError};

/// Scores estimates from files beside the built-in methods: same readings, metrics, intervals, page.
///
/// Give the arguments of `evaluate` that the readings were written with (`readings`). A file has the columns
/// flight, noise, rate and step as the readings have them, x_m,y_m,z_m, and the covariance
/// xx_m2,xy_m2,xz_m2,yy_m2,yz_m2,zz_m2 (or --sigma-m). A step that it leaves out counts as a divergence: the last
/// estimate before it is scored in its place.
#[derive(Clone, Debug, clap::Args)]
#[group(id = "score")]
pub struct Args {
    /// Estimates: a CSV file, after the name that they have in the tables
    #[arg(long = "estimates", value_name = "NAME=FILE", required = true, value_parser = entry)]
    pub entries: Vec<Entry>,
    /// Standard deviation on every axis, metres, of estimates without a covariance; refused if all have one
    #[arg(long, value_name = "M", value_parser = positive)]
    pub sigma_m: Option<f64>,
    /// What is evaluated.
    #[command(flatten)]
    pub evaluation: evaluate::Args,
}

/// Estimates and their name.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// What they are called.
    pub name: OwnName,
    /// The file.
    pub path: PathBuf,
}

/// Why nothing was scored.
#[derive(Debug, thiserror::Error)]
pub enum ScoreError {
    /// `--sigma-m` beside files that all have a covariance.
    #[error("--sigma-m is for estimates without a covariance, and these have one")]
    IdleSigma,
    /// A file cannot be used.
    #[error(transparent)]
    Estimates(#[from] TableError),
    /// The evaluation.
    #[error(transparent)]
    Evaluation(#[from] EvaluateError),
}

/// Runs the command.
///
/// # Errors
/// See [`ScoreError`].
pub fn run(args: &Args) -> Result<(), ScoreError> {
    let scenario = evaluate::scenario(&args.evaluation.subject).map_err(EvaluateError::from)?;
    // Before the files are read, not after it.
    let own: Vec<_> = args.entries.iter().map(|own| own.path.clone()).collect();
    evaluate::prepare(&args.evaluation, &own)?;
    let data = Data::of(&args.evaluation.subject, &scenario)?;
    let conditions = scenario.radar.conditions();
    let subject = Subject {
        flights: &data.runs.flights,
        conditions: &conditions,
    };
    let mut own: Vec<OwnFilter> = Vec::new();
    let mut is_sigma_used = false;
    for Entry { name, path } in &args.entries {
        let estimates = Estimates::read(path, subject, args.sigma_m)?;
        is_sigma_used |= !estimates.has_covariance;
        let (scored, wanted) = (estimates.scored(), subject.steps());
        if scored < wanted {
            eprintln!(
                "warning: {}: estimates of {scored} of {wanted} steps; the others count as divergences",
                path.display()
            );
        }
        let (flights, conditions) = (&data.runs.flights, conditions.clone());
        own.push(recorded_estimates::method(
            *name, estimates, flights, conditions,
        ));
    }
    if args.sigma_m.is_some() && !is_sigma_used {
        return Err(ScoreError::IdleSigma);
    }
    evaluate::evaluate_with(&args.evaluation, own)?;
    Ok(())
}

fn entry(text: &str) -> Result<Entry, String> {
    let (name, path) = text
        .split_once('=')
        .filter(|(_, path)| !path.is_empty())
        .ok_or("expected NAME=FILE")?;
    let name = OwnName::new(name).map_err(|error: OwnNameError| error.to_string())?;
    Ok(Entry {
        name,
        path: Path::new(path).to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::entry;

    #[test]
    fn entries_are_a_name_and_a_file() {
        let found = entry("my filter=a=b.csv").unwrap();
        assert_eq!(
            (found.name.get(), found.path.to_str()),
            ("my filter", Some("a=b.csv"))
        );
        for wrong in ["x", "x=", "=a.csv", "<b>=a.csv"] {
            assert!(entry(wrong).is_err(), "{wrong}");
        }
    }
}
