//! How methods fare in worlds that they were not fitted to.

use bnkf_model_export::flights::flight::Flight;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::fold_kit::FoldKit;
use super::shard::Shard;
use super::variation::Variation;
use super::work_folder::{WorkFolder, WorkFolderError};
use super::{Campaign, CampaignError, Progress, Watcher};
use crate::method::Method;
use crate::scenario::radar::Condition;
use crate::scoring::cell::{CellMetrics, CellSums};

/// Flights of each world: this part of the campaign's, within these bounds. A hundred tell what a world does to a
/// method; more would only take time and memory.
const FLIGHTS_PART: usize = 4;
const FLIGHTS_MIN: usize = 4;
const FLIGHTS_MAX: usize = 100;

/// One method in one world under one condition.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct VariedCell {
    /// Name of the [`Variation`].
    pub variation: String,
    /// The method.
    pub method: Method,
    /// The condition.
    #[serde(flatten)]
    pub condition: Condition,
    /// Metrics over all steps.
    #[serde(flatten)]
    pub metrics: CellMetrics,
}

/// A world and the number of its condition among [`Campaign::varied_conditions`].
type Piece = (usize, usize);

fn name((variation, condition): Piece) -> String {
    format!("variation-{variation:02}-{condition}")
}

impl Campaign {
    /// Those at the first and the last sampling rate.
    fn varied_conditions(&self) -> Vec<Condition> {
        let radar = &self.scenario.radar;
        let ends = [radar.rates.first(), radar.rates.last()];
        let is_one = |condition: &Condition| {
            condition.table == radar.tables[0] && ends.contains(&Some(&condition.rate))
        };
        radar.conditions().into_iter().filter(is_one).collect()
    }

    fn varied_pieces(&self) -> Vec<Piece> {
        let conditions = self.varied_conditions().len();
        (0..Variation::ALL.len())
            .flat_map(|variation| (0..conditions).map(move |condition| (variation, condition)))
            .collect()
    }

    /// Names of the pieces.
    pub(super) fn varied_names(&self) -> impl Iterator<Item = String> {
        self.varied_pieces().into_iter().map(name)
    }

    /// Makes those pieces of `shard` that `work` lacks: every method in every [`Variation`] at the first and the last
    /// sampling rate, with the models of the first fold, filters tuned on generated flights, and flights that no
    /// fold has seen.
    ///
    /// # Errors
    /// Flights cannot be generated or a piece cannot be kept.
    pub(super) fn generalise(
        &self,
        kit: &FoldKit,
        work: &WorkFolder,
        shard: Shard,
        watcher: Watcher<'_>,
    ) -> Result<(), CampaignError> {
        let conditions = self.varied_conditions();
        let pieces = self.varied_pieces();
        watcher(Progress::Stage("Generalising", shard.size(pieces.len())));
        let own = pieces.par_iter().enumerate();
        let own = own.filter(|(index, _)| shard.holds(*index));
        own.try_for_each(|(_, &(variation, condition))| {
            let name = name((variation, condition));
            if !work.has(&name) {
                let rows = self.varied(&Variation::ALL[variation], kit, conditions[condition])?;
                work.store(&name, &rows)?;
            }
            watcher(Progress::Advance(1000));
            Ok(())
        })
    }

    /// What the finished pieces hold.
    ///
    /// # Errors
    /// One is missing or damaged.
    pub(super) fn varied_cells(
        &self,
        work: &WorkFolder,
    ) -> Result<Vec<VariedCell>, WorkFolderError> {
        let conditions = self.varied_conditions();
        let mut cells = Vec::new();
        for (variation, condition) in self.varied_pieces() {
            let name = name((variation, condition));
            let rows: Option<Vec<(Method, CellMetrics)>> = work.load(&name)?;
            let rows = rows.ok_or_else(|| work.missing(vec![name]))?;
            cells.extend(rows.into_iter().map(|(method, metrics)| VariedCell {
                variation: Variation::ALL[variation].name.to_owned(),
                method,
                condition: conditions[condition],
                metrics,
            }));
        }
        Ok(cells)
    }

    /// `count` flights of another world.
    ///
    /// # Errors
    /// The scenario's flights do not fit it.
    pub(super) fn varied_flights(
        &self,
        variation: &Variation,
        count: usize,
    ) -> Result<Vec<Flight>, CampaignError> {
        let flights = variation.flights(&self.scenario, count, self.seed);
        flights.map_err(|cause| CampaignError::Generator {
            variation: variation.name,
            cause,
        })
    }

    fn varied(
        &self,
        variation: &Variation,
        kit: &FoldKit,
        condition: Condition,
    ) -> Result<Vec<(Method, CellMetrics)>, CampaignError> {
        let count = (self.runs.first / FLIGHTS_PART).clamp(FLIGHTS_MIN, FLIGHTS_MAX);
        let flights = self.varied_flights(variation, count)?;
        let radar = variation.radar(&self.scenario);
        let methods = self.live_methods();
        let roster = self.roster(kit, self.tuned_on[0], &methods)?;
        let mut sums = vec![CellSums::default(); methods.len()];
        for flight in &flights {
            let readings = radar.readings(flight, condition, self.seed);
            let tracks = roster.tracks(flight, &readings, condition, self.seed);
            for (sums, (_, own)) in sums.iter_mut().zip(tracks) {
                own.iter().for_each(|step| sums.add(&step.scored));
            }
        }
        let cells = methods.into_iter().zip(&sums);
        Ok(cells
            .map(|(method, sums)| (method, sums.metrics()))
            .collect())
    }
}
