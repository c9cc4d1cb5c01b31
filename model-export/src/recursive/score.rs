//! How well a network tracks a set of encounters.

use super::batch::Batch;
use super::carry::Carry;
use super::correction::{cholesky, forward_substitute};
use super::encounter::Encounter;
use super::lanes::LANES;
use super::network::Weights;
use super::unrolled::{Programs, Unrolled};
use rayon::prelude::*;

/// 90th percentile of chi-square with three degrees of freedom.
const CHI2_90: f64 = 6.251_388_631_170_325;
/// Steps that are kept at a time.
const WINDOW: usize = 50;

/// Means over every step after the start, gaps included, nothing dropped.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// Mean distance between estimated and true position, metres.
    pub distance_m: f64,
    /// Mean normalised error squared of the position; three is honest.
    pub nees: f64,
    /// Share of steps whose error lies within the 90% ellipsoid.
    pub coverage90: f64,
    /// Mean negative log-likelihood of the true position, nats.
    pub surprise: f64,
    /// Steps.
    pub steps: f64,
    /// Encounters whose state was lost (no longer finite).
    pub lost: usize,
}

impl Score {
    /// Runs `weights` over every encounter.
    pub fn of(programs: &Programs, weights: &Weights, encounters: &[Encounter]) -> Self {
        let sums: Vec<Self> = encounters
            .par_chunks(2 * LANES)
            .map(|pair| Self::sums(programs, weights, pair))
            .collect();
        let total = sums.into_iter().fold(Self::default(), |mut total, part| {
            total.distance_m += part.distance_m;
            total.nees += part.nees;
            total.coverage90 += part.coverage90;
            total.surprise += part.surprise;
            total.steps += part.steps;
            total.lost += part.lost;
            total
        });
        Self {
            distance_m: total.distance_m / total.steps,
            nees: total.nees / total.steps,
            coverage90: total.coverage90 / total.steps,
            surprise: total.surprise / total.steps,
            ..total
        }
    }

    fn sums(programs: &Programs, weights: &Weights, encounters: &[Encounter]) -> Self {
        let batches = Batch::groups(encounters);
        let mut run = Unrolled::new(programs, batches.len(), WINDOW);
        run.begin(&batches);
        let mut sums = Self::default();
        let steps = batches.iter().map(Batch::steps).min().unwrap_or(0);
        let mut from = 0;
        while from < steps {
            let to = steps.min(from + WINDOW);
            let loss = run.forward(weights, &batches, from..to, from as u64);
            sums.surprise += loss.sum;
            sums.lost += loss.lost;
            for step in from..to {
                for (group, batch) in batches.iter().enumerate() {
                    let lanes = run.carry(step + 1 - from, group);
                    for lane in 0..LANES {
                        if batch.weights[step][lane] > 0.0 {
                            let flat: Vec<f64> = lanes.iter().map(|number| number[lane]).collect();
                            let truth = batch.truths_m[step].map(|axis| axis[lane]);
                            sums.add(&Carry::unflatten(&flat), truth);
                        }
                    }
                }
            }
            run.roll(to - from);
            from = to;
        }
        sums
    }

    fn add(&mut self, carry: &Carry<f64>, truth_m: [f64; 3]) {
        let error: [f64; 3] = core::array::from_fn(|axis| carry.state[axis] - truth_m[axis]);
        let block: [[f64; 3]; 3] = core::array::from_fn(|row| {
            core::array::from_fn(|column| carry.covariance[row][column])
        });
        let whitened = forward_substitute(&cholesky(&block), error);
        let nees: f64 = whitened.iter().map(|w| w * w).sum();
        self.distance_m += error.iter().map(|e| e * e).sum::<f64>().sqrt();
        self.nees += nees;
        self.coverage90 += f64::from(u8::from(nees < CHI2_90));
        self.steps += 1.0;
    }
}
