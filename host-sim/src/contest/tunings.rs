//! The tuned baselines' parameters for every noise level of a radar.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
use bnkf_model_export::radar::reading::Reading;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::baseline::bound::{mean_distance_m, position_bounds};
use crate::baseline::prior::{PopulationPrior, PriorError};
use crate::baseline::tuning::{Tuning, TuningError};
use crate::scenario::radar::{Condition, Radar};
use crate::scoring::bootstrap::FlightSum;

/// One fit per noise table and level.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tunings(Vec<(NoiseTable, NoiseLevel, Tuning)>);

/// Why the baselines cannot be tuned.
#[derive(Clone, Debug, thiserror::Error)]
pub enum TuningsError {
    /// The flights have no usable population.
    #[error("tuning: {0}")]
    Prior(#[from] PriorError),
    /// The fit failed.
    #[error("tuning: {0}")]
    Fit(#[from] TuningError),
}

impl Tunings {
    /// Fits to `flights` as `radar` sees them, for each of `tables`, on all cores.
    ///
    /// # Errors
    /// There are no flights to fit to.
    pub fn fit(
        flights: &[&Flight],
        radar: &Radar,
        tables: &[NoiseTable],
        seed: u64,
    ) -> Result<Self, TuningsError> {
        let prior = PopulationPrior::fit(flights.iter().copied())?;
        let pairs: Vec<_> = tables
            .iter()
            .flat_map(|table| NoiseLevel::ALL.map(|level| (*table, level)))
            .collect();
        let fit = |&(table, level): &(NoiseTable, NoiseLevel)| {
            let measured = |flight: &Flight, rate| {
                let condition = Condition {
                    table,
                    noise: level,
                    rate,
                };
                radar.sightings(flight, condition, seed)
            };
            let tuning = Tuning::fit(prior, flights, &radar.rates, measured)?;
            Ok((table, level, tuning))
        };
        Ok(Self(
            pairs
                .par_iter()
                .map(fit)
                .collect::<Result<_, TuningError>>()?,
        ))
    }

    /// The fit for a table and level, if there is one.
    pub fn find(&self, table: NoiseTable, level: NoiseLevel) -> Option<&Tuning> {
        let entry = self
            .0
            .iter()
            .find(|entry| (entry.0, entry.1) == (table, level));
        entry.map(|(_, _, tuning)| tuning)
    }

    /// Mean distance (m) at each scored step below which no filter that believes in the fitted
    /// motion model can be; `None` without a tuning for the condition or if a matrix is singular.
    pub fn floor_m(
        &self,
        flight: &Flight,
        readings: &[Option<Reading>],
        condition: Condition,
    ) -> Option<FlightSum> {
        let tuning = self.find(condition.table, condition.noise)?;
        let bounds = position_bounds(&tuning.singer, &tuning.prior, flight, readings).ok()?;
        Some(FlightSum::of(bounds.iter().skip(1).map(mean_distance_m)))
    }

    /// Every fit with its place.
    pub fn iter(&self) -> impl Iterator<Item = &(NoiseTable, NoiseLevel, Tuning)> {
        self.0.iter()
    }
}
