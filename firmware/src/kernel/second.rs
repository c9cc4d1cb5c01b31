//! Second moments of one layer's activations times variances or squared means of weights, in 64 bits.
//!
//! Variances of weights and of activations span many octaves: a unit that training has given up has the
//! prior's, next to nothing depends on it, and beside it those that matter are small. So nothing is
//! quantised to 16 bits here.

#[cfg(arm_dsp)]
use super::arm_second::{dot_squares, dot_variances};
use super::packed::largest_magnitude;
use crate::blob::field::WIDTH_MAX;
use crate::series;

/// Largest quantised second moment. With [`WIDTH_MAX`] inputs the sum of products with a variance stays
/// within 64 bits.
const MOMENT_MAX: u32 = 1 << 26;
const VARIANCE_MAX: u32 = 1 << 31;
const _: () = assert!(
    (WIDTH_MAX as u64 * MOMENT_MAX as u64)
        .checked_mul(VARIANCE_MAX as u64)
        .is_some()
);

/// Decoded variances relative to the layer's largest: `VARIANCE_MAX * 2^((code - 255) / 8)`.
static VARIANCES: [u32; 256] = {
    let mut table = [0; 256];
    let mut code = 1;
    while code < 256 {
        let octaves = (code as f64 - 255.0) / 8.0;
        let value = VARIANCE_MAX as f64 * series::exp(octaves * core::f64::consts::LN_2);
        table[code] = (value + 0.5) as u32;
        code += 1;
    }
    table
};

/// The quantised second moments, or variances, of one layer's activations.
pub struct Second {
    words: [[u32; 4]; WIDTH_MAX / 4],
    /// Fours in use.
    used: usize,
    /// What one step of `words` is worth.
    scale: f32,
    /// The latest sums, one for every row.
    sums: [u64; WIDTH_MAX],
}

impl Second {
    /// Room for any layer; holds no moments.
    pub const fn new() -> Self {
        Self {
            words: [[0; 4]; WIDTH_MAX / 4],
            used: 0,
            scale: 0.0,
            sums: [0; WIDTH_MAX],
        }
    }

    /// Quantises `moments`, at most [`WIDTH_MAX`], none of them negative: 26 bits over the largest. NaN or
    /// infinity gives a scale of NaN or infinity, so that no sum comes out as a number.
    #[inline]
    pub fn pack(&mut self, moments: &[f32]) {
        let largest = largest_magnitude(moments);
        let inverse = if largest > f32::MIN_POSITIVE && largest < f32::INFINITY {
            MOMENT_MAX as f32 / largest
        } else {
            0.0
        };
        self.scale = largest / MOMENT_MAX as f32;
        let (fours, rest) = moments.as_chunks::<4>();
        let mut words = self.words.iter_mut();
        self.used = 0;
        for (four, words) in fours.iter().zip(&mut words) {
            *words = four.map(|x| (x * inverse) as u32);
            self.used += 1;
        }
        if let (false, Some(words)) = (rest.is_empty(), words.next()) {
            *words = [0; 4];
            for (word, x) in words.iter_mut().zip(rest) {
                *word = (x * inverse) as u32;
            }
            self.used += 1;
        }
    }

    /// For each of `count` of `rows` the sum over inputs of variance times moment, in units of the
    /// layer's largest variance. Rows are variance codes padded with zeros to a multiple of four.
    #[inline]
    pub fn dot_variances<'s>(
        &'s mut self,
        rows: &[u8],
        count: usize,
    ) -> impl Iterator<Item = f32> + use<'s> {
        let words = self.words.get(..self.used).unwrap_or(&self.words);
        let count = count.min(WIDTH_MAX);
        let sums = &mut self.sums[..count];
        let rows = rows.get(..4 * words.len() * count).unwrap_or_default();
        dot_variances(rows, words, &VARIANCES, sums);
        let scale = self.scale / VARIANCE_MAX as f32;
        sums.iter().map(move |&sum| single(sum) * scale)
    }

    /// For each of `count` of `rows` the sum over inputs of squared int8 code times moment. Rows are
    /// padded with zeros to a multiple of four.
    #[inline]
    pub fn dot_squares<'s>(
        &'s mut self,
        rows: &[u8],
        count: usize,
    ) -> impl Iterator<Item = f32> + use<'s> {
        let words = self.words.get(..self.used).unwrap_or(&self.words);
        let count = count.min(WIDTH_MAX);
        let sums = &mut self.sums[..count];
        let rows = rows.get(..4 * words.len() * count).unwrap_or_default();
        dot_squares(rows, words, sums);
        let scale = self.scale;
        sums.iter().map(move |&sum| single(sum) * scale)
    }
}

impl Default for Second {
    fn default() -> Self {
        Self::new()
    }
}

/// Its two words converted apart: no target has to call for that.
#[inline]
fn single(sum: u64) -> f32 {
    (sum >> 32) as u32 as f32 * 4_294_967_296.0 + sum as u32 as f32
}

