//! How well a network tracks a set of encounters.

use super::batch::Batch;
use super::carry::Carry;
use super::encounter::Encounter;
use super::network::weights::Weights;
use super::step_programs::Programs;
use super::unrolled::{LOSS_LIMIT, Unrolled};
use crate::autodiff::lanes::LANES;
use bnkf::cholesky::{cholesky, forward_substitute};
use rayon::prelude::*;
use serde::Serialize;

/// 90% quantile of chi-square for three degrees of freedom: a covariance is honest if 90% of the
/// squared Mahalanobis distances lie below it.
pub const QUANTILE_90_DOF_3: f64 = 6.251_388_631_170_325;
/// Steps that are kept at a time.
const WINDOW: usize = 50;

/// Means over every step after the start, gaps included, nothing dropped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Score {
    /// Mean distance between estimated and true position, metres.
    pub distance_m: f64,
    /// Mean normalised error squared of the position; three is honest.
    pub nees: f64,
    /// Share of steps whose error lies within the 90% ellipsoid.
    pub coverage90: f64,
    /// Mean negative log-likelihood of the true position, nats; a step counts at most
    /// [`LOSS_LIMIT`].
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
        sums.into_iter().fold(Self::default(), Self::join).mean()
    }

    fn sums(programs: &Programs, weights: &Weights, encounters: &[Encounter]) -> Self {
        let batches = Batch::groups(encounters);
        let mut run = Unrolled::new(programs, batches.len(), WINDOW, 0.0);
        run.begin(&batches);
        let mut sums = Self::default();
        let steps = batches.iter().map(Batch::steps).min().unwrap_or(0);
        let mut from = 0;
        while from < steps {
            let to = steps.min(from + WINDOW);
            let loss = run.forward(weights, &batches, from..to, from as u64);
            sums.lost += loss.lost;
            for step in from..to {
                for (group, batch) in batches.iter().enumerate() {
                    let lanes = run.carry(step + 1 - from, group);
                    for lane in 0..LANES {
                        if batch.weights[step][lane] > 0.0 {
                            let flat: Vec<f64> = lanes.iter().map(|number| number[lane]).collect();
                            let truth = batch.truths_m[step].map(|axis| axis[lane]);
                            let carry = Carry::unflatten(&flat);
                            let error = core::array::from_fn(|i| carry.state[i] - truth[i]);
                            let block = core::array::from_fn(|row| {
                                core::array::from_fn(|column| carry.covariance[row][column])
                            });
                            sums.add(error, &block);
                        }
                    }
                }
            }
            run.roll(to - from);
            from = to;
        }
        sums
    }

    /// Adds one step to sums: the error and the covariance of an estimated position.
    pub(super) fn add(&mut self, error_m: [f64; 3], covariance_m2: &[[f64; 3]; 3]) {
        let factor = cholesky(covariance_m2);
        let whitened = forward_substitute(&factor, error_m);
        let nees: f64 = whitened.iter().map(|w| w * w).sum();
        let ln_root: f64 = (0..3).map(|axis| factor[axis][axis].ln()).sum();
        let surprise = 1.5 * core::f64::consts::TAU.ln() + 0.5 * nees + ln_root;
        self.surprise += if surprise < LOSS_LIMIT {
            surprise
        } else {
            LOSS_LIMIT
        };
        self.distance_m += error_m.iter().map(|e| e * e).sum::<f64>().sqrt();
        self.nees += nees;
        self.coverage90 += f64::from(u8::from(nees < QUANTILE_90_DOF_3));
        self.steps += 1.0;
    }

    /// Adds the sums of another part.
    pub(super) fn join(mut self, part: Self) -> Self {
        self.distance_m += part.distance_m;
        self.nees += part.nees;
        self.coverage90 += part.coverage90;
        self.surprise += part.surprise;
        self.steps += part.steps;
        self.lost += part.lost;
        self
    }

    /// Means from sums.
    pub(super) fn mean(self) -> Self {
        Self {
            distance_m: self.distance_m / self.steps,
            nees: self.nees / self.steps,
            coverage90: self.coverage90 / self.steps,
            surprise: self.surprise / self.steps,
            ..self
        }
    }
}
