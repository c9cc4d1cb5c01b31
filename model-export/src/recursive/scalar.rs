//! The arithmetic that one filter step needs: plain `f64` numbers or variables on a tape.

use core::ops::{Add, Div, Mul, Neg, Sub};

/// A real number that the filter step can be written in.
///
/// Implementors: `f64` (the naive twin of the firmware) and [`crate::autodiff::tape::Variable`].
pub trait Scalar:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// A number known when the step is written. Zeros and ones vanish from a tape.
    fn constant(value: f64) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// e to the power of `self`.
    fn exp(self) -> Self;
    /// `exp(self) - 1`, accurate near zero.
    fn exp_m1(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// Sine of radians.
    fn sin(self) -> Self;
    /// Cosine of radians.
    fn cos(self) -> Self;
    /// Angle of the point `(x, self)`, radians.
    fn atan2(self, x: Self) -> Self;
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;
    /// The larger one; the derivative follows it.
    fn max(self, other: Self) -> Self;
    /// The smaller one; the derivative follows it.
    fn min(self, other: Self) -> Self;
    /// Radians moved into `[-pi, pi]` by whole turns; the derivative is one.
    fn wrap(self) -> Self;

    /// `self` kept in `[low, high]`; the derivative is zero outside.
    fn clamp(self, low: f64, high: f64) -> Self {
        self.max(Self::constant(low)).min(Self::constant(high))
    }

    /// `ln(1 + exp(self))`, written so that neither end overflows.
    fn softplus(self) -> Self {
        let zero = Self::constant(0.0);
        let magnitude = self.max(-self);
        self.max(zero) + (Self::constant(1.0) + (-magnitude).exp()).ln()
    }
}

impl Scalar for f64 {
    fn constant(value: f64) -> Self {
        value
    }
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    fn exp(self) -> Self {
        f64::exp(self)
    }
    fn exp_m1(self) -> Self {
        f64::exp_m1(self)
    }
    fn ln(self) -> Self {
        f64::ln(self)
    }
    fn sin(self) -> Self {
        f64::sin(self)
    }
    fn cos(self) -> Self {
        f64::cos(self)
    }
    fn atan2(self, x: Self) -> Self {
        f64::atan2(self, x)
    }
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    fn wrap(self) -> Self {
        let turn = core::f64::consts::TAU;
        self - turn * (self / turn).round()
    }
    fn tanh(self) -> Self {
        f64::tanh(self)
    }
}

#[cfg(test)]
mod tests {
    use super::Scalar;

    #[test]
    fn wrap_takes_whole_turns_off() {
        assert!((Scalar::wrap(3.5_f64) - (3.5 - core::f64::consts::TAU)).abs() < 1e-15);
        assert_eq!(Scalar::wrap(-1.0_f64), -1.0);
    }

    #[test]
    fn softplus_is_safe_at_both_ends() {
        assert_eq!(Scalar::softplus(1000.0_f64), 1000.0);
        assert_eq!(Scalar::softplus(-1000.0_f64), 0.0);
        assert!((Scalar::softplus(0.0_f64) - 2.0_f64.ln()).abs() < 1e-15);
    }
}
