//! How well a network tracks a set of encounters.

use super::batch::Batch;
use super::carry::Carry;
use super::encounter::Encounter;
use super::network::weights::Weights;
use super::step_programs::Programs;
use super::unrolled::Unrolled;
use crate::autodiff::lanes::LANES;
use crate::scoring::means::{Means, Sums};
use rayon::prelude::*;
use serde::Serialize;

/// Steps that are kept at a time.
const WINDOW: usize = 50;

/// Means over every step after the start, gaps included, nothing dropped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Score {
    /// What was found.
    #[serde(flatten)]
    pub means: Means,
    /// Encounters whose state was lost (no longer finite).
    pub lost: usize,
}

impl Score {
    /// Runs `weights` over every encounter.
    pub fn of(programs: &Programs, weights: &Weights, encounters: &[Encounter]) -> Self {
        let parts: Vec<(Sums, usize)> = encounters
            .par_chunks(2 * LANES)
            .map(|pair| Self::sums(programs, weights, pair))
            .collect();
        let (sums, lost) = parts.into_iter().fold(
            (Sums::default(), 0),
            |(sums, lost), (part, lost_in_part)| (sums.join(part), lost + lost_in_part),
        );
        Self {
            means: sums.means(),
            lost,
        }
    }

    fn sums(programs: &Programs, weights: &Weights, encounters: &[Encounter]) -> (Sums, usize) {
        let batches = Batch::groups(encounters);
        let mut run = Unrolled::new(programs, batches.len(), WINDOW, 0.0);
        run.begin(&batches);
        let (mut sums, mut lost) = (Sums::default(), 0);
        let steps = batches.iter().map(Batch::steps).min().unwrap_or(0);
        let mut from = 0;
        while from < steps {
            let to = steps.min(from + WINDOW);
            let loss = run.forward(weights, &batches, from..to, from as u64);
            lost += loss.lost;
            for step in from..to {
                for (group, batch) in batches.iter().enumerate() {
                    let lanes = run.carry(step + 1 - from, group);
                    for lane in 0..LANES {
                        if batch.weights[step][lane] > 0.0 {
                            let flat: Vec<f64> = lanes.iter().map(|number| number[lane]).collect();
                            let truth = batch.truths_m[step].map(|axis| axis[lane]);
                            let carry = Carry::unflatten(&flat);
                            sums.add(&carry.score(truth));
                        }
                    }
                }
            }
            run.roll(to - from);
            from = to;
        }
        (sums, lost)
    }
}
