//! Standard normal noise and exponentials, sixteen at a time.

use super::LANES;
use super::tier::per_tier;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::SplitMix64;

per_tier! {
    /// Fills `out`, a multiple of 32 values, with standard normal numbers that depend on `seed`
    /// alone. Box-Muller on 24-bit uniforms: magnitudes end at 5.77, which one draw in 10^8 passes.
    fn fill_normal(seed: u64, out: &mut [f32]) => fill_normal_body, fill_normal_body, fill_normal_body
}

per_tier! {
    /// Replaces every value x by `exp(factor * x)`, to 2e-7 relative; arguments beyond +-87 are
    /// taken as +-87. The length is a multiple of 16.
    fn exp_in_place(factor: f32, values: &mut [f32]) => exp_body, exp_body, exp_body
}

/// Sixteen independent xoshiro128++ generators, one a lane.
struct Lanes {
    state: [[u32; LANES]; 4],
}

impl Lanes {
    fn new(seed: u64) -> Self {
        let mut source = SplitMix64::seed_from_u64(seed);
        let mut state = [[0; LANES]; 4];
        for words in &mut state {
            for word in words {
                *word = source.next_u32();
            }
        }
        // A state of all zeros would stay there; one set bit is as good as any other state.
        for lane in &mut state[0] {
            *lane |= 1;
        }
        Self { state }
    }

    #[inline(always)]
    fn next(&mut self) -> [u32; LANES] {
        let mut out = [0; LANES];
        let [s0, s1, s2, s3] = &mut self.state;
        for i in 0..LANES {
            out[i] = s0[i].wrapping_add(s3[i]).rotate_left(7).wrapping_add(s0[i]);
            let shifted = s1[i] << 9;
            s2[i] ^= s0[i];
            s3[i] ^= s1[i];
            s1[i] ^= s2[i];
            s0[i] ^= s3[i];
            s2[i] ^= shifted;
            s3[i] = s3[i].rotate_left(11);
        }
        out
    }
}

#[inline(always)]
fn fill_normal_body(seed: u64, out: &mut [f32]) {
    assert!(out.len().is_multiple_of(2 * LANES));
    let mut lanes = Lanes::new(seed);
    for pair in out.chunks_exact_mut(2 * LANES) {
        let (radius_bits, angle_bits) = (lanes.next(), lanes.next());
        let (first, second) = pair.split_at_mut(LANES);
        for i in 0..LANES {
            // (0, 1] and [-1/2, 1/2), both multiples of 2^-24.
            let uniform = ((radius_bits[i] >> 8) as i32 + 1) as f32 * (1.0 / (1 << 24) as f32);
            let turns = ((angle_bits[i] as i32) >> 8) as f32 * (1.0 / (1 << 24) as f32);
            let radius = (-2.0 * ln(uniform)).sqrt();
            let (sin, cos) = sin_cos_of_turns(turns);
            first[i] = radius * cos;
            second[i] = radius * sin;
        }
    }
}

#[inline(always)]
fn exp_body(factor: f32, values: &mut [f32]) {
    for chunk in values.chunks_exact_mut(LANES) {
        for value in chunk {
            *value = exp(factor * *value);
        }
    }
}

/// exp(x) by 2^n * e^f with |f| <= ln(2)/2 and the Taylor series of e^f to f^7 (6e-9 left out).
#[inline(always)]
pub(super) fn exp(x: f32) -> f32 {
    /// Adding it rounds to an integer, which then stands in the low bits.
    const ROUND: f32 = 12_582_912.0;
    /// ln 2 in two parts; the first has few enough bits that n times it is exact.
    const LN2_HIGH: f32 = 0.693_359_4;
    const LN2_LOW: f32 = -2.121_944_4e-4;
    let x = x.clamp(-87.0, 87.0);
    let rounded = x.mul_add(std::f32::consts::LOG2_E, ROUND);
    let n = rounded - ROUND;
    let f = n.mul_add(-LN2_LOW, n.mul_add(-LN2_HIGH, x));
    let mut series = 1.0 / 5040.0;
    for coefficient in [
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ] {
        series = f.mul_add(series, coefficient);
    }
    let exponent = (rounded.to_bits() << 23).wrapping_add(1.0_f32.to_bits());
    series * f32::from_bits(exponent)
}

/// ln(x) of a positive normal number: exponent * ln 2 + 2 atanh(s), s = (m - 1) / (m + 1) with the
/// mantissa m in [sqrt(1/2), sqrt(2)), series to s^9 (2e-9 left out).
#[inline(always)]
fn ln(x: f32) -> f32 {
    let offset = x
        .to_bits()
        .wrapping_sub(std::f32::consts::FRAC_1_SQRT_2.to_bits());
    let exponent = ((offset as i32) >> 23) as f32;
    let mantissa_bits =
        (offset & 0x007f_ffff).wrapping_add(std::f32::consts::FRAC_1_SQRT_2.to_bits());
    let m = f32::from_bits(mantissa_bits);
    let s = (m - 1.0) / (m + 1.0);
    let square = s * s;
    let mut series = 2.0 / 9.0;
    for coefficient in [2.0 / 7.0, 2.0 / 5.0, 2.0 / 3.0, 2.0] {
        series = square.mul_add(series, coefficient);
    }
    exponent.mul_add(std::f32::consts::LN_2, s * series)
}

