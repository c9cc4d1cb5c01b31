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
    pub fn run(&self, done: &(dyn Fn() + Sync)) -> Vec<Cell> {
        let unit = |index: usize| {
            let condition = self.conditions[index / self.segments.len()];
            let segment = &self.segments[index % self.segments.len()];
            let readings = self.readings(segment, condition);
            let scored = |(_, steps): (Method, Vec<TrackStep>)| {
                let step = |step: TrackStep| (step.motion, step.scored);
                steps.into_iter().map(step).collect()
            };
            let tracks: Vec<Vec<(Motion, ScoredStep)>> = self
                .roster
                .tracks(segment, &readings, condition, self.seed)
                .into_iter()
                .map(scored)
                .collect();
            done();
            tracks
        };
        let units: Vec<_> = (0..self.units()).into_par_iter().map(unit).collect();
        let mut cells = Vec::new();
        for (condition, units) in self
            .conditions
            .iter()
            .zip(units.chunks(self.segments.len().max(1)))
        {
            for (index, method) in self.roster.methods().enumerate() {
                let own = || units.iter().flat_map(|tracks| &tracks[index]).copied();
                let steps: Vec<_> = own().map(|(_, scored)| scored).collect();
                let Condition { noise, rate, .. } = *condition;
                cells.push(Cell {
                    method,
                    noise,
                    rate,
                    metrics: CellMetrics::new(&steps),
                    bins: binned(own().map(|(motion, scored)| (motion, scored.score))),
                });
            }
        }
        cells
    }
}
