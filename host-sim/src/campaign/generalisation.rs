//! How methods fare in worlds that they were not fitted to.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::fold_kit::FoldKit;
use super::variation::Variation;
use super::work_folder::WorkFolder;
use super::{Campaign, CampaignError, Progress, Watcher};
use crate::method::Method;
use crate::scenario::radar::Condition;
use crate::scoring::cell::{CellMetrics, ScoredStep};

/// Flights of each world: this part of the campaign's, at least [`FLIGHTS_MIN`].
const FLIGHTS_PART: usize = 4;
const FLIGHTS_MIN: usize = 4;

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

impl Campaign {
    /// Every method in every [`Variation`] at the first and the last sampling rate, with the models
    /// of the first fold, filters tuned on generated flights, and flights that no fold has seen.
    ///
    /// # Errors
    /// Flights cannot be generated or a piece cannot be kept.
    pub(super) fn generalise(
        &self,
        kit: &FoldKit,
        work: &WorkFolder,
        watcher: Watcher<'_>,
    ) -> Result<Vec<VariedCell>, CampaignError> {
        let radar = &self.scenario.radar;
        let ends = [radar.rates.first(), radar.rates.last()];
        let conditions: Vec<Condition> = radar
            .conditions()
            .into_iter()
            .filter(|condition| {
                condition.table == radar.tables[0] && ends.contains(&Some(&condition.rate))
            })
            .collect();
        let pairs: Vec<_> = (0..Variation::ALL.len())
            .flat_map(|variation| {
                (0..conditions.len()).map(move |condition| (variation, condition))
            })
            .collect();
        watcher(Progress::Stage("Generalising", pairs.len()));
        let block = |&(variation, number): &(usize, usize)| {
            let name = format!("variation-{variation:02}-{number}");
            let kept: Option<Vec<(Method, CellMetrics)>> = work.load(&name)?;
            let condition = conditions[number];
            let rows = match kept {
                Some(rows) => rows,
                None => {
                    let rows = self.varied(&Variation::ALL[variation], kit, condition)?;
                    work.store(&name, &rows)?;
                    rows
                }
            };
            watcher(Progress::Advance(1000));
            let cell = |(method, metrics)| VariedCell {
                variation: Variation::ALL[variation].name.to_owned(),
                method,
                condition,
                metrics,
            };
            Ok(rows.into_iter().map(cell).collect::<Vec<_>>())
        };
        let blocks: Result<Vec<_>, CampaignError> = pairs.par_iter().map(block).collect();
        Ok(blocks?.into_iter().flatten().collect())
    }

    fn varied(
        &self,
        variation: &Variation,
        kit: &FoldKit,
        condition: Condition,
    ) -> Result<Vec<(Method, CellMetrics)>, CampaignError> {
        let count = (self.runs.first / FLIGHTS_PART).max(FLIGHTS_MIN);
        let flights = variation.flights(&self.scenario, count, self.seed)?;
        let radar = variation.radar(&self.scenario);
        let methods = self.live_methods();
        let roster = self.roster(kit, self.tuned_on[0], &methods)?;
        let mut steps: Vec<Vec<ScoredStep>> = vec![Vec::new(); methods.len()];
        for flight in &flights {
            let readings = radar.readings(flight, condition, self.seed);
            let tracks = roster.tracks(flight, &readings, condition, self.seed);
            for (all, (_, own)) in steps.iter_mut().zip(tracks) {
                all.extend(own.iter().map(|step| step.scored));
            }
        }
        let cells = methods.iter().zip(&steps);
        Ok(cells
            .map(|(method, steps)| (*method, CellMetrics::new(steps)))
            .collect())
    }
}
