//! What a campaign sums up to.

use std::io::Write;
use std::ops::Range;

use bnkf_model_export::radar::noise::NoiseTable;
use serde::Serialize;

use super::block::{Block, Place, Places};
use super::cell_summary::CellSummary;
use super::comparison::Comparison;
use super::forecast_summary::{ForecastComparison, ForecastSummary};
use super::generalisation::VariedCell;
use super::steps_parquet::{Detail, FlightTracks, StepsFile};
use super::tuning_choice::{Candidate, keep_chosen};
use super::work_folder::WorkFolder;
use super::{Campaign, CampaignError, Progress, Watcher, unit};
use crate::contest::runs::Runs;
use crate::scenario::radar::Condition;
use crate::scoring::cell::Cell;
use crate::scoring::forecast::ForecastCell;

/// Flights whose pieces stand in memory at a time.
const FLIGHTS_AT_ONCE: usize = 32;

/// With fewer recordings than this, the bootstrap draws flights (segments) instead of recordings.
const RECORDINGS_MIN: usize = 10;

/// What came out.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// One per condition and method.
    pub cells: Vec<CellSummary>,
    /// Every tuned method with each of its sets of parameters; the cells show the chosen ones.
    pub candidates: Vec<Candidate>,
    /// Every pair of methods under every condition.
    pub comparisons: Vec<Comparison>,
    /// One per condition, method and horizon.
    pub forecasts: Vec<ForecastSummary>,
    /// Every pair of methods under every condition at every horizon.
    pub forecast_comparisons: Vec<ForecastComparison>,
    /// Every method in every other world.
    pub variations: Vec<VariedCell>,
    /// The bound of every condition.
    pub floors: Vec<Floor>,
    /// What the bootstrap draws.
    pub cluster: Cluster,
}

impl Outcome {
    /// The cells of one noise table, without what only a campaign knows.
    pub fn plain_cells(&self, table: NoiseTable) -> Vec<Cell> {
        let own = self.cells.iter();
        own.filter(|cell| cell.condition.table == table)
            .map(Cell::from)
            .collect()
    }

    /// The forecasts of one noise table, without their intervals.
    pub fn forecast_cells(&self, table: NoiseTable) -> Vec<ForecastCell> {
        let own = self.forecasts.iter().map(|summary| summary.cell);
        own.filter(|cell| cell.condition.table == table).collect()
    }
}

/// Mean ED below which no filter that believes in the fitted motion model can be (posterior
/// Cramer-Rao bound).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Floor {
    /// The condition.
    #[serde(flatten)]
    pub condition: Condition,
    /// Bound on the mean ED, metres; NaN where it has none.
    pub ed_m: f64,
}

/// What the bootstrap draws as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Cluster {
    /// All flights of one recording.
    Recording,
    /// Single flights with their runs: there are too few recordings to draw from.
    Flight,
}

