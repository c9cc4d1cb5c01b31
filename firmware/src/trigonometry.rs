//! Sine and cosine in single precision alone.
//!
//! Those of `libm` reduce and sum in double precision, which a core with single-precision hardware does
//! in software: 2,200 instructions a pair and 9 KB of flash, beside 45 and 480 bytes here (Cortex-M4F).

use core::f32::consts::{FRAC_2_PI, PI};

use crate::scalar::Scalar;

/// Angles beyond are first taken off whole turns at the precision that they have, rad. A measurement's are
/// within sixteen turns.
const REDUCED_MAX: f32 = 3000.0;

/// A quarter turn as three numbers of few bits, whose products with up to 2,000 quarters are exact or
/// small (Cody and Waite, Software Manual for the Elementary Functions, 1980).
const QUARTER: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];

/// Added and taken off, rounds a number below 2^22 to an integer.
const ROUND: f32 = 12_582_912.0;

/// Least largest relative error over an eighth of a turn, by Remez's exchange: 4e-9 for the sine, 1e-10 for
/// the cosine.
const SINE: [f32; 3] = [-0.166_666_55, 8.332_16e-3, -1.951_521_8e-4];
const COSINE: [f32; 3] = [4.166_664_6e-2, -1.388_731_6e-3, 2.443_308_3e-5];

/// Sine and cosine of radians, within 1.2e-7 of the true ones for angles within 100 rad and within 3e-7 up
/// to 3,000; beyond, as good as the angle is known. What is not finite gives what is not a number.
pub(crate) fn sin_cos(angle: f32) -> (f32, f32) {
    let angle = if (-REDUCED_MAX..=REDUCED_MAX).contains(&angle) {
        angle
    } else {
        // Rounding leaves what is far out anywhere.
        Scalar::wrap(angle).clamp(-PI, PI)
    };
    let quarters = (angle * FRAC_2_PI + ROUND) - ROUND;
    let [first, second, third] = QUARTER;
    let x = ((angle - quarters * first) - quarters * second) - quarters * third;
    let t = x * x;
    let sine = x + x * t * (SINE[0] + t * (SINE[1] + t * SINE[2]));
    let cosine = 1.0 - 0.5 * t + t * t * (COSINE[0] + t * (COSINE[1] + t * COSINE[2]));
    match quarters as i32 & 3 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

#[cfg(test)]
mod tests {
    use super::sin_cos;
    use proptest::prelude::*;

    fn error(angle: f32) -> f64 {
        let (s, c) = sin_cos(angle);
        let (sine, cosine) = f64::from(angle).sin_cos();
        (f64::from(s) - sine)
            .abs()
            .max((f64::from(c) - cosine).abs())
    }

    #[test]
    fn within_sixteen_turns_it_is_as_good_as_single_precision() {
        let mut worst = 0.0_f64;
        for i in -1_000_000..=1_000_000 {
            worst = worst.max(error(i as f32 * 1.0053e-4));
        }
        assert!(worst < 1.2e-7, "{worst:e}");
    }

    #[test]
    fn near_zero_the_sine_is_good_relative_to_itself() {
        for exponent in 1..120 {
            let angle = 0.7 * libm::exp2f(-exponent as f32);
            let (s, _) = sin_cos(angle);
            let sine = f64::from(angle).sin();
            assert!(
                (f64::from(s) / sine - 1.0).abs() < 1.2e-7,
                "{angle:e}: {s:e}"
            );
            assert_eq!(sin_cos(-angle).0, -s);
        }
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
    }

    proptest! {
        #[test]
        fn far_angles_are_as_good_as_they_are_known(angle in -3e3_f32..3e3, far in 3e3_f32..1e9) {
            prop_assert!(error(angle) < 3e-7);
            prop_assert!(error(far) < 2e-7 * f64::from(far));
            let (s, c) = sin_cos(far);
            prop_assert!((s * s + c * c - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn what_is_not_finite_is_not_a_number() {
        for angle in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let (s, c) = sin_cos(angle);
            assert!(s.is_nan() && c.is_nan());
        }
        for angle in [f32::MAX, f32::MIN] {
            let (s, c) = sin_cos(angle);
            assert!(s.abs() <= 1.0 && c.abs() <= 1.0);
        }
    }
}
