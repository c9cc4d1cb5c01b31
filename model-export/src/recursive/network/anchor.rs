//! A prior for weights that were learned before: each weight's own mean and deviation, not zero and
//! one for all.

use super::gradient::Gradient;
use super::shape::PARAMETERS;
use super::{INITIAL_SIGMA, Network};
use crate::kernel::Aligned;

/// A Gaussian for every weight.
#[derive(Clone, Debug)]
pub struct Anchor {
    means: Aligned,
    precisions: Aligned,
}

impl Anchor {
    /// The posterior of `network`, its deviations times `width`.
    pub fn posterior(network: &Network, width: f64) -> Self {
        Self::new(network, |i| width * f64::from(network.log_sigmas[i]).exp())
    }

    /// The means of `network`, with one deviation for all: the median of its own, times `width`.
    pub fn isotropic(network: &Network, width: f64) -> Self {
        let mut sigmas: Vec<f32> = network.log_sigmas.to_vec();
        // Padding has the deviation that it started with.
        sigmas.retain(|ln_sigma| *ln_sigma != INITIAL_SIGMA.ln());
        let middle = sigmas.len() / 2;
        let median = if sigmas.is_empty() {
            f64::from(INITIAL_SIGMA)
        } else {
            f64::from(*sigmas.select_nth_unstable_by(middle, f32::total_cmp).1).exp()
        };
        Self::new(network, |_| width * median)
    }

    fn new(network: &Network, sigma: impl Fn(usize) -> f64) -> Self {
        let mut precisions = Aligned::zeros(PARAMETERS);
        for (i, precision) in precisions.iter_mut().enumerate() {
            let sigma = sigma(i);
            *precision = (1.0 / (sigma * sigma)).min(1e12) as f32;
        }
        Self {
            means: network.means.clone(),
            precisions,
        }
    }

    /// Adds `weight` times the gradient of the divergence of the posterior of `network` from this.
    pub fn pull(&self, network: &Network, weight: f32, gradient: &mut Gradient) {
        for i in 0..PARAMETERS {
            let precision = self.precisions[i];
            gradient.by_mean[i] += weight * precision * (network.means[i] - self.means[i]);
            let own = (-2.0 * network.log_sigmas[i]).exp();
            gradient.by_variance[i] += 0.5 * weight * (precision - own);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Divergence of one Gaussian from another.
    fn divergence(mean: f64, ln_sigma: f64, anchor_mean: f64, precision: f64) -> f64 {
        let variance = (2.0 * ln_sigma).exp();
        let away = mean - anchor_mean;
        0.5 * (precision * (variance + away * away) - 1.0 - (precision * variance).ln())
    }

    #[test]
    fn the_pull_is_the_gradient_of_the_divergence() {
        let shipped = Network::new(2);
        let anchor = Anchor::posterior(&shipped, 3.0);
        let mut network = shipped.clone();
        network.means[5] += 0.02;
        network.log_sigmas[5] -= 0.4;
        let mut gradient = Gradient::zeros();
        anchor.pull(&network, 0.5, &mut gradient);
        let (mean, ln_sigma) = (
            f64::from(network.means[5]),
            f64::from(network.log_sigmas[5]),
        );
        let (from, precision) = (f64::from(shipped.means[5]), f64::from(anchor.precisions[5]));
        let h = 1e-6;
        let by_mean = (divergence(mean + h, ln_sigma, from, precision)
            - divergence(mean - h, ln_sigma, from, precision))
            / (2.0 * h);
        assert!((f64::from(gradient.by_mean[5]) / (0.5 * by_mean) - 1.0).abs() < 1e-3);
        let by_ln_sigma = (divergence(mean, ln_sigma + h, from, precision)
            - divergence(mean, ln_sigma - h, from, precision))
            / (2.0 * h);
        let variance = (2.0 * ln_sigma).exp();
        let got = 2.0 * variance * f64::from(gradient.by_variance[5]);
        assert!((got / (0.5 * by_ln_sigma) - 1.0).abs() < 1e-3);
        // Where nothing moved only the deviation is pulled: towards the wider anchor.
        assert_eq!(gradient.by_mean[6], 0.0);
        assert!(gradient.by_variance[6] < 0.0);
    }

    #[test]
    fn an_isotropic_anchor_has_one_deviation() {
        let mut network = Network::new(2);
        for (i, ln_sigma) in network.log_sigmas.iter_mut().enumerate().take(101) {
            *ln_sigma = (0.01 + 0.001 * i as f32).ln() + 1e-4;
        }
        let anchor = Anchor::isotropic(&network, 2.0);
        let expected = 1.0 / (2.0 * 0.06_f32).powi(2);
        assert!((anchor.precisions[0] / expected - 1.0).abs() < 1e-2);
        assert!(anchor.precisions.iter().all(|p| *p == anchor.precisions[0]));
    }
}
