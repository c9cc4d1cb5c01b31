//! The flights of a cross-validation, and where they came from.

use std::path::Path;

use bnkf_model_export::flights::data_hash;
use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::set::{FlightSet, FlightSetError, Preparation};
use bnkf_model_export::seed;

use super::{EvaluateError, Subject};
use crate::baseline::tuning::FLIGHTS_MAX;
use crate::campaign::fold_kit::TUNING_SEED;
use crate::contest::runs::Runs;
use crate::contest::tuned_on::TunedOn;
use crate::scenario::Scenario;

/// Seconds of generated flight to tune on.
const TUNING_S: f64 = 4500.0;

/// Flights of a cross-validation.
pub struct Data {
    /// The segments, run after run.
    pub runs: Runs,
    /// Where they came from.
    pub source: String,
    /// SHA-256 of the flights as they came.
    pub sha256: String,
    /// Generated flights to tune on, of another seed.
    pub to_tune_on: Vec<Flight>,
    /// What filters are tuned on.
    pub tuned_on: Vec<TunedOn>,
    /// Segments that do not fit into the volume, and why.
    pub unplaced: Vec<String>,
    /// What was assumed and what is suspicious about them.
    pub remarks: Vec<String>,
}

impl Data {
    /// Recorded flights if `args` name some, else generated ones.
    pub fn of(args: &Subject, scenario: &Scenario) -> Result<Self, EvaluateError> {
        if args.seed == TUNING_SEED {
            return Err(EvaluateError::TuningSeed);
        }
        let count = args
            .tuning_flights
            .map_or_else(|| flights_to_tune_on(scenario), usize::from);
        let to_tune_on = seen(&scenario.flights(count, TUNING_SEED)?, args);
        match &args.flights {
            Some(path) => Ok(Self::recorded(path, args, scenario, to_tune_on)?),
            None => Self::generated(args, scenario, to_tune_on),
        }
    }

    fn recorded(
        path: &Path,
        args: &Subject,
        scenario: &Scenario,
        to_tune_on: Vec<Flight>,
    ) -> Result<Self, FlightSetError> {
        let (mut runs, mut sha256, mut unplaced) = (Vec::new(), String::new(), Vec::new());
        let mut remarks = Vec::new();
        for run in 0..u64::from(args.runs) {
            let preparation = Preparation {
                reading: args.reading.clone(),
                expected: scenario.volume,
                segment_s: args.segment_s,
                volume: args.place.then_some(scenario.volume),
                radar_m: args.radar.0,
                seed: match run {
                    0 => args.seed,
                    _ => seed::derive(args.seed, &[seed::name_id("run"), run]),
                },
            };
            let set = FlightSet::read(path, &preparation)?;
            runs.push(set.segments);
            sha256 = set.sha256;
            if run == 0 {
                remarks = set.remarks;
            }
            for reason in set.unplaced {
                // What never fits is said once.
                if run == 0 {
                    unplaced.push(reason);
                } else if !unplaced.contains(&reason) {
                    unplaced.push(format!("run {}: {reason}", run + 1));
                }
            }
        }
        Ok(Self {
            runs: Runs::new(runs),
            source: path.display().to_string(),
            sha256,
            to_tune_on,
            tuned_on: TunedOn::ALL.to_vec(),
            unplaced,
            remarks,
        })
    }

    fn generated(
        args: &Subject,
        scenario: &Scenario,
        to_tune_on: Vec<Flight>,
    ) -> Result<Self, EvaluateError> {
        let count = if args.quick {
            scenario.quick_count
        } else {
            scenario.count
        };
        let generated = scenario.flights(count, args.seed)?;
        let sha256 = data_hash::of_flights(&generated);
        let segments = seen(&generated, args);
        Ok(Self {
            runs: Runs::new(vec![segments; usize::from(args.runs)]),
            source: format!("built-in generator, seed {}", args.seed),
            sha256,
            to_tune_on,
            // The other folds' flights are generated, too, and fewer.
            tuned_on: vec![TunedOn::Generated],
            unplaced: Vec::new(),
            remarks: Vec::new(),
        })
    }
}

/// As many flights as a fit of about a minute on one core allows.
fn flights_to_tune_on(scenario: &Scenario) -> usize {
    let count = TUNING_S / scenario.duration_s;
    (count as usize).clamp(10, FLIGHTS_MAX)
}

/// `flights` from where the radar stands.
fn seen(flights: &[Flight], args: &Subject) -> Vec<Flight> {
    let from = |flight: &Flight| flight.seen_from(args.radar.0);
    flights.iter().map(from).collect()
}
