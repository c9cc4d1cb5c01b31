//! Integer dot products of int8 weights and 16-bit activations, several passes at a time.
//!
//! The only module that may hold `unsafe` or assembly: DSP and floating-point instructions on the
//! microcontroller, SSE2 on the host, with a portable twin beside them; all give the same bits.
//! Lanes are Monte Carlo passes, so an unpacked weight serves `L` passes (weight-stationary), and
//! lane-wise arithmetic never reorders a sum. A single pass has one lane and four rows instead: an
//! activation that was loaded serves four outputs.
//!
//! Four consecutive inputs 4q..4q+3 are two words of two signed 16-bit halves, low half first:
//! word 2q holds inputs 4q and 4q+2, word 2q+1 holds 4q+1 and 4q+3, which is how SXTB16 unpacks
//! four int8 weights.
#![allow(unsafe_code)]

pub mod activation;
mod adjoint;
mod alike;
#[cfg(arm_dsp)]
mod arm_columns;
#[cfg(arm_dsp)]
mod arm_second;
#[cfg_attr(target_arch = "x86_64", path = "kernel/sse2.rs")]
#[cfg_attr(arm_dsp, path = "kernel/arm.rs")]
#[cfg(any(target_arch = "x86_64", arm_dsp))]
mod four_lanes;
mod packed;
mod picked;
mod second;
mod vector;
#[cfg(arm_vfp)]
mod vfp;

pub use adjoint::{Adjoint, VECTORS};
pub use alike::Alike;
pub use packed::Packed;
pub use picked::{RowBits, row_bits};
pub use second::Second;
pub use vector::Vector;

use crate::blob::field::{WIDTH_MAX, octaves};
use crate::series;

/// Largest quantised squared activation (12 bits).
const SQUARE_MAX: f32 = 4_095.0;
/// Largest decoded variance (13 bits). With 12-bit squares and [`WIDTH_MAX`] inputs the sum of
/// products stays below 2^31.
const VARIANCE_MAX: u16 = 8_191;
const _: () =
    assert!(WIDTH_MAX as u64 * VARIANCE_MAX as u64 * SQUARE_MAX as u64 <= i32::MAX as u64);

/// What a variance's code is if the layer's largest variance is `largest`, rounded.
const fn decoded(code: u8, largest: u32) -> u32 {
    let value = largest as f64 * series::exp(octaves(code) * core::f64::consts::LN_2);
    (value + 0.5) as u32
}

/// Decoded variances relative to the layer's largest.
static VARIANCES: [u16; 256] = {
    let mut table = [0; 256];
    let mut code = 1;
    while code < table.len() {
        table[code] = decoded(code as u8, VARIANCE_MAX as u32) as u16;
        code += 1;
    }
    table
};

#[inline]
fn halves(low: u32, high: u32) -> u32 {
    low | high << 16
}

/// Integer sums of the int8 codes `means` times the halves of `values`, and of the decoded
/// variances `codes` times the halves of `squares`.
#[inline]
fn dots<const L: usize>(
    means: &[u8],
    codes: &[u8],
    values: &[[u32; L]],
    squares: &[[u32; L]],
) -> [[i32; L]; 2] {
    #[cfg(any(target_arch = "x86_64", arm_dsp))]
    if L == 4 {
        let (values, squares) = (values.as_flattened(), squares.as_flattened());
        let sums = four_lanes::dots(means, codes, values, squares);
        return sums.map(|sums| core::array::from_fn(|lane| sums[lane]));
    }
    [dot_means(means, values), dot_variances(codes, squares)]
}

/// Integer sums of int8 codes times the halves of `words`.
#[inline]
fn dot_means<const L: usize>(row: &[u8], words: &[[u32; L]]) -> [i32; L] {
    let mut sums = [0_i32; L];
    for (codes, words) in row.as_chunks().0.iter().zip(words.chunks_exact(2)) {
        let codes = load(codes);
        multiply_accumulate(&mut sums, sign_extend_even_bytes(codes), &words[0]);
        multiply_accumulate(&mut sums, sign_extend_even_bytes(codes >> 8), &words[1]);
    }
    sums
}

