//! What the report shows beyond the sums: tracks of single flights, and what a step costs.

use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::NoiseLevel;

use super::tuning_choice::{Candidate, chosen};
use super::work_folder::WorkFolder;
use super::{Campaign, CampaignError};
use crate::contest::example::Example;
use crate::contest::flight_kind::first_of_each;
use crate::contest::runtime::{self, MethodTime};
use crate::method::Method;
use crate::scenario::radar::Condition;

/// Flights that are timed.
const TIMED: usize = 5;

impl Campaign {
    /// One flight per noise level with the tracks of those of `shown` that took part, each tested
    /// by its own fold's models and tuned as its cell is, at the second sampling rate: one with gaps.
    ///
    /// # Errors
    /// A piece of the finished run is missing or damaged.
    pub fn examples(
        &self,
        work: &WorkFolder,
        candidates: &[Candidate],
        shown: &[Method],
    ) -> Result<Vec<Example<'_>>, CampaignError> {
        let kits = self.kits(work)?;
        let shown: Vec<Method> = shown
            .iter()
            .copied()
            .filter(|method| self.methods.contains(method))
            .collect();
        let radar = &self.scenario.radar;
        let rate = radar.rates[1.min(radar.rates.len() - 1)];
        let kinds = first_of_each(self.runs.first());
        let example = |(number, noise): (usize, NoiseLevel)| {
            let index = kinds[number % kinds.len()];
            let flight = &self.runs.flights[index];
            let kit = &kits[0][self.folds.of_flight[index]];
            let condition = Condition {
                table: radar.tables[0],
                noise,
                rate,
            };
            let readings = radar.readings(flight, condition, self.seed);
            let mut tracks = Vec::new();
            for method in &shown {
                let tuned_on = chosen(candidates, *method, condition).unwrap_or(self.tuned_on[0]);
                let roster = self.roster(kit, tuned_on, &[*method])?;
                tracks.extend(roster.tracks(flight, &readings, condition, self.seed));
            }
            Ok(Example {
                flight,
                noise,
                rate,
                readings,
                tracks,
            })
        };
        NoiseLevel::ALL
            .into_iter()
            .enumerate()
            .map(example)
            .collect()
    }

    /// Times every method at high noise with all samples measured, on this thread.
    ///
    /// # Errors
    /// A piece of the finished run is missing or damaged.
    pub fn times(&self, work: &WorkFolder) -> Result<Vec<MethodTime>, CampaignError> {
        let kits = self.kits(work)?;
        let kit = &kits[0][0];
        let roster = self.roster(kit, self.tuned_on[0], &self.live_methods())?;
        let flights: Vec<_> = self.runs.flights.iter().take(TIMED).collect();
        let radar = &self.scenario.radar;
        let condition = Condition {
            table: radar.tables[0],
            noise: NoiseLevel::High,
            rate: SamplingRate::FULL,
        };
        Ok(runtime::measure(
            &roster, &flights, radar, condition, self.seed,
        ))
    }
}
