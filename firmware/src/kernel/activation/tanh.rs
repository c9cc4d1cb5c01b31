//! The hyperbolic tangent from a table with linear interpolation.

use crate::series;

/// Table steps per unit of the argument.
const STEPS_PER_UNIT: usize = 32;
/// Beyond this magnitude it is 1 to within 1e-4.
const LIMIT: usize = 5;
/// The last one is reached by rounding.
const ENTRIES: usize = LIMIT * STEPS_PER_UNIT + 2;

/// At the nodes; half a GELU table's bytes a node, and coarser, so that whoever has no such network pays
/// little flash.
static TABLE: [f32; ENTRIES] = {
    let mut table = [0.0; ENTRIES];
    let mut i = 0;
    while i < ENTRIES {
        let e = series::exp(2.0 * i as f64 / STEPS_PER_UNIT as f64);
        table[i] = ((e - 1.0) / (e + 1.0)) as f32;
        i += 1;
    }
    table
};

/// Hyperbolic tangent of `x`; the absolute error is below 1e-4. NaN gives NaN.
#[inline]
pub fn tanh(x: f32) -> f32 {
    const LIMIT_F32: f32 = LIMIT as f32;
    let magnitude = x.abs();
    if magnitude >= LIMIT_F32 {
        return 1.0_f32.copysign(x);
    }
    if x.is_nan() {
        return x;
    }
    let position = magnitude * STEPS_PER_UNIT as f32;
    let index = (position as usize).min(ENTRIES - 2);
    let fraction = position - index as f32;
    let (low, high) = (TABLE[index], TABLE[index + 1]);
    (low + (high - low) * fraction).copysign(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_is_below_the_documented_bound() {
        for i in -80_000..=80_000 {
            let x = i as f32 * 1e-4;
            let error = f64::from(tanh(x)) - f64::from(x).tanh();
            assert!(error.abs() < 1e-4, "{x}");
        }
    }

    #[test]
    fn it_is_odd_and_ends_at_one() {
        let last = f32::from_bits((LIMIT as f32).to_bits() - 1);
        for x in [0.0, 0.01, 1.7, last, 5.0, 9.0, f32::INFINITY] {
            assert_eq!(tanh(-x).to_bits(), (-tanh(x)).to_bits(), "{x}");
            assert!(tanh(x) <= 1.0, "{x}");
        }
        assert_eq!(tanh(f32::INFINITY), 1.0);
        assert!(tanh(f32::NAN).is_nan());
    }
}
