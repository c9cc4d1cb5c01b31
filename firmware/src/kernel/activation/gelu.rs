//! GELU, `x * Phi(x)`, from a table with linear interpolation.

use crate::series;

/// Table steps per unit of the argument.
pub(crate) const STEPS_PER_UNIT: usize = 64;
/// Beyond this magnitude GELU is 0 or x to within 2e-6.
pub(crate) const LIMIT: usize = 5;
/// The last one is reached by rounding.
pub(crate) const ENTRIES: usize = 2 * LIMIT * STEPS_PER_UNIT + 1;

const fn node(i: usize) -> f32 {
    let x = i as f64 / STEPS_PER_UNIT as f64 - LIMIT as f64;
    (x * series::normal_cdf(x)) as f32
}

const fn table() -> [[f32; 2]; ENTRIES] {
    let mut table = [[0.0; 2]; ENTRIES];
    let mut i = 0;
    while i < ENTRIES {
        table[i] = [node(i), node(i + 1) - node(i)];
        i += 1;
    }
    table
}

/// GELU at the nodes, and the step to the next one.
static TABLE: [[f32; 2]; ENTRIES] = table();

/// GELU of `x`; the absolute error against `x * Phi(x)` is below 3e-5. NaN gives NaN.
#[inline]
pub fn gelu(x: f32) -> f32 {
    const LIMIT_F32: f32 = LIMIT as f32;
    // Magnitudes order like their bits, NaN above all: one comparison instead of two.
    if x.to_bits() & 0x7FFF_FFFF >= LIMIT_F32.to_bits() {
        return if x <= -LIMIT_F32 { 0.0 } else { x };
    }
    let position = (x + LIMIT_F32) * STEPS_PER_UNIT as f32;
    let index = position as usize;
    let fraction = position - index as f32;
    let [low, step] = TABLE[index.min(ENTRIES - 1)];
    low + step * fraction
}

/// [`gelu`] of each of four numbers.
#[inline]
pub fn gelus(x: [f32; 4]) -> [f32; 4] {
    #[cfg(arm_vfp)]
    {
        crate::kernel::gelus(x, &TABLE)
    }
    #[cfg(not(arm_vfp))]
    x.map(gelu)
}

/// [`gelu`] of every number.
#[inline]
pub fn gelu_in_place(x: &mut [f32]) {
    let (fours, rest) = x.as_chunks_mut();
    for x in fours {
        *x = gelus(*x);
    }
    for x in rest {
        *x = gelu(*x);
    }
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
    fn the_last_number_below_the_limit_rounds_to_the_last_entry() {
        for limit in [LIMIT as f32, -(LIMIT as f32)] {
            let x = f32::from_bits(limit.to_bits() - 1);
            let expected = if limit > 0.0 { limit } else { 0.0 };
            assert!((gelu(x) - expected).abs() < 3e-5, "{x}");
        }
    }

    #[test]
    fn four_at_once_are_four_times_one() {
        let x = [-6.0, -0.7, 0.0, 1.3];
        let bits = |numbers: [f32; 4]| numbers.map(f32::to_bits);
        assert_eq!(bits(gelus(x)), bits(x.map(gelu)));
        assert!((gelus(x)[3] - 1.174_16).abs() < 3e-5);
        let all = [-6.0, -0.7, 0.0, 1.3, 0.2, 7.0];
        let mut got = all;
        gelu_in_place(&mut got);
        assert_eq!(got.map(f32::to_bits), all.map(|x| gelu(x).to_bits()));
    }

    #[test]
    fn extremes_and_nan() {
        assert_eq!(gelu(f32::INFINITY), f32::INFINITY);
        assert_eq!(gelu(f32::NEG_INFINITY), 0.0);
        assert!(gelu(f32::NAN).is_nan());
    }
}
