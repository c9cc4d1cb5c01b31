//! The arithmetic that one filter step needs, so that the step is written once.
//!
//! Three implementors: `f32`, what the microcontroller runs; `f64`, the naive twin of it on the
//! host; and the variable of a training tape, which records the step and differentiates it. A step
//! therefore has no branch on a number: it uses [`Scalar::max`], [`Scalar::min`] and
//! [`Scalar::step`] instead, and loops over structural zeros, which vanish from a tape.

use core::ops::{Add, Div, Mul, Neg, Sub};

use crate::{kernel, trigonometry};

/// A real number that the filter step can be written in.
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
    /// Sine and cosine of radians.
    fn sin_cos(self) -> (Self, Self);
    /// Angle of the point `(x, self)`, radians.
    fn atan2(self, x: Self) -> Self;
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;
    /// The larger one, `other` when `self` is not a number; the derivative follows it.
    fn max(self, other: Self) -> Self;
    /// The smaller one, `other` when `self` is not a number; the derivative follows it.
    fn min(self, other: Self) -> Self;
    /// Radians moved into `[-pi, pi]` by whole turns; the derivative is one.
    fn wrap(self) -> Self;

    /// `self` kept in `[low, high]`; the derivative is zero outside.
    fn clamp(self, low: f64, high: f64) -> Self {
        self.max(Self::constant(low)).min(Self::constant(high))
    }

    /// One where `self` is positive, zero elsewhere, with a slope too narrow to be met.
    fn step(self) -> Self {
        (self * Self::constant(1e6)).clamp(0.0, 1.0)
    }

    /// Sine of radians.
    fn sin(self) -> Self {
        self.sin_cos().0
    }

    /// Cosine of radians.
    fn cos(self) -> Self {
        self.sin_cos().1
    }

    /// Magnitude.
    fn abs(self) -> Self {
        self.max(-self)
    }

    /// `ln(1 + exp(self))`, written so that neither end overflows.
    fn softplus(self) -> Self {
        let positive = self.max(Self::constant(0.0));
        positive + (Self::constant(1.0) + (-self.abs()).exp()).ln()
    }
}

macro_rules! scalar {
    ($float:ty, $sqrt:expr, $exp:expr, $exp_m1:expr, $ln:expr, $sin_cos:expr, $atan2:expr,
     $tanh:expr, $floor:expr) => {
        impl Scalar for $float {
            #[inline]
            fn constant(value: f64) -> Self {
                value as $float
            }
            #[inline]
            fn sqrt(self) -> Self {
                $sqrt(self)
            }
            #[inline]
            fn exp(self) -> Self {
                $exp(self)
            }
            #[inline]
            fn exp_m1(self) -> Self {
                $exp_m1(self)
            }
            #[inline]
            fn ln(self) -> Self {
                $ln(self)
            }
            #[inline]
            fn sin_cos(self) -> (Self, Self) {
                $sin_cos(self)
            }
            #[inline]
            fn atan2(self, x: Self) -> Self {
                $atan2(self, x)
            }
            #[inline]
            fn tanh(self) -> Self {
                $tanh(self)
            }
            #[inline]
            fn max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
            #[inline]
            fn min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }
            /// Into [-pi, pi).
            fn wrap(self) -> Self {
                const PI: $float = core::f64::consts::PI as $float;
                const TAU: $float = core::f64::consts::TAU as $float;
                if (-PI..PI).contains(&self) {
                    return self;
                }
                let wrapped = self - TAU * $floor((self + PI) / TAU);
                // Rounding can leave the result just outside.
                if wrapped >= PI {
                    wrapped - TAU
                } else if wrapped < -PI {
                    -PI
                } else {
                    wrapped
                }
            }
            #[inline]
            fn step(self) -> Self {
                if self > 0.0 { 1.0 } else { 0.0 }
            }
        }
    };
}

/// Natural logarithm.
// Some thirty times a step, once in flash.
#[inline(never)]
fn ln(x: f32) -> f32 {
    libm::logf(x)
}

scalar!(
    f32,
    kernel::sqrt,
    libm::expf,
    libm::expm1f,
    ln,
    trigonometry::sin_cos,
    libm::atan2f,
    libm::tanhf,
    libm::floorf
);
scalar!(
    f64,
    libm::sqrt,
    libm::exp,
    libm::expm1,
    libm::log,
    libm::sincos,
    libm::atan2,
    libm::tanh,
    libm::floor
);

#[cfg(test)]
mod tests {
    use super::Scalar;
    use core::f64::consts::{PI, TAU};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn wrapping_keeps_the_direction(angle in -1e4_f32..1e4) {
            let wrapped = Scalar::wrap(angle);
            prop_assert!((-PI as f32..PI as f32).contains(&wrapped));
            let turns = f64::from(angle - wrapped) / TAU;
            prop_assert!((turns - libm::round(turns)).abs() < 1e-3);
        }

