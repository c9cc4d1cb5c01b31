//! Integer dot products of int8 weights and 16-bit activations, several passes at a time.
//!
//! The only module that may hold `unsafe` or assembly: DSP instructions on the microcontroller,
//! SSE2 on the host, with a portable twin beside them; all give the same integers. Lanes are Monte Carlo passes, so an
//! unpacked weight serves `L` passes (weight-stationary), and lane-wise arithmetic never reorders
//! a sum.
//!
//! Four consecutive inputs 4q..4q+3 are two words of two signed 16-bit halves, low half first:
//! word 2q holds inputs 4q and 4q+2, word 2q+1 holds 4q+1 and 4q+3, which is how SXTB16 unpacks
//! four int8 weights.
#![allow(unsafe_code)]

#[cfg_attr(target_arch = "x86_64", path = "kernel/sse2.rs")]
#[cfg_attr(arm_dsp, path = "kernel/arm.rs")]
#[cfg(any(target_arch = "x86_64", arm_dsp))]
mod four_lanes;

use crate::blob::field::WIDTH_MAX;
use crate::series;

/// Words that hold the activations of the widest layer.
const WORDS: usize = WIDTH_MAX / 2;
/// Largest magnitude of a quantised activation.
const VALUE_MAX: f32 = 32_767.0;
/// Largest quantised squared activation (12 bits).
const SQUARE_MAX: f32 = 4_095.0;
/// Quantised square of a quantised activation of 1.
const SQUARE_STEP: f32 = SQUARE_MAX / (VALUE_MAX * VALUE_MAX);
/// 1.5 * 2^23: adding it leaves the rounded integer in the low mantissa bits.
const ROUNDER: f32 = 12_582_912.0;
/// Largest decoded variance (13 bits). With 12-bit squares and [`WIDTH_MAX`] inputs the sum of
/// products stays below 2^31.
const VARIANCE_MAX: u16 = 8_191;
const _: () =
    assert!(WIDTH_MAX as u64 * VARIANCE_MAX as u64 * SQUARE_MAX as u64 <= i32::MAX as u64);
const _: () = assert!(WIDTH_MAX as u64 * VALUE_MAX as u64 * 128 <= i32::MAX as u64);

/// Decoded variances relative to the layer's largest: `VARIANCE_MAX * 2^((code - 255) / 8)`.
static VARIANCES: [u16; 256] = {
    let mut table = [0; 256];
    let mut code = 1;
    while code < 256 {
        let octaves = (code as f64 - 255.0) / 8.0;
        let value = VARIANCE_MAX as f64 * series::exp(octaves * core::f64::consts::LN_2);
        table[code] = (value + 0.5) as u16;
        code += 1;
    }
    table
};

/// The quantised activations of one layer, and their squares, for `L` passes.
pub struct Packed<const L: usize> {
    values: [[u32; L]; WORDS],
    squares: [[u32; L]; WORDS],
    /// What one step of `values` is worth, per pass.
    value_scale: [f32; L],
    /// What one step of a product of a square and a variance is worth, per pass, when the layer's
    /// largest variance is 1.
    variance_scale: [f32; L],
}

impl<const L: usize> Packed<L> {
    /// Room for any layer; holds zeros.
    pub const fn new() -> Self {
        Self {
            values: [[0; L]; WORDS],
            squares: [[0; L]; WORDS],
            value_scale: [0.0; L],
            variance_scale: [0.0; L],
        }
    }

    /// Quantises `activations` (`[input][pass]`, at most [`WIDTH_MAX`] inputs): 16 bits over the
    /// largest magnitude of each pass. A pass that holds NaN or infinity gets a scale of NaN or
    /// infinity, so that it cannot come out as a number.
    pub fn pack(&mut self, activations: &[[f32; L]]) {
        let largest = largest_magnitudes(activations);
        let mut inverse = [0.0; L];
        for lane in 0..L {
            let largest = largest[lane];
            inverse[lane] = if largest > f32::MIN_POSITIVE && largest < f32::INFINITY {
                VALUE_MAX / largest
            } else {
                0.0
            };
            self.value_scale[lane] = largest / VALUE_MAX;
            self.variance_scale[lane] = largest * largest / (SQUARE_MAX * VARIANCE_MAX as f32);
        }
        quantise(activations, &inverse, &mut self.values, &mut self.squares);
    }