/// For each row of codes, four for each of `words`, the sum of what `table` makes of the codes times
/// their words.
#[cfg(not(arm_dsp))]
fn dot_variances(rows: &[u8], words: &[[u32; 4]], table: &[u32; 256], sums: &mut [u64]) {
    sum_rows(rows, words, sums, |code| table[usize::from(code)]);
}

/// For each row of int8 codes, four for each of `words`, the sum of their squares times their words.
#[cfg(not(arm_dsp))]
fn dot_squares(rows: &[u8], words: &[[u32; 4]], sums: &mut [u64]) {
    sum_rows(rows, words, sums, |code| {
        let code = u32::from((code as i8).unsigned_abs());
        code * code
    });
}

#[cfg(not(arm_dsp))]
#[inline]
fn sum_rows(rows: &[u8], words: &[[u32; 4]], sums: &mut [u64], decode: impl Fn(u8) -> u32) {
    for (row, sum) in rows.chunks((4 * words.len()).max(1)).zip(sums) {
        let products = row.iter().zip(words.as_flattened());
        *sum = products
            .map(|(&code, &word)| u64::from(decode(code)) * u64::from(word))
            .sum();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::field::row_stride;
    use crate::gaussian::standard_normal;
    use crate::rng::seeded;
    use rand_core::Rng;
    use std::vec::Vec;

    /// Naive f64 sums, at widths with and without a rest, for one row and more, beside a moment that is
    /// larger by far and whose weight has none.
    #[test]
    fn sums_are_naive_sums() {
        let mut rng = seeded(11);
        let mut second = Second::default();
        for (inputs, outputs) in [(64, 64), (64, 3), (13, 5), (2, 4), (1, 1), (50, 7), (64, 1)] {
            let mut moments: Vec<f32> = (0..inputs)
                .map(|_| 30.0 * standard_normal(&mut rng).abs())
                .collect();
            moments[0] *= 1e4;
            let largest = f64::from(moments.iter().fold(0.0_f32, |a, &x| a.max(x)));
            let stride = row_stride(inputs);
            let mut rows = std::vec![0_u8; outputs * stride];
            for row in rows.chunks_exact_mut(stride) {
                row[..inputs].fill_with(|| rng.next_u32() as u8);
                if inputs > 1 {
                    row[0] = 0;
                }
            }
            second.pack(&moments);
            let variances: Vec<f32> = second.dot_variances(&rows, outputs).collect();
            let squares: Vec<f32> = second.dot_squares(&rows, outputs).collect();
            assert_eq!((variances.len(), squares.len()), (outputs, outputs));
            for (index, row) in rows.chunks_exact(stride).enumerate() {
                let (mut variance, mut square) = (0.0, 0.0);
                for (&code, &x) in row.iter().zip(&moments) {
                    let x = f64::from(x);
                    if code > 0 {
                        variance += libm::exp2((f64::from(code) - 255.0) / 8.0) * x;
                    }
                    square += f64::from(code as i8) * f64::from(code as i8) * x;
                }
                for (got, expected) in [(variances[index], variance), (squares[index], square)] {
                    let error = (f64::from(got) - expected).abs();
                    assert!(
                        error < 1e-3 * expected + 1e-6 * largest,
                        "{inputs}: {got} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn what_is_not_finite_does_not_come_out_as_a_number() {
        for bad in [f32::NAN, f32::INFINITY] {
            let mut second = Second::new();
            second.pack(&[0.5, 0.5, bad, 0.5]);
            assert!(second.dot_variances(&[9; 8], 2).all(|sum| !sum.is_finite()));
            assert!(second.dot_squares(&[9; 8], 2).all(|sum| !sum.is_finite()));
        }
    }

    #[test]
    fn no_moments_are_no_sums() {
        let mut second = Second::new();
        second.pack(&[0.0; 4]);
        assert!(second.dot_variances(&[9; 8], 2).all(|sum| sum == 0.0));
        second.pack(&[]);
        assert!(second.dot_squares(&[], 2).all(|sum| sum == 0.0));
    }

    /// Full scale of both: the sum does not wrap.
    #[test]
    fn the_largest_sums_fit() {
        let mut second = Second::new();
        second.pack(&[2.0; 64]);
        let sum = second.dot_variances(&[255; 64], 1).next().unwrap();
        assert!((sum - 128.0).abs() < 1e-4, "{sum}");
        let sum = second.dot_squares(&[0x80; 64], 1).next().unwrap();
        assert!((sum - 128.0 * 16_384.0).abs() < 1.0, "{sum}");
    }

    #[test]
    fn decoded_variances_are_eighths_of_octaves_rounded() {
        for (code, &decoded) in VARIANCES.iter().enumerate() {
            let exact = f64::from(VARIANCE_MAX) * libm::exp2((code as f64 - 255.0) / 8.0);
            let expected = if code == 0 { 0.0 } else { exact };
            assert!((f64::from(decoded) - expected).abs() < 0.5 + 1e-5, "{code}");
        }
    }
}
