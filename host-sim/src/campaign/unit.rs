//! One flight under one condition with every method: the smallest piece of a campaign.

use std::ops::Range;

use bnkf_model_export::flights::flight::Flight;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::fold_kit::FoldKit;
use super::shard::Shard;
use super::step_record::{EstimateRecord, MethodSteps, StepRecord};
use super::steps_parquet::Detail;
use super::work_folder::{WorkFolder, WorkFolderError};
use super::{Campaign, CampaignError, Progress, Watcher};
use crate::contest::roster::RosterError;
use crate::contest::tuned_on::TunedOn;
use crate::contest::tunings::Tunings;
use crate::filter::HORIZONS_US;
use crate::scenario::radar::Condition;
use crate::scoring::bootstrap::FlightSum;

/// What is kept of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Unit {
    /// Every method with each of its fits.
    pub tracks: Vec<MethodSteps>,
    /// Sum of the bound over the scored steps, metres, by every motion model.
    pub floors_m: Vec<(TunedOn, Option<FlightSum>)>,
}

/// The name of a piece.
pub fn name(condition: usize, flight: usize) -> String {
    format!("unit-{condition:03}-{flight:06}")
}

impl Unit {
    /// Whether it can be of `flight`: damage that the format does not show.
    fn is_of(&self, flight: &Flight) -> bool {
        let steps = flight.samples.len() - 1;
        self.tracks.iter().all(|track| {
            track.steps.len() == steps
                && (track.estimates.is_empty() || track.estimates.len() == steps)
                && track
                    .forecasts
                    .iter()
                    .all(|forecast| forecast.horizon < HORIZONS_US.len())
        })
    }
}

impl Campaign {
    /// Makes those of the units of `shard` that `work` lacks: every method over every flight under every condition.
    pub(super) fn make_units(
        &self,
        kits: &[Vec<FoldKit>],
        work: &WorkFolder,
        shard: Shard,
        watcher: Watcher<'_>,
    ) -> Result<(), CampaignError> {
        let conditions = self.scenario.radar.conditions();
        let flights = self.runs.flights.len();
        let count = conditions.len() * flights;
        watcher(Progress::Stage("Evaluating", shard.size(count)));
        let own = (0..count).into_par_iter().filter(|unit| shard.holds(*unit));
        own.try_for_each(|unit| {
            let (number, flight) = (unit / flights, unit % flights);
            let name = name(number, flight);
            if !work.has(&name) {
                let condition = conditions[number];
                let tables = &self.scenario.radar.tables;
                let table = tables.iter().position(|table| *table == condition.table);
                let kit =
                    &kits[table.expect("a table of the scenario")][self.folds.of_flight[flight]];
                work.store(
                    &name,
                    &self.unit(kit, &self.runs.flights[flight], condition)?,
                )?;
            }
            watcher(Progress::Advance(1000));
            Ok(())
        })
    }

    fn unit(
        &self,
        kit: &FoldKit,
        flight: &Flight,
        condition: Condition,
    ) -> Result<Unit, RosterError> {
        let readings = self.scenario.radar.readings(flight, condition, self.seed);
        let mut all = Vec::new();
        for tuned_on in &self.tuned_on {
            let roster = self.roster(kit, *tuned_on, &self.methods)?;
            let tracks = roster.tracks_ahead(flight, &readings, condition, self.seed);
            for (method, steps, forecasts) in tracks {
                all.push(MethodSteps {
                    forecasts,
                    method,
                    tuned_on: method.is_tuned().then_some(*tuned_on),
                    steps: steps.iter().map(StepRecord::from).collect(),
                    estimates: match self.detail {
                        Detail::Scores => Vec::new(),
                        Detail::Estimates => steps.iter().map(EstimateRecord::from).collect(),
                    },
                });
            }
        }
        let floor_m = |(on, tunings): &(TunedOn, Tunings)| {
            (*on, tunings.floor_m(flight, &readings, condition))
        };
        Ok(Unit {
            tracks: all,
            floors_m: kit.tunings.iter().map(floor_m).collect(),
        })
    }

    /// The finished units of `flights` under one condition, in the flights' order.
    pub(super) fn finished(
        &self,
        work: &WorkFolder,
        condition: usize,
        flights: Range<usize>,
    ) -> Result<Vec<Unit>, WorkFolderError> {
        let load = |flight: usize| {
            let name = name(condition, flight);
            let unit: Unit = work
                .load(&name)?
                .ok_or_else(|| work.missing(vec![name.clone()]))?;
            if !unit.is_of(&self.runs.flights[flight]) {
                return Err(work.damaged(&name));
            }
            Ok(unit)
        };
        flights.into_par_iter().map(load).collect()
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Flight;
    use bnkf_model_export::scoring::step_score::StepScore;

    use super::{MethodSteps, StepRecord, Unit};
    use crate::method::Method;
    use crate::scoring::forecast::ScoredForecast;

    /// What reads as a unit and cannot be this flight's would be a panic later, or a false table.
    #[test]
    fn a_unit_of_another_flight_is_noticed() {
        let step = StepRecord::of_test(1.0, 1.0);
        let unit = |steps: usize, horizon: usize| Unit {
            tracks: vec![MethodSteps {
                method: Method::Ekf,
                tuned_on: None,
                steps: vec![step; steps],
                estimates: Vec::new(),
                forecasts: vec![ScoredForecast {
                    horizon,
                    score: StepScore::UNUSABLE,
                    diverged: true,
                }],
            }],
            floors_m: Vec::new(),
        };
        let rows = [0.0, 1.0, 2.0].map(|t| [t, 1.0 + t, 2.0, 3.0]);
        let flight = Flight::from_track("a", "a", &rows).unwrap();
        assert!(unit(2, 2).is_of(&flight));
        assert!(!unit(3, 2).is_of(&flight) && !unit(2, 3).is_of(&flight));
    }
}