/// Integer sums of each row's int8 codes times the halves of `words`, which are as many as one row
/// has. There is a row for every sum.
#[inline]
fn dot_rows(rows: &[u8], words: &[u32], sums: &mut [i32]) {
    let stride = 2 * words.len();
    if stride == 0 {
        sums.fill(0);
        return;
    }
    #[cfg(any(target_arch = "x86_64", arm_dsp))]
    let (rows, sums) = {
        let (fours, rest) = sums.as_chunks_mut();
        let Some((whole, rows)) = rows.split_at_checked(4 * stride * fours.len()) else {
            return;
        };
        four_lanes::dot_rows(whole, words, fours);
        (rows, rest)
    };
    let (words, _) = words.as_chunks::<1>();
    for (row, sum) in rows.chunks_exact(stride).zip(sums) {
        [*sum] = dot_means(row, words);
    }
}

/// Integer sums of each row's int8 codes times the halves of `words`, which are as many as one row has: the
/// sums of one row are `L` words in two's complement.
#[inline]
fn dot_pass_rows<const L: usize>(rows: &[u8], words: &[[u32; L]], sums: &mut [[u32; L]]) {
    #[cfg(any(target_arch = "x86_64", arm_dsp))]
    if L == 4 {
        four_lanes::dot_pass_rows(rows, words.as_flattened(), sums.as_flattened_mut());
        return;
    }
    let stride = (2 * words.len()).max(1);
    for (row, sums) in rows.chunks_exact(stride).zip(sums) {
        *sums = dot_means(row, words).map(i32::cast_unsigned);
    }
}

/// Integer sums of decoded variances times the halves of `words`.
#[inline]
fn dot_variances<const L: usize>(row: &[u8], words: &[[u32; L]]) -> [i32; L] {
    let mut sums = [0_i32; L];
    for (codes, words) in row.chunks_exact(4).zip(words.chunks_exact(2)) {
        let v = |i: usize| u32::from(VARIANCES[usize::from(codes[i])]);
        multiply_accumulate(&mut sums, halves(v(0), v(2)), &words[0]);
        multiply_accumulate(&mut sums, halves(v(1), v(3)), &words[1]);
    }
    sums
}

/// Four codes as one word. The compiler would fetch byte by byte: it does not know that the
/// processor loads words from any address.
#[inline]
fn load(codes: &[u8; 4]) -> u32 {
    #[cfg(arm_dsp)]
    {
        let word;
        // SAFETY: reads the four bytes of `codes`; ARMv7E-M takes LDR from any alignment.
        unsafe {
            core::arch::asm!("ldr {}, [{}]", out(reg) word, in(reg) codes.as_ptr(),
                options(pure, readonly, nostack, preserves_flags));
        }
        word
    }
    #[cfg(not(arm_dsp))]
    u32::from_le_bytes(*codes)
}

/// Bytes 0 and 2 of `codes`, sign-extended into two halves.
#[inline]
fn sign_extend_even_bytes(codes: u32) -> u32 {
    #[cfg(arm_dsp)]
    {
        let halves;
        // SAFETY: SXTB16 reads and writes registers only; the DSP extension is present by cfg.
        unsafe {
            core::arch::asm!("sxtb16 {}, {}", out(reg) halves, in(reg) codes,
                options(pure, nomem, nostack, preserves_flags));
        }
        halves
    }
    #[cfg(not(arm_dsp))]
    {
        let low = i16::from(codes as u8 as i8) as u16;
        let high = i16::from((codes >> 16) as u8 as i8) as u16;
        halves(u32::from(low), u32::from(high))
    }
}

/// Adds to each lane the products of the two halves of `weights` and of its word.
#[inline]
fn multiply_accumulate<const L: usize>(sums: &mut [i32; L], weights: u32, words: &[u32; L]) {
    for (sum, &word) in sums.iter_mut().zip(words) {
        #[cfg(arm_dsp)]
        // SAFETY: SMLAD reads and writes registers only (and the sticky Q flag, which nothing
        // here reads); the DSP extension is present by cfg.
        unsafe {
            core::arch::asm!("smlad {0}, {1}, {2}, {0}", inout(reg) *sum, in(reg) weights,
                in(reg) word, options(pure, nomem, nostack));
        }
        #[cfg(not(arm_dsp))]
        {
            let low = i32::from(weights as u16 as i16) * i32::from(word as u16 as i16);
            let high =
                i32::from((weights >> 16) as u16 as i16) * i32::from((word >> 16) as u16 as i16);
            *sum = sum.wrapping_add(low).wrapping_add(high);
        }
    }
}

