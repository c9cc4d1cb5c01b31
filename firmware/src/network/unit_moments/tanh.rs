//! What the hyperbolic tangent makes of a Gaussian.

use super::UnitMoments;
use super::normal::normal;
use crate::kernel::sqrt;

/// Weights, whose sum is 1, and rates `b` of the normal distribution functions, `2 Phi(b z) - 1`, whose sum is
/// the hyperbolic tangent to 9e-5 (least squares, the largest errors weighed up): under a Gaussian they stay
/// what they are.
const PARTS: [(f32, f32); 3] = [
    (0.162_539_9, 0.728_056_3),
    (0.585_183_1, 1.155_513_4),
    (0.252_277, 1.815_756_9),
];
/// Below this variance the Hermite series of the variance is the better one, above it what is left of 1.
const NARROW: f32 = 0.2;

impl UnitMoments {
    /// Of the hyperbolic tangent, for `z` of this mean and variance. What is not finite gives a mean that is not.
    // Once in flash: its loop is long, and few networks have it.
    #[inline(never)]
    pub fn of_tanh(mean: f32, variance: f32) -> Self {
        let (mut first, mut slope, mut second, mut third) = (0.0, 0.0, 0.0, 0.0);
        for (weight, rate) in PARTS {
            let rate = rate / sqrt(1.0 + rate * rate * variance);
            let place = rate * mean;
            let (cumulated, density) = normal(place);
            first += weight * (2.0 * cumulated - 1.0);
            let part = 2.0 * weight * rate * density;
            slope += part;
            second -= part * rate * place;
            third -= part * rate * rate * (1.0 - place * place);
        }
        let beside = if variance < NARROW {
            let above = variance * third * third * (1.0 / 6.0);
            variance * variance * (0.5 * second * second + above)
        } else {
            // The slope is one less the square, so the square's mean is one less the slope's.
            1.0 - slope - first * first - slope * slope * variance
        };
        Self {
            // An infinite variance leaves no rate, and zero would be an answer.
            mean: first + 0.0 * variance,
            slope,
            beside: beside.max(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::activation::tanh::tanh;
    use crate::network::unit_moments::tests::expected;

    #[test]
    fn moments_are_the_integrals() {
        for mean in [-6.0_f32, -2.5, -1.0, -0.3, 0.0, 0.4, 1.2, 3.0, 7.0] {
            for variance in [1e-4_f32, 0.01, 0.1, 0.5, 2.0, 100.0] {
                let got = UnitMoments::of_tanh(mean, variance);
                let (m, v) = (f64::from(mean), f64::from(variance));
                let first = expected(m, v, libm::tanh);
                assert!(
                    (f64::from(got.mean) - first).abs() < 2e-4,
                    "{mean} {variance}"
                );
                let slope = expected(m, v, |z| 1.0 - libm::tanh(z).powi(2));
                let error = (f64::from(got.slope) - slope).abs();
                assert!(error < 1e-3, "{mean} {variance} {error}");
                let square = expected(m, v, |z| (libm::tanh(z) - first).powi(2));
                let all = f64::from(got.slope).powi(2) * v + f64::from(got.beside);
                assert!(
                    (all - square).abs() < 2e-3 * v.min(1.0),
                    "{mean} {variance} {all} {square}"
                );
            }
        }
    }

    #[test]
    fn without_variance_it_is_tanh() {
        for mean in [-6.0, -0.4, 0.0, 2.0] {
            let got = UnitMoments::of_tanh(mean, 0.0);
            assert!((got.mean - tanh(mean)).abs() < 2e-4, "{mean}");
            assert_eq!(got.beside, 0.0);
        }
    }

    #[test]
    fn what_is_not_finite_stays_so() {
        for bad in [f32::NAN, f32::INFINITY] {
            assert!(!UnitMoments::of_tanh(bad, 0.5).mean.is_finite());
            assert!(!UnitMoments::of_tanh(0.5, bad).mean.is_finite());
        }
    }
}
