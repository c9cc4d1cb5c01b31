//! One network in training: its weights, Adam's moments, and the best weights so far.

use crate::blob::grid::{Channel, Grid};
use crate::kernel::{self, AdamStep, Tier, adam};
use crate::memoryless::gradient::Gradient;
use crate::posterior::gaussian_weights::GaussianWeights;
use std::borrow::Cow;

/// Adam's running moments of the gradients, in the flat order of the weights.
#[derive(Clone, Debug, PartialEq)]
pub struct AdamMoments {
    /// First moment, means.
    pub mean_first: Vec<f32>,
    /// Second moment, means.
    pub mean_second: Vec<f32>,
    /// First moment, log sigmas.
    pub log_sigma_first: Vec<f32>,
    /// Second moment, log sigmas.
    pub log_sigma_second: Vec<f32>,
}

/// The weights with the lowest held-out loss so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Best {
    /// The weights.
    pub weights: GaussianWeights,
    /// Their held-out loss.
    pub loss: f64,
    /// The epoch after which they were found, from 1.
    pub epoch: u32,
}

/// One network in training.
#[derive(Clone, Debug, PartialEq)]
pub struct Member {
    /// First of the three axes that it estimates.
    pub first_target: usize,
    /// Current weights.
    pub weights: GaussianWeights,
    /// Adam's moments.
    pub moments: AdamMoments,
    /// Best weights so far; on the grid once there is one.
    pub best: Option<Best>,
    /// Best weights before the means were put on the grid, once they are.
    pub unrounded: Option<Best>,
    grid: Option<Grid>,
}

impl Member {
    /// A member that starts from `weights`.
    #[must_use]
    pub fn new(first_target: usize, weights: GaussianWeights) -> Self {
        let zeros = || vec![0.0; weights.means.len()];
        let moments = AdamMoments {
            mean_first: zeros(),
            mean_second: zeros(),
            log_sigma_first: zeros(),
            log_sigma_second: zeros(),
        };
        Self {
            first_target,
            weights,
            moments,
            best: None,
            unrounded: None,
            grid: None,
        }
    }

    /// Continues from the best weights so far with their means on the int8 grid.
    pub fn start_grid(&mut self) {
        if let Some(best) = self.best.take() {
            let start = Self::new(self.first_target, best.weights.clone());
            *self = Self {
                unrounded: Some(best),
                ..start
            };
            self.restore_grid();
        }
    }

    /// Makes the grid again after `unrounded` was read back.
    pub fn restore_grid(&mut self) {
        self.grid = self.unrounded.as_ref().map(|Best { weights, .. }| {
            Grid::of(&weights.means, Channel::all_of(&weights.architecture))
        });
    }

    /// The weights that loss and gradient are computed at.
    #[must_use]
    pub fn effective(&self) -> Cow<'_, GaussianWeights> {
        match &self.grid {
            None => Cow::Borrowed(&self.weights),
            Some(grid) => {
                let mut weights = self.weights.clone();
                grid.round(&mut weights.means);
                Cow::Owned(weights)
            }
        }
    }

    /// Moves the weights down `gradient`, which was computed at [`Member::effective`].
    pub fn step(&mut self, tier: Tier, step: AdamStep, gradient: &Gradient) {
        let posterior = kernel::Posterior {
            means: &mut self.weights.means,
            log_sigmas: &mut self.weights.log_sigmas,
        };
        let moments = kernel::Moments {
            mean_first: &mut self.moments.mean_first,
            mean_second: &mut self.moments.mean_second,
            log_sigma_first: &mut self.moments.log_sigma_first,
            log_sigma_second: &mut self.moments.log_sigma_second,
        };
        adam(
            tier,
            step,
            &gradient.by_mean,
            &gradient.by_variance,
            posterior,
            moments,
        );
    }

    /// Takes note of a held-out loss; returns whether it is the lowest so far.
    pub fn note(&mut self, loss: f64, epoch: u32) -> bool {
        let better = self.best.as_ref().is_none_or(|best| loss < best.loss);
        if better {
            self.best = Some(Best {
                weights: self.effective().into_owned(),
                loss,
                epoch,
            });
        }
        better
    }
}
