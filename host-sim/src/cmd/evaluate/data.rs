//! The flights of a cross-validation, and where they came from.

use std::path::Path;

use bnkf_model_export::data_hash;
use bnkf_model_export::flight_set::{FlightSet, FlightSetError, Preparation};
use bnkf_model_export::generator::{GeneratorSettings, generate};
use bnkf_model_export::seed;

use super::{Args, EvaluateError};
use crate::runs::Runs;
use crate::scenario::Scenario;

/// Flights of a cross-validation.
pub struct Data {
    /// The segments, run after run.
    pub runs: Runs,
    /// Where they came from.
    pub source: String,
    /// SHA-256 of the flights as they came.
    pub sha256: String,
    /// Segments that do not fit into the volume, and why.
    pub unplaced: Vec<String>,
    /// What was assumed and what is suspicious about them.
    pub remarks: Vec<String>,
}

impl Data {
    /// Recorded flights if `args` name some, else generated ones.
    pub fn of(args: &Args, scenario: &Scenario) -> Result<Self, EvaluateError> {
        match &args.flights {
            Some(path) => Ok(Self::recorded(path, args, scenario)?),
            None => Self::generated(args, scenario),
        }
    }

    fn recorded(path: &Path, args: &Args, scenario: &Scenario) -> Result<Self, FlightSetError> {
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
            unplaced,
            remarks,
        })
    }

    fn generated(args: &Args, scenario: &Scenario) -> Result<Self, EvaluateError> {
        let settings = GeneratorSettings {
            flights: if args.quick {
                scenario.quick_count
            } else {
                scenario.count
            },
            seed: args.seed,
            duration_s: scenario.duration_s,
            rate_hz: scenario.rate_hz,
            speed_scale: scenario.speed_scale,
            size_scale: scenario.size_scale,
            timing_jitter_s: 0.0,
            volume: scenario.volume,
        };
        let generated = generate(&settings)?;
        let sha256 = data_hash::of_flights(&generated);
        let segments: Vec<_> = generated
            .iter()
            .map(|flight| flight.seen_from(args.radar.0))
            .collect();
        Ok(Self {
            runs: Runs::new(vec![segments; usize::from(args.runs)]),
            source: format!("built-in generator, seed {}", args.seed),
            sha256,
            unplaced: Vec::new(),
            remarks: Vec::new(),
        })
    }
}
