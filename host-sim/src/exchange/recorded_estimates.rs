//! Estimates of a file as a method under test.

use std::collections::HashMap;
use std::sync::Arc;

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::reading::Reading;
use bnkf_model_export::radar::sampling::time_us;

use super::estimates::Estimates;
use crate::contest::own_filter::OwnFilter;
use crate::filter::{Filter, FilterError, Forecasts, HORIZONS_US, PositionEstimate, Start};
use crate::own_name::OwnName;
use crate::scenario::radar::Condition;

/// A filter that answers what stands in a file, whatever the readings are. A step that the file leaves out is
/// a step without an estimate.
struct Recorded {
    at: HashMap<u64, PositionEstimate>,
}

/// The method `name`, whose answers to `flights` under `conditions` are `estimates`.
pub fn method(
    name: OwnName,
    estimates: Estimates,
    flights: &[Flight],
    conditions: Vec<Condition>,
) -> OwnFilter {
    let numbers: HashMap<String, usize> = flights
        .iter()
        .enumerate()
        .map(|(number, flight)| (flight.name.clone(), number))
        .collect();
    let (sha256, estimates) = (estimates.sha256.clone(), Arc::new(estimates));
    OwnFilter::recorded(name, sha256, move |flight: &Flight, condition, _| {
        let number = numbers.get(&flight.name).copied();
        let condition = conditions.iter().position(|other| *other == condition);
        let mut at = HashMap::new();
        if let (Some(number), Some(condition)) = (number, condition) {
            for (step, sample) in flight.samples.iter().enumerate() {
                if let Some(estimate) = estimates.at(number, condition, step as u64) {
                    at.insert(time_us(flight, sample.time_s), *estimate);
                }
            }
        }
        Box::new(Recorded { at })
    })
}

impl Recorded {
    fn of(&self, time_us: u64) -> Result<PositionEstimate, FilterError> {
        self.at.get(&time_us).copied().ok_or(FilterError::NotInFile)
    }
}

impl Filter for Recorded {
    fn start(&mut self, start: &Start<'_>) -> Result<PositionEstimate, FilterError> {
        self.of(start.reading.time_us)
    }

    fn step(&mut self, time_us: u64, _: Option<&Reading>) -> Result<PositionEstimate, FilterError> {
        self.of(time_us)
    }

    fn forecast(&mut self, _: &[u64; HORIZONS_US.len()]) -> Result<Forecasts, FilterError> {
        Err(FilterError::NotInFile)
    }
}
