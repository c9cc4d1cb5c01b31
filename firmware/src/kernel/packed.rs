//! The activations of one layer as the integer kernels read them.

#[cfg(arm_vfp)]
use super::vfp;
use super::{SQUARE_MAX, VARIANCE_MAX, dot_pass_rows, dots, halves};
use crate::blob::field::WIDTH_MAX;

/// Words that hold the activations of the widest layer.
pub(super) const WORDS: usize = WIDTH_MAX / 2;
/// Largest magnitude of a quantised activation.
pub(super) const VALUE_MAX: f32 = 32_767.0;
const _: () = assert!(WIDTH_MAX as u64 * VALUE_MAX as u64 * 128 <= i32::MAX as u64);
/// Quantised square of a quantised activation of 1.
pub(super) const SQUARE_STEP: f32 = SQUARE_MAX / (VALUE_MAX * VALUE_MAX);
/// 1.5 * 2^23: adding it leaves the rounded integer in the low mantissa bits.
pub(super) const ROUNDER: f32 = 12_582_912.0;

/// The quantised activations of one layer, and their squares, for `L` passes.
#[derive(Debug)]
pub struct Packed<const L: usize> {
    values: [[u32; L]; WORDS],
    /// Or the latest sums over inputs of code times value, where the values alone are packed.
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
            inverse[lane] = steps_per_unit(largest);
            self.value_scale[lane] = largest / VALUE_MAX;
            self.variance_scale[lane] = largest * largest / (SQUARE_MAX * VARIANCE_MAX as f32);
        }
        quantise(activations, &inverse, &mut self.values, &mut self.squares);
    }

    /// As [`Packed::pack`], without the squares: for [`Packed::dot_rows`] alone.
    pub fn pack_values(&mut self, activations: &[[f32; L]]) {
        let largest = largest_magnitudes(activations);
        self.value_scale = largest.map(|largest| largest / VALUE_MAX);
        quantise_values(activations, &largest.map(steps_per_unit), &mut self.values);
    }

    /// Calls `each` for every row with the sums over inputs of mean times activation, in units of the channel
    /// scale.
    ///
    /// `rows` are int8 codes, each padded with zeros to the same multiple of four, `stride`.
    #[inline]
    pub fn dot_rows(&mut self, rows: &[u8], stride: usize, mut each: impl FnMut([f32; L])) {
        let stride = stride.max(1);
        let Some(words) = self.values.get(..stride / 2) else {
            return;
        };
        for rows in rows.chunks(WORDS * stride) {
            let Some(sums) = self.squares.get_mut(..rows.len() / stride) else {
                return;
            };
            dot_pass_rows(rows, words, sums);
            for sums in sums {
                each(core::array::from_fn(|lane| {
                    sums[lane].cast_signed() as f32 * self.value_scale[lane]
                }));
            }
        }
    }

    /// Sum over inputs of mean times activation, in units of the channel scale, and of variance times
    /// squared activation, in units of the layer's largest variance. Variances below 1/16,000 of the
    /// largest count as zero here.
    ///
    /// `means` are int8 codes; both rows are equally long and padded with zeros to a multiple of four.
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

/// Steps of a quantised activation per unit, when the magnitude `largest` has all of them; zero when
/// there is nothing to tell apart.
#[inline]
pub(super) fn steps_per_unit(largest: f32) -> f32 {
    if largest > f32::MIN_POSITIVE && largest < f32::INFINITY {
        VALUE_MAX / largest
    } else {
        0.0
    }
}

/// Largest magnitude of one pass; infinity or NaN if there is one.
#[inline]
pub(super) fn largest_magnitude(activations: &[f32]) -> f32 {
    let (fours, rest) = activations.as_chunks::<4>();
    let [rest] = largest_magnitudes(rest.as_chunks().0);
    let largest = largest_magnitudes(fours).into_iter().map(f32::to_bits);
    f32::from_bits(largest.fold(rest.to_bits(), u32::max))
}

