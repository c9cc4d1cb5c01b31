//! One Adam step (Kingma and Ba 2015) on means and log standard deviations of Gaussian weights.

use super::normal::exp;
use super::tier::per_tier;

/// Constants of one step; the same for every weight.
#[derive(Clone, Copy, Debug)]
pub struct AdamStep {
    /// Learning rate.
    pub rate: f32,
    /// Decay of the first moment.
    pub beta1: f32,
    /// Decay of the second moment.
    pub beta2: f32,
    /// Added to the root of the second moment.
    pub epsilon: f32,
    /// `1 / (1 - beta1^t)` at step t, from 1.
    pub correction1: f32,
    /// `1 / (1 - beta2^t)`.
    pub correction2: f32,
    /// Weight of the divergence from the prior in the loss.
    pub kl_weight: f32,
    /// `1 / prior sigma^2`.
    pub prior_precision: f32,
}

/// Means and natural logarithms of the standard deviations, one of each a weight.
pub struct Posterior<'a> {
    /// Means.
    pub means: &'a mut [f32],
    /// ln(sigma).
    pub log_sigmas: &'a mut [f32],
}

/// Adam's moments of the gradients of [`Posterior`].
pub struct Moments<'a> {
    /// First moment, means.
    pub mean_first: &'a mut [f32],
    /// Second moment, means.
    pub mean_second: &'a mut [f32],
    /// First moment, log sigmas.
    pub log_sigma_first: &'a mut [f32],
    /// Second moment, log sigmas.
    pub log_sigma_second: &'a mut [f32],
}

per_tier! {
    /// One step down the gradient of data loss plus `kl_weight` times the divergence from the prior
    /// N(0, 1 / prior_precision). The gradient of the data loss comes with respect to the mean
    /// (`by_mean`) and to the variance (`by_variance`) of every weight.
    fn adam(
        step: AdamStep,
        by_mean: &[f32],
        by_variance: &[f32],
        posterior: Posterior<'_>,
        moments: Moments<'_>,
    ) => adam_body, adam_body, adam_body
}

#[inline(always)]
fn adam_body(
    step: AdamStep,
    by_mean: &[f32],
    by_variance: &[f32],
    posterior: Posterior<'_>,
    moments: Moments<'_>,
) {
    let len = by_mean.len();
    let by_variance = &by_variance[..len];
    let (means, log_sigmas) = (
        &mut posterior.means[..len],
        &mut posterior.log_sigmas[..len],
    );
    let (m1, m2) = (
        &mut moments.mean_first[..len],
        &mut moments.mean_second[..len],
    );
    let (s1, s2) = (
        &mut moments.log_sigma_first[..len],
        &mut moments.log_sigma_second[..len],
    );
    for i in 0..len {
        // KL(N(m, s^2) || N(0, p^2)) = ln(p / s) + (s^2 + m^2) / (2 p^2) - 1/2.
        let by_mean = (step.kl_weight * step.prior_precision).mul_add(means[i], by_mean[i]);
        means[i] -= change(step, by_mean, &mut m1[i], &mut m2[i]);
        let variance = exp(2.0 * log_sigmas[i]);
        let by_log_sigma = (2.0 * variance).mul_add(
            by_variance[i],
            step.kl_weight * variance.mul_add(step.prior_precision, -1.0),
        );
        log_sigmas[i] -= change(step, by_log_sigma, &mut s1[i], &mut s2[i]);
    }
}

#[inline(always)]
fn change(step: AdamStep, gradient: f32, first: &mut f32, second: &mut f32) -> f32 {
    *first = step.beta1.mul_add(*first, (1.0 - step.beta1) * gradient);
    *second = step
        .beta2
        .mul_add(*second, (1.0 - step.beta2) * gradient * gradient);
    let root = (*second * step.correction2).sqrt();
    step.rate * (*first * step.correction1) / (root + step.epsilon)
}

#[cfg(test)]
mod tests {
    use super::super::Tier;
    use super::{AdamStep, Moments, Posterior, adam};

    const STEP: AdamStep = AdamStep {
        rate: 1e-3,
        beta1: 0.9,
        beta2: 0.999,
        epsilon: 1e-8,
        correction1: 1.0,
        correction2: 1.0,
        kl_weight: 0.25,
        prior_precision: 4.0,
    };

    fn at_step(t: i32) -> AdamStep {
        AdamStep {
            correction1: 1.0 / (1.0 - STEP.beta1.powi(t)),
            correction2: 1.0 / (1.0 - STEP.beta2.powi(t)),
            ..STEP
        }
    }

    #[test]
    fn two_steps_follow_the_published_recursion_in_f64_on_every_tier() {
        let n = 37;
        let start: Vec<f32> = (0..n).map(|i| i as f32 * 0.05 - 0.9).collect();
        let by_mean: Vec<f32> = (0..n).map(|i| ((i * 7) % 11) as f32 * 0.1 - 0.5).collect();
        let by_variance: Vec<f32> = (0..n).map(|i| ((i * 5) % 13) as f32 - 6.0).collect();
        let mut reference: Option<Vec<f32>> = None;
        for tier in Tier::available() {
            let (mut means, mut log_sigmas) = (start.clone(), start.clone());
            let mut moments = vec![vec![0.0; n]; 4];
            for t in [1, 2] {
                let [mean_first, mean_second, log_sigma_first, log_sigma_second] = &mut moments[..]
                else {
                    unreachable!()
                };
                adam(
                    tier,
                    at_step(t),
                    &by_mean,
                    &by_variance,
                    Posterior {
                        means: &mut means,
                        log_sigmas: &mut log_sigmas,
                    },
                    Moments {
                        mean_first,
                        mean_second,
                        log_sigma_first,
                        log_sigma_second,
                    },
                );
            }
            for i in 0..n {
                let (mean, log_sigma) = naive(
                    f64::from(start[i]),
                    f64::from(by_mean[i]),
                    f64::from(by_variance[i]),
                );
                assert!((f64::from(means[i]) - mean).abs() < 1e-6, "{}", tier.name());
                assert!(
                    (f64::from(log_sigmas[i]) - log_sigma).abs() < 1e-6,
                    "{}",
                    tier.name()
                );
            }
            means.extend(log_sigmas);
            assert_eq!(
                reference.get_or_insert_with(|| means.clone()),
                &means,
                "{}",
                tier.name()
            );
        }
    }

    /// Two steps of Adam on one weight whose mean and log sigma start at `start`.
    fn naive(start: f64, by_mean: f64, by_variance: f64) -> (f64, f64) {
        let (rate, b1, b2, kl, precision) = (1e-3, 0.9, 0.999, 0.25, 4.0);
        let run = |gradient: &dyn Fn(f64) -> f64| {
            let (mut x, mut m, mut v) = (start, 0.0, 0.0);
            for t in 1..=2 {
                let g = gradient(x);
                m = b1 * m + (1.0 - b1) * g;
                v = b2 * v + (1.0 - b2) * g * g;
                x -= rate * (m / (1.0 - f64::powi(b1, t)))
                    / ((v / (1.0 - f64::powi(b2, t))).sqrt() + 1e-8);
            }
            x
        };
        let mean = run(&|x| by_mean + kl * precision * x);
        let log_sigma = run(&|x| {
            let variance = (2.0 * x).exp();
            2.0 * variance * by_variance + kl * (variance * precision - 1.0)
        });
        (mean, log_sigma)
    }
}