        #[test]
        fn wrapping_in_double_precision_keeps_the_direction(angle in -1e6_f64..1e6) {
            let wrapped = Scalar::wrap(angle);
            prop_assert!((-PI..PI).contains(&wrapped));
            let turns = (angle - wrapped) / TAU;
            prop_assert!((turns - libm::round(turns)).abs() < 1e-9);
        }
    }

    #[test]
    fn wrapping_takes_whole_turns_off() {
        assert!((Scalar::wrap(3.5_f64) - (3.5 - TAU)).abs() < 1e-15);
        assert_eq!(Scalar::wrap(-1.0_f64), -1.0);
        assert_eq!(Scalar::wrap(PI as f32), -(PI as f32));
    }

    #[test]
    fn softplus_is_safe_at_both_ends() {
        assert_eq!(Scalar::softplus(1000.0_f64), 1000.0);
        assert_eq!(Scalar::softplus(-1000.0_f64), 0.0);
        assert!((Scalar::softplus(0.0_f64) - 2.0_f64.ln()).abs() < 1e-15);
    }

    #[test]
    fn what_is_not_a_number_loses() {
        assert_eq!(Scalar::max(f32::NAN, 1.0), 1.0);
        assert_eq!(Scalar::min(f32::NAN, 1.0), 1.0);
        assert_eq!(Scalar::clamp(f32::NAN, -1.0, 2.0), -1.0);
        assert_eq!(Scalar::step(f32::NAN), 0.0);
    }

    #[test]
    fn the_step_is_at_zero() {
        assert_eq!(Scalar::step(1e-30_f32), 1.0);
        assert_eq!(
            (Scalar::step(0.0_f64), Scalar::step(-1e-300_f64)),
            (0.0, 0.0)
        );
    }

    /// Both floats against the standard library's functions.
    #[test]
    fn functions_are_the_ones_they_are_named_after() {
        for x in [-3.0_f64, -0.7, 0.2, 1.1, 2.9] {
            let y = x.abs();
            let near = |single: f32, double: f64, expected: f64| {
                assert!((double - expected).abs() < 1e-14 * (1.0 + expected.abs()));
                assert!((f64::from(single) - expected).abs() < 1e-6 * (1.0 + expected.abs()));
            };
            let (s, r) = (x as f32, y as f32);
            near(Scalar::sqrt(r), Scalar::sqrt(y), y.sqrt());
            near(Scalar::exp(s), Scalar::exp(x), x.exp());
            near(Scalar::exp_m1(s), Scalar::exp_m1(x), x.exp_m1());
            near(Scalar::ln(r), Scalar::ln(y), y.ln());
            near(Scalar::sin(s), Scalar::sin(x), x.sin());
            near(Scalar::cos(s), Scalar::cos(x), x.cos());
            near(
                Scalar::atan2(s, -0.4),
                Scalar::atan2(x, -0.4),
                x.atan2(-0.4),
            );
            near(Scalar::tanh(s), Scalar::tanh(x), x.tanh());
            near(Scalar::abs(s), Scalar::abs(x), y);
        }
    }

    /// A number of which only what a scalar must have is written, as a tape's variable is.
    #[derive(Clone, Copy)]
    struct Plain(f64);

    macro_rules! plain {
        ($($operator:ident $method:ident;)*) => {$(
            impl core::ops::$operator for Plain {
                type Output = Self;
                fn $method(self, other: Self) -> Self {
                    Self(core::ops::$operator::$method(self.0, other.0))
                }
            }
        )*};
        ($($function:ident)*) => {
            impl Scalar for Plain {
                fn constant(value: f64) -> Self {
                    Self(value)
                }
                $(fn $function(self) -> Self {
                    Self(Scalar::$function(self.0))
                })*
                fn sin_cos(self) -> (Self, Self) {
                    let (s, c) = Scalar::sin_cos(self.0);
                    (Self(s), Self(c))
                }
                fn atan2(self, x: Self) -> Self {
                    Self(Scalar::atan2(self.0, x.0))
                }
                fn max(self, other: Self) -> Self {
                    Self(Scalar::max(self.0, other.0))
                }
                fn min(self, other: Self) -> Self {
                    Self(Scalar::min(self.0, other.0))
                }
            }
        };
    }
    plain! { Add add; Sub sub; Mul mul; Div div; }
    plain! { sqrt exp exp_m1 ln tanh wrap }

    impl core::ops::Neg for Plain {
        type Output = Self;
        fn neg(self) -> Self {
            Self(-self.0)
        }
    }

    /// The step of a tape rises from zero to one within a millionth.
    #[test]
    fn the_step_of_others_is_a_narrow_slope() {
        for (x, expected) in [
            (-1.0, 0.0),
            (0.0, 0.0),
            (5e-7, 0.5),
            (2e-6, 1.0),
            (3.0, 1.0),
        ] {
            let got = Plain(x).step().0;
            assert!((got - expected).abs() < 1e-12, "{x}: {got}");
        }
    }
}
