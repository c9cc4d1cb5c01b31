//! What GELU makes of a Gaussian.

use super::UnitMoments;
use super::normal::normal;
use crate::kernel::sqrt;

/// What later terms add to the third and the fourth for a very wide Gaussian, as a share: fitted for means of
/// -3 to 3 and variances up to 2, where it leaves 0.1 % of the variance at most.
const REST: f32 = 0.3;
/// Below this variance the third and later terms are left out: they are less than 1e-4 of it.
const NARROW: f32 = 0.03;

impl UnitMoments {
    /// Of GELU, for `z` of this mean and variance. What is not finite gives a mean that is not.
    #[inline]
    pub fn of_gelu(mean: f32, variance: f32) -> Self {
        // GELU is z Phi(z), and Phi and its density stay themselves under a Gaussian of another width.
        let inverse = 1.0 / sqrt(1.0 + variance);
        let (cumulated, density) = normal(mean * inverse);
        let density = density * inverse;
        // Mean and variance of z where the density phi(z) weighs it.
        let shrunk = inverse * inverse;
        let (m, v) = (mean * shrunk, variance * shrunk);
        let square = m * m;
        // Means of the second to fourth derivative: phi times 2 - z^2, z^3 - 4 z and -z^4 + 7 z^2 - 4.
        let second = density * (2.0 - v - square);
        let mut curved = 0.5 * second * second;
        if variance >= NARROW {
            let third = density * m * (square + 3.0 * v - 4.0);
            let fourth =
                density * (7.0 * (square + v) - square * (square + 6.0 * v) - 3.0 * v * v - 4.0);
            let above = third * third * (1.0 / 6.0) + variance * (fourth * fourth * (1.0 / 24.0));
            curved += variance * above * (1.0 + REST * v);
        }
        Self {
            mean: mean * cumulated + variance * density,
            slope: cumulated + m * density,
            beside: variance * variance * curved,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::activation::gelu::gelu;
    use crate::network::unit_moments::tests::expected;

    fn exact_gelu(x: f64) -> f64 {
        x * 0.5 * libm::erfc(-x / core::f64::consts::SQRT_2)
    }

    #[test]
    fn moments_are_the_integrals() {
        for mean in [-6.0, -2.5, -1.0, -0.3, 0.0, 0.4, 1.2, 3.0, 7.0] {
            for variance in [1e-6, 0.01, 0.1, 0.5, 2.0] {
                let got = UnitMoments::of_gelu(mean, variance);
                let (m, v) = (f64::from(mean), f64::from(variance));
                let first = expected(m, v, exact_gelu);
                assert!(
                    (f64::from(got.mean) - first).abs() < 2e-4,
                    "{mean} {variance}"
                );
                // Stein: the covariance with z is the variance times the mean slope.
                let slope = expected(m, v, |z| exact_gelu(z) * (z - m)) / v;
                assert!(
                    (f64::from(got.slope) - slope).abs() < 2e-4,
                    "{mean} {variance}"
                );
                let square = expected(m, v, |z| (exact_gelu(z) - first).powi(2));
                let all = slope * slope * v + f64::from(got.beside);
                assert!(
                    (all - square).abs() < 2e-3 * v * (0.05 + v),
                    "{mean} {variance}"
                );
            }
        }
    }

    #[test]
    fn without_variance_it_is_gelu() {
        for i in -700..=700 {
            let x = i as f32 * 0.01;
            let got = UnitMoments::of_gelu(x, 0.0);
            assert!((got.mean - gelu(x)).abs() < 2e-4, "{x}");
            assert_eq!(got.beside, 0.0);
        }
    }

    #[test]
    fn what_is_not_finite_stays_so() {
        for bad in [f32::NAN, f32::INFINITY] {
            assert!(!UnitMoments::of_gelu(bad, 0.5).mean.is_finite());
            assert!(!UnitMoments::of_gelu(0.5, bad).mean.is_finite());
        }
    }
}