    /// Sum over inputs of mean code times activation, in units of the channel scale.
    ///
    /// `row` holds int8 codes, padded with zeros to a multiple of four.
    #[inline]
    pub fn dot_means(&self, row: &[u8]) -> [f32; L] {
        let sums = dot_means(row, &self.values);
        core::array::from_fn(|lane| sums[lane] as f32 * self.value_scale[lane])
    }

    /// [`Packed::dot_means`] of `means`, and the sum over inputs of variance times squared
    /// activation, in units of the layer's largest variance. Variances below 1/16,000 of the
    /// largest count as zero here.
    ///
    /// Both rows are equally long and padded with zeros to a multiple of four.
    #[inline]
    pub fn dots(&self, means: &[u8], codes: &[u8]) -> ([f32; L], [f32; L]) {
        let [means, variances] = dots(means, codes, &self.values, &self.squares);
        (
            core::array::from_fn(|lane| means[lane] as f32 * self.value_scale[lane]),
            core::array::from_fn(|lane| variances[lane] as f32 * self.variance_scale[lane]),
        )
    }
}

impl<const L: usize> Default for Packed<L> {
    fn default() -> Self {
        Self::new()
    }
}

/// Largest magnitude of each pass; infinity or NaN if there is one.
#[inline]
fn largest_magnitudes<const L: usize>(activations: &[[f32; L]]) -> [f32; L] {
    #[cfg(arm_dsp)]
    if L == 4 {
        let largest = four_lanes::largest_magnitudes(activations.as_flattened());
        return core::array::from_fn(|lane| f32::from_bits(largest[lane]));
    }
    core::array::from_fn(|lane| {
        // Magnitudes order like their bits, and what is not finite comes out on top.
        let magnitude = |row: &[f32; L]| row[lane].to_bits() & 0x7FFF_FFFF;
        f32::from_bits(activations.iter().map(magnitude).max().unwrap_or(0))
    })
}

/// Writes the words of `activations` times `inverse`, and of their squares, rounded; zeros stand
/// for the inputs that a last group lacks.
#[inline]
fn quantise<const L: usize>(
    activations: &[[f32; L]],
    inverse: &[f32; L],
    values: &mut [[u32; L]],
    squares: &mut [[u32; L]],
) {
    #[cfg(arm_vfp)]
    let (activations, values, squares) = if L == 4 {
        let groups = activations.len() / 4;
        let (whole, rest) = activations.split_at(4 * groups);
        let (values, rest_values) = values.split_at_mut(2 * groups);
        let (squares, rest_squares) = squares.split_at_mut(2 * groups);
        four_lanes::quantise(
            whole.as_flattened(),
            inverse,
            values.as_flattened_mut(),
            squares.as_flattened_mut(),
        );
        (rest, rest_values, rest_squares)
    } else {
        (activations, values, squares)
    };
    for (group, words) in activations
        .chunks(4)
        .zip(values.chunks_exact_mut(2).zip(squares.chunks_exact_mut(2)))
    {
        let (values, squares) = words;
        for lane in 0..L {
            let mut quantised = [0_u32; 4];
            let mut squared = [0_u32; 4];
            for (i, row) in group.iter().enumerate() {
                let q = row[lane] * inverse[lane];
                quantised[i] = round(q);
                squared[i] = round(q * q * SQUARE_STEP);
            }
            values[0][lane] = halves(quantised[0], quantised[2]);
            values[1][lane] = halves(quantised[1], quantised[3]);
            squares[0][lane] = halves(squared[0], squared[2]);
            squares[1][lane] = halves(squared[1], squared[3]);
        }
    }
}

/// Nearest integer of |x| < 2^15, ties to even, as the low half of a word in two's complement.
#[inline]
fn round(x: f32) -> u32 {
    (x + ROUNDER).to_bits() & 0xFFFF
}

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

