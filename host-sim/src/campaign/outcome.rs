//! What a campaign sums up to.

use bnkf_model_export::radar::noise::NoiseTable;
use rayon::prelude::*;
use serde::Serialize;

use super::cell_summary::{CellSummary, Track};
use super::comparison::{Comparison, comparisons};
use super::forecast_summary::{self, FlightForecasts, ForecastComparison, ForecastSummary};
use super::generalisation::VariedCell;
use super::tuning_choice::{Candidate, chosen};
use crate::campaign::steps_parquet::FlightTracks;
use crate::contest::runs::Runs;
use crate::method::Method;
use crate::scenario::radar::Condition;
use crate::scoring::bootstrap::{FlightSum, mean};
use crate::scoring::cell::Cell;
use crate::scoring::forecast::ForecastCell;

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
    /// Every step, as a Parquet file.
    pub parquet: Vec<u8>,
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

/// All flights under one condition.
#[derive(Clone, Copy, Debug)]
pub struct Block<'a> {
    /// The condition.
    pub condition: Condition,
    /// The flights with their tracks, and the bound's sum for each.
    pub flights: &'a [FlightTracks<'a>],
    /// The bound of each flight; `None` where it has none.
    pub floors: &'a [Option<FlightSum>],
    /// Cluster of each flight.
    pub clusters: &'a [usize],
    /// The methods in the order of the tracks.
    pub methods: &'a [Method],
    /// What the tuned methods are shown with.
    pub candidates: &'a [Candidate],
    /// Number of folds.
    pub folds: usize,
    /// Seed of the bootstrap.
    pub seed: u64,
}

impl Block<'_> {
    /// Cells, comparisons and bound of the block.
    pub fn sum_up(&self) -> (Vec<CellSummary>, Vec<Comparison>, Floor) {
        let mut tracks: Vec<(Method, Vec<Track<'_>>)> = Vec::new();
        for (index, method) in self.methods.iter().enumerate() {
            let mut own = Vec::new();
            for (of, cluster) in self.flights.iter().zip(self.clusters) {
                own.push(Track {
                    steps: &of.tracks[index].steps,
                    fold: of.fold,
                    cluster: *cluster,
                });
            }
            tracks.push((*method, own));
        }
        let summary = |(method, tracks): &(Method, Vec<Track<'_>>)| CellSummary {
            tuned_on: chosen(self.candidates, *method, self.condition),
            ..CellSummary::new(*method, self.condition, tracks, self.folds, self.seed)
        };
        let cells = tracks.par_iter().map(summary).collect();
        let floors: Option<Vec<FlightSum>> = self.floors.iter().copied().collect();
        let floor = Floor {
            condition: self.condition,
            ed_m: floors.map_or(f64::NAN, |floors| mean(&floors)),
        };
        (
            cells,
            comparisons(self.condition, &tracks, self.seed),
            floor,
        )
    }
}

impl Block<'_> {
    /// The block's forecasts, and every pair of methods in them.
    pub fn sum_up_forecasts(&self) -> (Vec<ForecastSummary>, Vec<ForecastComparison>) {
        let forecasts = |index: usize| {
            let of = self.flights.iter().zip(self.clusters);
            of.map(|(of, cluster)| FlightForecasts {
                forecasts: &of.tracks[index].forecasts,
                cluster: *cluster,
            })
            .collect()
        };
        let methods: Vec<(Method, Vec<FlightForecasts<'_>>)> = self
            .methods
            .iter()
            .enumerate()
            .map(|(index, method)| (*method, forecasts(index)))
            .collect();
        forecast_summary::sum_up(self.condition, &methods, self.seed)
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