/// Largest magnitude of each pass; infinity or NaN if there is one.
#[inline]
pub(super) fn largest_magnitudes<const L: usize>(activations: &[[f32; L]]) -> [f32; L] {
    #[cfg(arm_dsp)]
    if L == 4 {
        let largest = super::four_lanes::largest_magnitudes(activations.as_flattened());
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
        vfp::quantise(
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

/// Writes the words of `activations` times `inverse`, as [`quantise`] does.
#[inline]
fn quantise_values<const L: usize>(
    activations: &[[f32; L]],
    inverse: &[f32; L],
    values: &mut [[u32; L]],
) {
    #[cfg(arm_vfp)]
    let (activations, values) = if L == 4 {
        let (whole, rest) = activations.as_chunks::<4>();
        let (pairs, _) = values.as_chunks_mut::<2>();
        let (pairs, left) = pairs.split_at_mut(whole.len().min(pairs.len()));
        vfp::quantise_values(
            whole.as_flattened().as_flattened(),
            inverse,
            pairs.as_flattened_mut().as_flattened_mut(),
        );
        (rest, left.as_flattened_mut())
    } else {
        (activations, values)
    };
    for (group, words) in activations.chunks(4).zip(values.chunks_exact_mut(2)) {
        for lane in 0..L {
            let mut quantised = [0_u32; 4];
            for (slot, row) in quantised.iter_mut().zip(group) {
                *slot = round(row[lane] * inverse[lane]);
            }
            words[0][lane] = halves(quantised[0], quantised[2]);
            words[1][lane] = halves(quantised[1], quantised[3]);
        }
    }
}

/// Nearest integer of |x| < 2^15, ties to even, as the low half of a word in two's complement.
#[inline]
pub(super) fn round(x: f32) -> u32 {
    (x + ROUNDER).to_bits() & 0xFFFF
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaussian::standard_normal;
    use crate::rng::seeded;
    use rand_core::Rng;

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
            let ([mean], [variance]) = single.dots(&row, &row);
            assert_eq!((together.0[lane], together.1[lane]), (mean, variance));
        }
    }

    #[test]
    fn what_is_not_finite_does_not_come_out_as_a_number() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut packed = Packed::<1>::new();
            packed.pack(&[[1.0], [bad], [0.5]]);
            assert!(!packed.dots(&[1, 1, 1, 0], &[0; 4]).0[0].is_finite());
        }
    }

    #[test]
    fn zero_activations_give_zero() {
        let mut packed = Packed::<2>::new();
        packed.pack(&[[0.0, 1.0]; 5]);
        let (means, variances) = packed.dots(&[127; 8], &[255; 8]);
        assert_eq!((means[0], variances[0]), (0.0, 0.0));
    }

    #[test]
    fn memory_is_what_the_widest_layer_needs() {
        // Two halves a word: 32 words of values and of squares for each lane, and two scales.
        assert_eq!(size_of::<Packed<1>>(), 4 * (32 + 32 + 2));
        assert_eq!(size_of::<Packed<4>>(), 4 * size_of::<Packed<1>>());
    }

    /// Codes of one input at a time read back what was quantised, in f64.
    #[test]
    fn values_are_16_bits_and_squares_12_bits_of_the_largest() {
        let mut rng = seeded(6);
        let activations: [[f32; 1]; 7] =
            core::array::from_fn(|_| [1000.0 * standard_normal(&mut rng)]);
        let largest = activations.iter().fold(0.0_f32, |a, x| a.max(x[0].abs()));
        let largest = f64::from(largest);
        let mut packed = Packed::<1>::new();
        packed.pack(&activations);
        for (input, x) in activations.iter().enumerate() {
            let x = f64::from(x[0]);
            let mut row = [0; 8];
            row[input] = 1;
            let mean = f64::from(packed.dots(&row, &[0; 8]).0[0]);
            assert!((mean - x).abs() <= 0.501 * largest / 32_767.0, "{mean} {x}");
            row[input] = 255;
            let variance = f64::from(packed.dots(&[0; 8], &row).1[0]);
            let step = largest * largest / 4_095.0;
            assert!((variance - x * x).abs() <= 0.502 * step, "{variance} {x}");
        }
    }

    #[test]
    fn a_shorter_layer_after_a_longer_one_leaves_its_rest_unread() {
        let mut packed = Packed::<1>::new();
        packed.pack(&[[9.0]; 8]);
        packed.pack(&[[1.0]; 3]);
        assert_eq!(packed.dots(&[1, 1, 1, 0], &[0; 4]).0[0], 3.0);
    }
}
