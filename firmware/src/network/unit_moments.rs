//! What an activation makes of a Gaussian: mean, mean slope, and the variance that no line explains.

mod gelu;
mod normal;
mod relu;
mod tanh;

/// Moments of `f(z)` for Gaussian `z` and the activation `f`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitMoments {
    /// Its mean.
    pub mean: f32,
    /// The mean of its derivative: the slope of the best line through it.
    pub slope: f32,
    /// Variance beside that line.
    pub beside: f32,
}

impl UnitMoments {
    /// Of nothing at all: the line is everything. A variance that is not finite gives a mean that is not.
    #[inline]
    pub fn of_identity(mean: f32, variance: f32) -> Self {
        Self {
            mean: mean + 0.0 * variance,
            slope: 1.0,
            beside: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    /// Mean of `f(z)` over the Gaussian, by the trapezoidal rule.
    pub(super) fn expected(mean: f64, variance: f64, f: impl Fn(f64) -> f64) -> f64 {
        let (mut sum, mut weight) = (0.0, 0.0);
        for i in -4_000..=4_000 {
            let x = f64::from(i) * 2e-3;
            let density = libm::exp(-0.5 * x * x);
            sum += density * f(mean + variance.sqrt() * x);
            weight += density;
        }
        sum / weight
    }
}
