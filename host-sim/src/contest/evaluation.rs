//! Every method over every segment, noise level and rate, on the same readings.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::reading::Reading;
use rayon::prelude::*;

use crate::contest::roster::Roster;
use crate::contest::track::TrackStep;
use crate::scenario::radar::{Condition, Radar};
use crate::scoring::binned::Binned;
use crate::scoring::cell::{Cell, CellSums};
use crate::scoring::forecast::{ForecastCell, ForecastSums, ScoredForecast};

/// Segments that are flown before their tracks are summed up.
const SEGMENTS_AT_ONCE: usize = 64;

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
    /// pool and calls `done` after each unit. A few segments' tracks stand in memory at a time.
    pub fn run(&self, done: &(dyn Fn() + Sync)) -> Cells {
        let mut cells = Cells::default();
        for condition in self.conditions {
            let mut all: Vec<Sums> = self.roster.methods().map(|_| Sums::default()).collect();
            for segments in self.segments.chunks(SEGMENTS_AT_ONCE) {
                let unit = |segment: &Flight| {
                    let readings = self.readings(segment, *condition);
                    let tracks = self
                        .roster
                        .tracks_ahead(segment, &readings, *condition, self.seed);
                    done();
                    tracks
                };
                let units: Vec<_> = segments.par_iter().map(unit).collect();
                all.par_iter_mut().enumerate().for_each(|(index, sums)| {
                    for tracks in &units {
                        let (_, steps, forecasts) = &tracks[index];
                        sums.add(steps, forecasts);
                    }
                });
            }
            for (method, sums) in self.roster.methods().zip(&all) {
                let Condition { noise, rate, .. } = *condition;
                cells.tracking.push(Cell {
                    method,
                    noise,
                    rate,
                    metrics: sums.cell.metrics(),
                    bins: sums.bins.bins(),
                });
                cells
                    .forecasts
                    .extend(sums.forecasts.cells(method, *condition));
            }
        }
        cells
    }
}

/// One method under one condition, under construction.
#[derive(Clone, Debug, Default)]
struct Sums {
    cell: CellSums,
    bins: Binned,
    forecasts: ForecastSums,
}

impl Sums {
    fn add(&mut self, steps: &[TrackStep], forecasts: &[ScoredForecast]) {
        for step in steps {
            self.cell.add(&step.scored);
            self.bins.add(&step.motion, &step.scored.score);
        }
        for forecast in forecasts {
            self.forecasts.add(forecast);
        }
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
