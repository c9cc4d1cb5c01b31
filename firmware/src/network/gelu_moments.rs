//! What GELU makes of a Gaussian: mean, mean slope, and the variance that no line explains.

use crate::kernel::sqrt;
use crate::series;

/// Moments of `GELU(z)` for Gaussian `z`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeluMoments {
    /// Its mean.
    pub mean: f32,
    /// The mean of its derivative: the slope of the best line through it.
    pub slope: f32,
    /// Variance beside that line: second to fourth term of the Hermite series, and a guess at the rest.
    pub beside: f32,
}

/// What later terms add to the third and the fourth for a very wide Gaussian, as a share: fitted for means of
/// -3 to 3 and variances up to 2, where it leaves 0.1 % of the variance at most.
const REST: f32 = 0.3;

impl GeluMoments {
    /// For `z` of this mean and variance. What is not finite gives a mean that is not.
    #[inline]
    pub fn of(mean: f32, variance: f32) -> Self {
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
        let third = density * m * (square + 3.0 * v - 4.0);
        let fourth =
            density * (7.0 * (square + v) - square * (square + 6.0 * v) - 3.0 * v * v - 4.0);
        let above = third * third * (1.0 / 6.0) + variance * (fourth * fourth * (1.0 / 24.0));
        Self {
            mean: mean * cumulated + variance * density,
            slope: cumulated + m * density,
            beside: variance
                * variance
                * (0.5 * second * second + variance * above * (1.0 + REST * v)),
        }
    }
}

const STEPS_PER_UNIT: usize = 32;
const LIMIT: usize = 5;
/// The last one stands for all beyond.
const ENTRIES: usize = LIMIT * STEPS_PER_UNIT + 1;

/// What the standard normal distribution function has above one half, and the density, at the nodes;
/// each with the step to the next.
static NORMAL: [[f32; 4]; ENTRIES] = {
    let mut table = [[0.5, 0.0, 0.0, 0.0]; ENTRIES];
    let mut i = 0;
    while i + 1 < ENTRIES {
        let x = i as f64 / STEPS_PER_UNIT as f64;
        let next = x + 1.0 / STEPS_PER_UNIT as f64;
        table[i] = [
            (series::normal_cdf(x) - 0.5) as f32,
            (series::normal_cdf(next) - series::normal_cdf(x)) as f32,
            series::normal_density(x) as f32,
            (series::normal_density(next) - series::normal_density(x)) as f32,
        ];
        i += 1;
    }
    table
};

/// Distribution function and density of the standard normal, to 5e-5.
#[inline]
fn normal(x: f32) -> (f32, f32) {
    let place = x.abs() * STEPS_PER_UNIT as f32;
    let index = (place as usize).min(ENTRIES - 1);
    let [above, above_step, density, density_step] = NORMAL[index];
    let fraction = place - index as f32;
    let above = above + fraction * above_step;
    (0.5 + above.copysign(x), density + fraction * density_step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::activation::gelu;

    fn exact_gelu(x: f64) -> f64 {
        x * 0.5 * libm::erfc(-x / core::f64::consts::SQRT_2)
    }

    /// Mean of `f(z)` over the Gaussian, by the trapezoidal rule.
    fn expected(mean: f64, variance: f64, f: impl Fn(f64) -> f64) -> f64 {
        let (mut sum, mut weight) = (0.0, 0.0);
        for i in -4_000..=4_000 {
            let x = f64::from(i) * 2e-3;
            let density = libm::exp(-0.5 * x * x);
            sum += density * f(mean + variance.sqrt() * x);
            weight += density;
        }
        sum / weight
    }

    #[test]
    fn moments_are_the_integrals() {
        for mean in [-6.0, -2.5, -1.0, -0.3, 0.0, 0.4, 1.2, 3.0, 7.0] {
            for variance in [1e-6, 0.01, 0.1, 0.5, 2.0] {
                let got = GeluMoments::of(mean, variance);
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
            let got = GeluMoments::of(x, 0.0);
            assert!((got.mean - gelu(x)).abs() < 2e-4, "{x}");
            assert_eq!(got.beside, 0.0);
        }
    }

    #[test]
    fn the_tables_ends_are_the_functions() {
        assert_eq!(normal(-5.1), (0.0, 0.0));
        assert_eq!(normal(1e9), (1.0, 0.0));
        let last = f32::from_bits(5.0_f32.to_bits() - 1);
        for (x, cumulated) in [(last, 1.0), (5.0, 1.0), (-last, 0.0), (-5.0, 0.0)] {
            let (got, density) = normal(x);
            assert!((got - cumulated).abs() < 1e-6 && density < 1e-5, "{x}");
        }
    }

    #[test]
    fn what_is_not_finite_stays_so() {
        for bad in [f32::NAN, f32::INFINITY] {
            assert!(!GeluMoments::of(bad, 0.5).mean.is_finite());
            assert!(!GeluMoments::of(0.5, bad).mean.is_finite());
        }
    }
}
