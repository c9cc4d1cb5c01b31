//! GELU, `x * Phi(x)`, from a table with linear interpolation.

use crate::series;

/// Table steps per unit of the argument.
const STEPS_PER_UNIT: usize = 64;
/// Beyond this magnitude GELU is 0 or x to within 2e-6.
const LIMIT: usize = 5;
const ENTRIES: usize = 2 * LIMIT * STEPS_PER_UNIT + 2;

const fn table() -> [f32; ENTRIES] {
    let mut table = [0.0; ENTRIES];
    let mut i = 0;
    while i < ENTRIES {
        let x = i as f64 / STEPS_PER_UNIT as f64 - LIMIT as f64;
        table[i] = (x * series::normal_cdf(x)) as f32;
        i += 1;
    }
    table
}

static TABLE: [f32; ENTRIES] = table();

/// GELU of `x`; the absolute error against `x * Phi(x)` is below 3e-5. NaN gives NaN.
#[inline]
pub fn gelu(x: f32) -> f32 {
    const LIMIT_F32: f32 = LIMIT as f32;
    if x >= LIMIT_F32 {
        return x;
    }
    if x <= -LIMIT_F32 {
        return 0.0;
    }
    let position = (x + LIMIT_F32) * STEPS_PER_UNIT as f32;
    // A NaN converts to index 0 and comes out through the fraction.
    let index = position as usize;
    let fraction = position - index as f32;
    let low = TABLE[index];
    low + (TABLE[index + 1] - low) * fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_is_below_the_documented_bound() {
        for i in -80_000..=80_000 {
            let x = i as f32 * 1e-4;
            let exact = f64::from(x) * 0.5 * libm::erfc(-f64::from(x) / core::f64::consts::SQRT_2);
            assert!((f64::from(gelu(x)) - exact).abs() < 3e-5, "{x}");
        }
    }

    #[test]
    fn extremes_and_nan() {
        assert_eq!(gelu(f32::INFINITY), f32::INFINITY);
        assert_eq!(gelu(f32::NEG_INFINITY), 0.0);
        assert!(gelu(f32::NAN).is_nan());
    }
}