/// Square root, correctly rounded on every target.
#[inline]
pub fn sqrt(x: f32) -> f32 {
    #[cfg(arm_vfp)]
    {
        let mut bits = x.to_bits();
        // SAFETY: VMOV and VSQRT touch registers only, and S0 is put back: rustc takes no float
        // registers as operands or clobbers on this target. The unit is present by cfg.
        unsafe {
            core::arch::asm!("vmov {kept}, s0", "vmov s0, {bits}", "vsqrt.f32 s0, s0",
                "vmov {bits}, s0", "vmov s0, {kept}", kept = out(reg) _, bits = inout(reg) bits,
                options(pure, nomem, nostack, preserves_flags));
        }
        f32::from_bits(bits)
    }
    #[cfg(not(arm_vfp))]
    libm::sqrtf(x)
}

/// GELU of four numbers, as [`crate::kernel::activation::gelu::gelu`] interpolates it in `table`.
#[cfg(arm_vfp)]
#[inline]
pub fn gelus(
    x: [f32; 4],
    table: &[[f32; 2]; crate::kernel::activation::gelu::ENTRIES],
) -> [f32; 4] {
    vfp::gelus(x, table)
}

/// [`sqrt`] of each of four numbers.
#[inline]
pub fn square_roots(x: [f32; 4]) -> [f32; 4] {
    #[cfg(arm_vfp)]
    {
        vfp::square_roots(x)
    }
    #[cfg(not(arm_vfp))]
    x.map(libm::sqrtf)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::seeded;
    use rand_core::Rng;

    /// The integers by their definition, for whatever this build compiled the sums to.
    #[test]
    fn instructions_equal_naive_integer_sums() {
        let mut rng = seeded(1);
        let mut words = [[0_u32; 4]; WIDTH_MAX / 2];
        for _ in 0..500 {
            let row: [u8; WIDTH_MAX] = core::array::from_fn(|_| rng.next_u32() as u8);
            let half = |rng: &mut crate::rng::Generator| rng.next_u32() % 4096;
            for word in words.iter_mut().flatten() {
                let sign = if rng.next_u32() & 1 == 0 {
                    0xF000_F000
                } else {
                    0
                };
                *word = halves(half(&mut rng), half(&mut rng)) ^ sign;
            }
            let squares = words.map(|lanes| lanes.map(|word| word & 0x0FFF_0FFF));
            let [means, variances] = dots(&row, &row, &words, &squares);
            for lane in 0..4 {
                let (mut mean, mut variance) = (0_i64, 0_i64);
                for input in 0..WIDTH_MAX {
                    let word = 2 * (input / 4) + input % 2;
                    let shift = if input % 4 < 2 { 0 } else { 16 };
                    let value = (words[word][lane] >> shift) as u16 as i16;
                    mean += i64::from(row[input] as i8) * i64::from(value);
                    let square = squares[word][lane] >> shift & 0xFFFF;
                    variance += i64::from(VARIANCES[usize::from(row[input])]) * i64::from(square);
                }
                assert_eq!(i64::from(means[lane]), mean);
                assert_eq!(i64::from(variances[lane]), variance);
            }
        }
    }

    /// Whole fours of rows, rows that are left over, and groups that are no multiple of four.
    #[test]
    fn rows_equal_naive_integer_sums() {
        let mut rng = seeded(8);
        for groups in 1..=WIDTH_MAX / 4 {
            for count in [1, 3, 4, 5, 8, 11] {
                let rows: [u8; 11 * WIDTH_MAX + 1] = core::array::from_fn(|_| rng.next_u32() as u8);
                let words: [u32; WIDTH_MAX / 2] = core::array::from_fn(|_| rng.next_u32());
                // One byte ahead: rows begin anywhere.
                let rows = &rows[1..][..4 * groups * count];
                let mut sums = [7; 12];
                dot_rows(rows, &words[..2 * groups], &mut sums[..count]);
                for (row, sum) in rows.chunks_exact(4 * groups).zip(sums) {
                    let mut expected = 0_i32;
                    for (input, &code) in row.iter().enumerate() {
                        let word = words[2 * (input / 4) + input % 2];
                        let value = (word >> (input % 4 / 2 * 16)) as u16 as i16;
                        expected += i32::from(code as i8) * i32::from(value);
                    }
                    assert_eq!(sum, expected);
                }
                assert_eq!(sums[count..], [7; 12][count..]);
            }
        }
    }

    /// Four passes, and one: widths that are not the widest, rows that begin anywhere.
    #[test]
    fn rows_of_passes_equal_each_row_by_itself() {
        let mut rng = seeded(9);
        for groups in 1..=WIDTH_MAX / 4 {
            for (count, start) in [(1, 0), (5, 1), (32, 0), (32, 2)] {
                let rows: [u8; 32 * WIDTH_MAX + 2] = core::array::from_fn(|_| rng.next_u32() as u8);
                let words: [[u32; 4]; WIDTH_MAX / 2] =
                    core::array::from_fn(|_| core::array::from_fn(|_| rng.next_u32()));
                let (rows, words) = (&rows[start..][..4 * groups * count], &words[..2 * groups]);
                let mut sums = [[7; 4]; 33];
                dot_pass_rows(rows, words, &mut sums[..count]);
                for (row, sums) in rows.chunks_exact(4 * groups).zip(sums) {
                    let expected = dot_means(row, words).map(i32::cast_unsigned);
                    assert_eq!(sums, expected);
                    let lane: std::vec::Vec<_> = words.iter().map(|lanes| [lanes[2]]).collect();
                    let mut single = [[0]];
                    dot_pass_rows(row, &lane, &mut single);
                    assert_eq!(single, [[expected[2]]]);
                }
                assert_eq!(sums[count..], [[7; 4]; 33][count..]);
            }
        }
    }

    #[test]
    fn decoded_variances_are_eighths_of_octaves_rounded() {
        for (code, &decoded) in VARIANCES.iter().enumerate() {
            let exact = 8191.0 * libm::exp2((code as f64 - 255.0) / 8.0);
            let expected = if code == 0 { 0.0 } else { exact };
            // Half a step, and nothing where it is a tie.
            assert!((f64::from(decoded) - expected).abs() < 0.5 + 1e-9, "{code}");
        }
        assert_eq!(VARIANCES[255], VARIANCE_MAX);
    }

    /// A row for one lane and the same row for four: whatever this build compiled either to.
    #[test]
    fn one_lane_equals_each_of_four() {
        let mut rng = seeded(2);
        let row: [u8; WIDTH_MAX] = core::array::from_fn(|_| rng.next_u32() as u8);
        let words: [[u32; 4]; WIDTH_MAX / 2] =
            core::array::from_fn(|_| core::array::from_fn(|_| rng.next_u32() & 0x0FFF_0FFF));
        let four = dots(&row, &row, &words, &words);
        for lane in 0..4 {
            let single = words.map(|word| [word[lane]]);
            let [[mean], [variance]] = dots(&row, &row, &single, &single);
            assert_eq!([mean, variance], [four[0][lane], four[1][lane]]);
        }
    }

    /// Against f64: a correctly rounded f32 root is the rounded f64 root.
    #[test]
    fn square_roots_are_correctly_rounded() {
        let mut rng = seeded(3);
        for _ in 0..10_000 {
            let x: [f32; 4] =
                core::array::from_fn(|_| f32::from_bits(rng.next_u32() % f32::INFINITY.to_bits()));
            let expected = x.map(|x| libm::sqrt(f64::from(x)) as f32);
            assert_eq!(square_roots(x), expected);
            assert_eq!(sqrt(x[0]), expected[0]);
        }
        assert!(sqrt(-1.0).is_nan());
        assert_eq!(square_roots([0.0, -0.0, 4.0, f32::INFINITY])[2], 2.0);
    }
}
