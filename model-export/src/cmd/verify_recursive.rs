//! `model-export verify` of a recursive blob: what rounding and single precision cost.

use super::flight_source::{FlightSource, FlightSourceError};
use crate::flights::generator::generate;
use crate::posterior::gaussian_weights::GaussianWeights;
use crate::recursive::committee::{Committee, CommitteeError, Followed};
use crate::recursive::comparison::{Comparison, compare, table};
use crate::recursive::model::RecursiveModel;
use crate::recursive::scenario::Scenario;
use bnkf::blob::Blob;
use bnkf::{Inference, PassesError, TrackerError};
use rayon::prelude::*;
use std::io::Write as _;

/// Trials of a cell that are enough for the figure of the spread.
const SPREAD_TRIALS: usize = 16;

/// Options that only a recursive blob has.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Options for a recursive blob")]
pub struct RecursiveArgs {
    /// Noises and rates, and the flights when none are named
    #[arg(long, value_enum, default_value_t = Scenario::Paper)]
    scenario: Scenario,
    /// Monte Carlo passes of the tracker; 1 takes every weight at its mean
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=100))]
    tracker_passes: u16,
    /// Factor on the speed of the built-in flights: motion that no training sees
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, conflicts_with_all = ["flights", "builtin"])]
    speed: f64,
    /// Factor on the size of the built-in flights
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, conflicts_with_all = ["flights", "builtin"])]
    size: f64,
}

impl RecursiveArgs {
    /// The first option that is not at its default: a memoryless blob has none of them.
    pub fn first_given(&self) -> Option<&'static str> {
        [
            ("--scenario", self.scenario != Scenario::Paper),
            ("--tracker-passes", self.tracker_passes != 1),
            ("--speed", self.speed != 1.0),
            ("--size", self.size != 1.0),
        ]
        .into_iter()
        .find_map(|(option, given)| given.then_some(option))
    }
}

/// Why a recursive blob is not verified.
#[derive(Debug, thiserror::Error)]
pub enum VerifyRecursiveError {
    /// The unrounded weights are of another network.
    #[error("the unrounded weights are not those of a recursive blob")]
    OtherNetwork,
    /// No flights.
    #[error(transparent)]
    Source(#[from] FlightSourceError),
    /// The blob gives no opinions.
    #[error(transparent)]
    Committee(#[from] CommitteeError),
    /// No such number of passes.
    #[error("{0}")]
    Passes(#[from] PassesError),
    /// The tracker cannot be made.
    #[error("{0}")]
    Tracker(TrackerError),
    /// A cell differs too much.
    #[error("the blob differs from its unrounded weights in: {0}")]
    Rejected(String),
    /// Standard output was closed.
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
}

/// Prints both beside each other, cell by cell.
///
/// # Errors
/// See [`VerifyRecursiveError`]. Only mean weights are held to the limits: sampled ones are another
/// estimator.
pub fn verify(
    blob: Blob<'_>,
    weights: &GaussianWeights,
    source: &FlightSource,
    args: &RecursiveArgs,
    moments: bool,
    seed: u64,
) -> Result<(), VerifyRecursiveError> {
    let model =
        RecursiveModel::of_blob(&blob, weights).ok_or(VerifyRecursiveError::OtherNetwork)?;
    let flights = if source.flights.is_some() || source.builtin.is_some() {
        source.load(seed)?.flights
    } else {
        let mut settings = args.scenario.held_out_flights();
        settings.speed_scale *= args.speed;
        settings.size_scale *= args.size;
        generate(&settings).map_err(FlightSourceError::from)?
    };
    let cells = args.scenario.cells(&flights, seed);
    let inference = if moments {
        Inference::Moments
    } else {
        Inference::of_passes(args.tracker_passes)?
    };
    let found = compare(&model, blob, &cells, inference).map_err(VerifyRecursiveError::Tracker)?;
    let mut text = table(&found);
    if inference != Inference::Mean {
        text += &format!(
            "\nSpread of the mean jerk by {inference}, and what it adds to the scheduled jerk noise\n"
        );
        let committee = Committee::new(&[blob], inference)?;
        for cell in &cells {
            let steps: Vec<Followed> = cell
                .encounters(committee.population())
                .par_iter()
                .take(SPREAD_TRIALS)
                .enumerate()
                .flat_map_iter(|(index, encounter)| committee.follow(encounter, index as u64))
                .collect();
            let mean = |value: fn(&Followed) -> f64| {
                steps.iter().map(value).sum::<f64>() / steps.len() as f64
            };
            text += &format!(
                "{:<16}{:>10.3} m/s^3{:>10.2} %\n",
                cell.name,
                mean(|step| step.jerk_variance).sqrt(),
                100.0 * mean(|step| step.noise_share)
            );
        }
    }
    std::io::stdout().write_all(text.as_bytes())?;
    let differing: Vec<&str> = found
        .iter()
        .filter(|comparison| !comparison.accepted())
        .map(|comparison: &Comparison| comparison.cell.as_str())
        .collect();
    if differing.is_empty() || inference != Inference::Mean {
        Ok(())
    } else {
        Err(VerifyRecursiveError::Rejected(differing.join(", ")))
    }
}
