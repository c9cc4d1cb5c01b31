//! Gradient of the data loss by the posterior of every weight.

use super::shape::PARAMETERS;
use crate::kernel::Aligned;

/// Gradient of the data loss by means and by variances.
#[derive(Clone, Debug)]
pub struct Gradient {
    pub(super) by_mean: Aligned,
    pub(super) by_variance: Aligned,
}

impl Gradient {
    /// Zero.
    pub fn zeros() -> Self {
        Self {
            by_mean: Aligned::zeros(PARAMETERS),
            by_variance: Aligned::zeros(PARAMETERS),
        }
    }

    /// Gradient by every mean.
    pub fn by_mean(&self) -> &[f32] {
        &self.by_mean
    }

    /// Adds another batch's.
    pub fn add(&mut self, other: &Self) {
        for (sum, term) in self.by_mean.iter_mut().zip(other.by_mean.iter()) {
            *sum += term;
        }
        for (sum, term) in self.by_variance.iter_mut().zip(other.by_variance.iter()) {
            *sum += term;
        }
    }

    pub(super) fn scale(&mut self, factor: f32) {
        for value in self.by_mean.iter_mut().chain(self.by_variance.iter_mut()) {
            *value *= factor;
        }
    }

    /// Euclidean norm by means and logarithms of sigmas.
    pub(super) fn norm(&self, log_sigmas: &[f32]) -> f32 {
        let mut sum = 0.0_f64;
        for i in 0..PARAMETERS {
            let by_log_sigma = 2.0 * (2.0 * log_sigmas[i]).exp() * self.by_variance[i];
            sum += f64::from(self.by_mean[i]).powi(2) + f64::from(by_log_sigma).powi(2);
        }
        sum.sqrt() as f32
    }
}
