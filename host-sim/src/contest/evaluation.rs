//! Every method over every segment, noise level and rate, on the same readings.

use bnkf_model_export::flights::flight::{Flight, Motion};
use bnkf_model_export::radar::reading::Reading;
use rayon::prelude::*;

use crate::contest::roster::Roster;
use crate::contest::track::TrackStep;
use crate::method::Method;
use crate::scenario::radar::{Condition, Radar};
use crate::scoring::binned::binned;
use crate::scoring::cell::{Cell, CellMetrics, ScoredStep};
use crate::scoring::forecast::{ForecastCell, ScoredForecast};

/// What is evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Evaluation<'a> {
    /// Flights, already cut into segments.
    pub segments: &'a [Flight],
    /// The methods.
    pub roster: &'a Roster<'a>,
    /// The blocks of the table.
    pub conditions: &'a [Condition],
    /// The radar.
    pub radar: &'a Radar,
    /// Seed of the radar's noise and of the methods that draw.
    pub seed: u64,
}

impl Evaluation<'_> {
    /// Number of (segment, condition) pairs that [`Evaluation::run`] works through.
    pub fn units(&self) -> usize {
        self.segments.len() * self.conditions.len()
    }

    /// What the radar reports of `segment`.
    pub fn readings(&self, segment: &Flight, condition: Condition) -> Vec<Option<Reading>> {
        self.radar.readings(segment, condition, self.seed)
    }

    /// All cells, ordered by condition, then method. Works on all threads of the current rayon
    /// pool and calls `done` after each unit.
    pub fn run(&self, done: &(dyn Fn() + Sync)) -> Cells {
        let unit = |index: usize| {
            let condition = self.conditions[index / self.segments.len()];
            let segment = &self.segments[index % self.segments.len()];
            let readings = self.readings(segment, condition);
            let tracks = self
                .roster
                .tracks_ahead(segment, &readings, condition, self.seed);
            let tracks: Vec<Tracked> = tracks.into_iter().map(Tracked::from).collect();
            done();
            tracks
        };
        let units: Vec<_> = (0..self.units()).into_par_iter().map(unit).collect();
        let mut cells = Cells::default();
        for (condition, units) in self
            .conditions
            .iter()
            .zip(units.chunks(self.segments.len().max(1)))
        {
            for (index, method) in self.roster.methods().enumerate() {
                let own = || {
                    units
                        .iter()
                        .flat_map(|tracks| &tracks[index].steps)
                        .copied()
                };
                let steps: Vec<_> = own().map(|(_, scored)| scored).collect();
                let Condition { noise, rate, .. } = *condition;
                cells.tracking.push(Cell {
                    method,
                    noise,
                    rate,
                    metrics: CellMetrics::new(&steps),
                    bins: binned(own().map(|(motion, scored)| (motion, scored.score))),
                });
                let forecasts = units.iter().flat_map(|tracks| &tracks[index].forecasts);
                let forecasts: Vec<_> = forecasts.collect();
                let own = ForecastCell::all(method, *condition, &forecasts);
                cells.forecasts.extend(own);
            }
        }
        cells
    }
}

/// What an evaluation sums up to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cells {
    /// Estimates at the time of the readings and gaps.
    pub tracking: Vec<Cell>,
    /// Forecasts.
    pub forecasts: Vec<ForecastCell>,
}

/// What is kept of one method over one segment.
struct Tracked {
    steps: Vec<(Motion, ScoredStep)>,
    forecasts: Vec<ScoredForecast>,
}

impl From<(Method, Vec<TrackStep>, Vec<ScoredForecast>)> for Tracked {
    fn from((_, steps, forecasts): (Method, Vec<TrackStep>, Vec<ScoredForecast>)) -> Self {
        let step = |step: TrackStep| (step.motion, step.scored);
        Self {
            steps: steps.into_iter().map(step).collect(),
            forecasts,
        }
    }
}