/// Sine and cosine of `turns` * 2 pi for |turns| <= 1/2: Taylor series of the half angle (below
/// 6e-8 left out), then doubled; 1e-6 in all.
#[inline(always)]
fn sin_cos_of_turns(turns: f32) -> (f32, f32) {
    let half = turns * std::f32::consts::PI;
    let square = half * half;
    let mut sin = -1.0 / 39_916_800.0;
    for coefficient in [1.0 / 362_880.0, -1.0 / 5040.0, 1.0 / 120.0, -1.0 / 6.0, 1.0] {
        sin = square.mul_add(sin, coefficient);
    }
    sin *= half;
    let mut cos = 1.0 / 479_001_600.0;
    for coefficient in [
        -1.0 / 3_628_800.0,
        1.0 / 40_320.0,
        -1.0 / 720.0,
        1.0 / 24.0,
        -0.5,
        1.0,
    ] {
        cos = square.mul_add(cos, coefficient);
    }
    (2.0 * sin * cos, (-2.0 * sin).mul_add(sin, 1.0))
}

#[cfg(test)]
mod tests {
    use super::super::Tier;
    use super::{exp, exp_in_place, fill_normal, ln, sin_cos_of_turns};

    #[test]
    fn elementary_functions_are_as_exact_as_documented() {
        for i in -870_000..=870_000 {
            let x = i as f32 * 1e-4;
            let exact = f64::from(x).exp();
            assert!((f64::from(exp(x)) / exact - 1.0).abs() < 2e-7, "exp({x})");
        }
        for i in 1..=(1 << 20) {
            let x = (i << 4) as f32 / (1 << 24) as f32;
            let exact = f64::from(x).ln();
            let error = (f64::from(ln(x)) - exact).abs();
            assert!(error < 2e-7 * exact.abs().max(0.1), "ln({x})");
        }
        for i in -(1 << 19)..(1 << 19) {
            let turns = (i << 4) as f32 / (1 << 24) as f32;
            let (sin, cos) = sin_cos_of_turns(turns);
            let (s, c) = (std::f64::consts::TAU * f64::from(turns)).sin_cos();
            let error = (f64::from(sin) - s).abs().max((f64::from(cos) - c).abs());
            assert!(error < 1e-6, "{turns}: {error:e}");
        }
    }

    #[test]
    fn noise_has_the_moments_tails_and_independence_of_standard_normals() {
        let mut draws = vec![0.0_f32; 1 << 20];
        fill_normal(Tier::detect(), 7, &mut draws);
        let n = draws.len() as f64;
        let moment = |power| draws.iter().map(|&x| f64::from(x).powi(power)).sum::<f64>() / n;
        // Five standard errors of each moment: sqrt(1, 2, 15, 96) / sqrt(n).
        assert!(moment(1).abs() < 5.0 / n.sqrt());
        assert!((moment(2) - 1.0).abs() < 5.0 * (2.0 / n).sqrt());
        assert!(moment(3).abs() < 5.0 * (15.0 / n).sqrt());
        assert!((moment(4) - 3.0).abs() < 5.0 * (96.0 / n).sqrt());
        let beyond = draws.iter().filter(|x| x.abs() > 2.575_829).count() as f64 / n;
        assert!((beyond - 0.01).abs() < 5.0 * (0.01 * 0.99 / n).sqrt());
        // Neighbours, the two halves of a Box-Muller pair, and the next draw of the same lane.
        for lag in [1, 16, 32] {
            let sum: f64 = draws
                .windows(lag + 1)
                .map(|w| f64::from(w[0] * w[lag]))
                .sum();
            assert!((sum / n).abs() < 5.0 / n.sqrt(), "lag {lag}");
        }
    }

    #[test]
    fn every_tier_gives_the_same_bits() {
        let reference: (Vec<f32>, Vec<f32>) = run(Tier::portable());
        for tier in Tier::available() {
            assert_eq!(run(tier), reference, "{}", tier.name());
        }
        fn run(tier: Tier) -> (Vec<f32>, Vec<f32>) {
            let mut draws = vec![0.0; 1024];
            fill_normal(tier, 99, &mut draws);
            let mut exps = draws.clone();
            exp_in_place(tier, -1.7, &mut exps);
            (draws, exps)
        }
    }

    #[test]
    fn seeds_give_different_streams() {
        let draw = |seed| {
            let mut draws = vec![0.0; 64];
            fill_normal(Tier::detect(), seed, &mut draws);
            draws
        };
        assert_eq!(draw(1), draw(1));
        assert_ne!(draw(1), draw(2));
    }
}
