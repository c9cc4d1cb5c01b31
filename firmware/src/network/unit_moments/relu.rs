//! What ReLU makes of a Gaussian.

use super::UnitMoments;
use super::normal::normal;
use crate::kernel::activation::relu::relu;
use crate::kernel::sqrt;

impl UnitMoments {
    /// Of ReLU, for `z` of this mean and variance: closed forms, to the table's accuracy. What is not finite
    /// gives a mean that is not.
    #[inline]
    pub fn of_relu(mean: f32, variance: f32) -> Self {
        let sigma = sqrt(variance);
        if sigma == 0.0 {
            return Self {
                mean: relu(mean),
                slope: if mean > 0.0 { 1.0 } else { 0.0 },
                beside: 0.0,
            };
        }
        let place = (mean / sigma).clamp(-FAR, FAR);
        let (above, density) = normal(place);
        let below = 1.0 - above;
        // In units of the variance, and multiplied out where large terms would cancel.
        let beside = above * below * (1.0 + place * place) + place * density * (below - above)
            - density * density;
        Self {
            mean: mean * above + sigma * density,
            slope: above,
            beside: variance * beside.max(0.0),
        }
    }
}

/// So many deviations away the table has ended, and nothing is infinite yet.
const FAR: f32 = 6.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::unit_moments::tests::expected;

    #[test]
    fn moments_are_the_integrals() {
        for mean in [-6.0_f32, -2.5, -1.0, -0.3, 0.0, 0.4, 1.2, 3.0, 7.0] {
            for variance in [1e-4_f32, 0.01, 0.1, 0.5, 2.0] {
                let got = UnitMoments::of_relu(mean, variance);
                let (m, v) = (f64::from(mean), f64::from(variance));
                // The kink lies between the rule's points: to 1e-3 of a deviation.
                let sigma = v.sqrt();
                let exact = |z: f64| z.max(0.0);
                let first = expected(m, v, exact);
                assert!((f64::from(got.mean) - first).abs() < 2e-4 * (1.0 + m.abs()));
                let slope = expected(m, v, |z| exact(z) * (z - m)) / v;
                assert!(
                    (f64::from(got.slope) - slope).abs() < 1e-3,
                    "{mean} {variance}"
                );
                let square = expected(m, v, |z| (exact(z) - first).powi(2));
                let all = f64::from(got.slope).powi(2) * v + f64::from(got.beside);
                assert!(
                    (all - square).abs() < 1e-3 * sigma * sigma,
                    "{mean} {variance}"
                );
            }
        }
    }

    #[test]
    fn without_variance_it_is_relu() {
        for mean in [-2.0, 0.0, 3.0] {
            let got = UnitMoments::of_relu(mean, 0.0);
            assert_eq!((got.mean, got.beside), (relu(mean), 0.0));
        }
        // So little that the place overflows.
        let got = UnitMoments::of_relu(3e38, 1e-30);
        assert_eq!((got.mean, got.slope, got.beside), (3e38, 1.0, 0.0));
    }

    #[test]
    fn what_is_not_finite_stays_so() {
        for bad in [f32::NAN, f32::INFINITY] {
            assert!(!UnitMoments::of_relu(bad, 0.5).mean.is_finite());
            assert!(!UnitMoments::of_relu(0.5, bad).mean.is_finite());
        }
    }
}