impl Campaign {
    /// Sums the finished pieces up, and writes every step into `steps`, a Parquet file. However many flights there
    /// are, a few of them stand in memory at a time.
    ///
    /// # Errors
    /// A piece is missing or damaged; `steps` takes no more.
    pub fn sum_up(
        &self,
        work: &WorkFolder,
        steps: impl Write + Send,
        watcher: Watcher<'_>,
    ) -> Result<Outcome, CampaignError> {
        let conditions = self.scenario.radar.conditions();
        watcher(Progress::Stage("Summing up", conditions.len()));
        let (cluster, of_flight) = clusters(&self.runs);
        let places = Places {
            folds: self.folds.count,
            clusters: of_flight.iter().max().map_or(0, |last| last + 1),
        };
        let place = |flight: usize| Place {
            fold: self.folds.of_flight[flight],
            cluster: of_flight[flight],
        };
        let mut file = StepsFile::new(steps, self.detail)?;
        let mut outcome = Outcome {
            cells: Vec::new(),
            candidates: Vec::new(),
            comparisons: Vec::new(),
            forecasts: Vec::new(),
            forecast_comparisons: Vec::new(),
            variations: self.varied_cells(work)?,
            floors: Vec::new(),
            cluster,
        };
        for (number, condition) in conditions.iter().enumerate() {
            let mut block = Block::new(*condition, &self.methods, &self.tuned_on, places);
            for flights in self.at_once() {
                let units = self.finished(work, number, flights.clone())?;
                let placed = flights.clone().map(place).zip(units).collect::<Vec<_>>();
                let first = unit::name(number, flights.start);
                block.add(&placed).map_err(|_| work.damaged(&first))?;
            }
            let sums = block.sum_up(self.seed);
            // Again from the pieces: which fits are shown is known only now.
            for flights in self.at_once() {
                let units = self.finished(work, number, flights.clone())?;
                for (index, unit) in flights.zip(units) {
                    let flight = &self.runs.flights[index];
                    let readings = match self.detail {
                        Detail::Scores => Vec::new(),
                        Detail::Estimates => {
                            let radar = &self.scenario.radar;
                            radar.readings(flight, *condition, self.seed)
                        }
                    };
                    let tracks = FlightTracks {
                        flight,
                        fold: self.folds.of_flight[index],
                        readings,
                        tracks: keep_chosen(
                            &sums.candidates,
                            *condition,
                            &self.methods,
                            unit.tracks,
                        ),
                    };
                    file.add(*condition, tracks)?;
                }
            }
            outcome.cells.extend(sums.cells);
            outcome.candidates.extend(sums.candidates);
            outcome.comparisons.extend(sums.comparisons);
            outcome.forecasts.extend(sums.forecasts);
            outcome
                .forecast_comparisons
                .extend(sums.forecast_comparisons);
            outcome.floors.push(sums.floor);
            watcher(Progress::Advance(1000));
        }
        file.finish()?;
        Ok(outcome)
    }

    /// The flights' numbers, a few at a time.
    fn at_once(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        let count = self.runs.flights.len();
        let starts = (0..count).step_by(FLIGHTS_AT_ONCE);
        starts.map(move |start| start..(start + FLIGHTS_AT_ONCE).min(count))
    }
}

/// What the bootstrap draws from `runs`, and the number of each flight's cluster. All runs of a
/// flight are drawn together.
pub fn clusters(runs: &Runs) -> (Cluster, Vec<usize>) {
    let mut sources: Vec<&str> = Vec::new();
    let mut of_flight = Vec::new();
    for flight in &runs.flights {
        let known = sources.iter().position(|source| *source == flight.source);
        of_flight.push(known.unwrap_or(sources.len()));
        if known.is_none() {
            sources.push(&flight.source);
        }
    }
    if sources.len() < RECORDINGS_MIN {
        return (Cluster::Flight, runs.segment_of.clone());
    }
    (Cluster::Recording, of_flight)
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Flight;

    use super::{Cluster, clusters};
    use crate::contest::runs::Runs;

    #[test]
    fn few_recordings_are_drawn_by_flight() {
        let rows = [
            [0.0, 1.0, 2.0, 3.0],
            [1.0, 2.0, 2.0, 3.0],
            [2.0, 3.0, 2.0, 3.0],
        ];
        let flight =
            |i: usize| Flight::from_track(&format!("f{i}"), &format!("s{}", i / 2), &rows).unwrap();
        let flights: Vec<_> = (0..20).map(flight).collect();
        let runs = |count: usize| Runs::new(vec![flights[..count].to_vec(); 2]);
        let (cluster, of_flight) = clusters(&runs(20));
        assert_eq!(cluster, Cluster::Recording);
        assert_eq!(of_flight[..5], [0, 0, 1, 1, 2]);
        assert_eq!(of_flight[20..23], [0, 0, 1]);
        let (cluster, of_flight) = clusters(&runs(18));
        assert_eq!(cluster, Cluster::Flight);
        assert_eq!(of_flight[..3], [0, 1, 2]);
        assert_eq!(of_flight[18..21], [0, 1, 2]);
    }
}