/// GELU of four numbers, as [`crate::activation::gelu`] interpolates it in `table`.
#[cfg(arm_vfp)]
#[inline]
pub fn gelus(x: [f32; 4], table: &[[f32; 2]; crate::activation::ENTRIES]) -> [f32; 4] {
    four_lanes::gelus(x, table)
}

/// [`sqrt`] of each of four numbers.
#[inline]
pub fn square_roots(x: [f32; 4]) -> [f32; 4] {
    #[cfg(arm_vfp)]
    {
        four_lanes::square_roots(x)
    }
    #[cfg(not(arm_vfp))]
    x.map(libm::sqrtf)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaussian::standard_normal;
    use crate::rng::seeded;
    use rand_core::Rng;

    /// The integers by their definition, for whatever this build compiled the sums to.
    #[test]
    fn instructions_equal_naive_integer_sums() {
        let mut rng = seeded(1);
        let mut words = [[0_u32; 4]; WORDS];
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

    /// Naive f64 sums over the unquantised activations.
    #[test]
    fn dot_products_agree_with_naive_f64() {
        let mut rng = seeded(2);
        for inputs in [1, 4, 13, 50, 64] {
            let activations: [[f32; 4]; WIDTH_MAX] =
                core::array::from_fn(|_| core::array::from_fn(|_| 3.0 * standard_normal(&mut rng)));
            let activations = &activations[..inputs];
            let mut row = [0_u8; WIDTH_MAX];
            let mut codes = [0_u8; WIDTH_MAX];
            for i in 0..inputs {
                row[i] = rng.next_u32() as u8;
                codes[i] = 200 + (rng.next_u32() % 56) as u8;
            }
            let stride = inputs.next_multiple_of(4);
            let mut packed = Packed::<4>::new();
            packed.pack(activations);
            let (means, variances) = packed.dots(&row[..stride], &codes[..stride]);
            for lane in 0..4 {
                let (mut mean, mut mean_size, mut variance) = (0.0, 0.0, 0.0);
                for i in 0..inputs {
                    let x = f64::from(activations[i][lane]);
                    mean += f64::from(row[i] as i8) * x;
                    mean_size += f64::from((row[i] as i8).unsigned_abs()) * x.abs();
                    variance += libm::exp2((f64::from(codes[i]) - 255.0) / 8.0) * x * x;
                }
                // 16-bit activations: half a step of 1/32767 of the largest, at most its share.
                assert!((f64::from(means[lane]) - mean).abs() < 2e-4 * (1.0 + mean_size));
                // 12-bit squares and 13-bit variances.
                assert!((f64::from(variances[lane]) / variance - 1.0).abs() < 0.01);
            }
        }
    }

    #[test]
    fn lanes_do_not_mix() {
        let mut rng = seeded(4);
        let wide: [[f32; 4]; 16] =
            core::array::from_fn(|_| core::array::from_fn(|_| standard_normal(&mut rng)));
        let row: [u8; 16] = core::array::from_fn(|_| rng.next_u32() as u8);
        let mut packed = Packed::<4>::new();
        packed.pack(&wide);
        let together = packed.dots(&row, &row);
        for lane in 0..4 {
            let mut single = Packed::<1>::new();
            single.pack(&wide.map(|x| [x[lane]]));
            assert_eq!(together.0[lane], single.dot_means(&row)[0]);
            assert_eq!(together.1[lane], single.dots(&row, &row).1[0]);
        }
    }

    #[test]
    fn what_is_not_finite_does_not_come_out_as_a_number() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut packed = Packed::<1>::new();
            packed.pack(&[[1.0], [bad], [0.5]]);
            assert!(!packed.dot_means(&[1, 1, 1, 0])[0].is_finite());
        }
    }

    #[test]
    fn zero_activations_give_zero() {
        let mut packed = Packed::<2>::new();
        packed.pack(&[[0.0, 1.0]; 5]);
        let (means, variances) = packed.dots(&[127; 8], &[255; 8]);
        assert_eq!((means[0], variances[0]), (0.0, 0.0));
    }
}
