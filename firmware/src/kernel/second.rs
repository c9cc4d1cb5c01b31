//! Second moments of one layer's activations times variances or squared means of weights, in 64 bits.
//!
//! Variances of weights and of activations span many octaves: a unit that training has given up has the
//! prior's, next to nothing depends on it, and beside it those that matter are small. So nothing is
//! quantised to 16 bits here.

use super::alike::Alike;
#[cfg(arm_dsp)]
use super::arm_second::{sum_squares, sum_variances};
use super::decoded;
use super::packed::largest_magnitude;
use super::picked::{self, Picked, RowBits};
use crate::blob::field::WIDTH_MAX;

/// Largest quantised second moment. With [`WIDTH_MAX`] inputs the sum of products with a variance stays
/// within 64 bits.
const MOMENT_MAX: u32 = 1 << 26;
/// Largest decoded variance.
const VARIANCE_MAX: u32 = 1 << 31;
const _: () = assert!(
    (WIDTH_MAX as u64 * MOMENT_MAX as u64)
        .checked_mul(VARIANCE_MAX as u64)
        .is_some()
);

/// Decoded variances relative to the layer's largest.
static VARIANCES: [u32; 256] = {
    let mut table = [0; 256];
    let mut code = 1;
    while code < table.len() {
        table[code] = decoded(code as u8, VARIANCE_MAX);
        code += 1;
    }
    table
};

/// The quantised second moments, or variances, of one layer's activations.
#[derive(Debug)]
pub struct Second {
    words: [[u32; 4]; WIDTH_MAX / 4],
    /// Fours in use.
    used: usize,
    /// What one step of `words` is worth.
    scale: f32,
    /// Rows that are summed.
    picked: Picked,
    /// Their sums.
    sums: [u64; WIDTH_MAX],
}

impl Second {
    /// Room for any layer; holds no moments.
    pub const fn new() -> Self {
        Self {
            words: [[0; 4]; WIDTH_MAX / 4],
            used: 0,
            scale: 0.0,
            picked: Picked::new(),
            sums: [0; WIDTH_MAX],
        }
    }

    /// Quantises `moments`, at most [`WIDTH_MAX`], none of them negative: 26 bits over the largest. NaN or
    /// infinity gives a scale of NaN or infinity, so that no sum comes out as a number.
    #[inline]
    pub fn pack(&mut self, moments: &[f32]) {
        let largest = largest_magnitude(moments);
        let inverse = MOMENT_MAX as f32 / largest;
        // Of moments so small that nothing depends on them it is no number.
        let inverse = if inverse.is_finite() { inverse } else { 0.0 };
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

    /// Writes for each row the sum over inputs of variance times moment, in units of the layer's largest
    /// variance. Rows are variance codes padded with zeros to a multiple of four. A row that another of them stands
    /// for has its sum.
    pub fn dot_variances(&mut self, rows: &[u8], alike: Alike, into: &mut [f32]) {
        let words = self.words.get(..self.used).unwrap_or(&self.words);
        self.picked
            .pick(picked::leading(into.len()) & !alike.others);
        let sums = self.sums.get_mut(..self.picked.rows().len());
        let sums = sums.unwrap_or_default();
        sum_variances(rows, words, &self.picked, &VARIANCES, sums);
        let scale = self.scale / VARIANCE_MAX as f32;
        let own = sums
            .get(alike.own())
            .map_or(0.0, |&sum| single(sum) * scale);
        into.fill(own);
        for (&row, &mut sum) in self.picked.rows().iter().zip(sums) {
            if let Some(into) = into.get_mut(usize::from(row)) {
                *into = single(sum) * scale;
            }
        }
    }

    /// Calls `each(row, sum)` with the sum over inputs of squared int8 code times moment for each row that is
    /// `wanted`. Rows are padded with zeros to a multiple of four.
    #[inline]
    pub fn dot_squares(&mut self, rows: &[u8], wanted: RowBits, mut each: impl FnMut(usize, f32)) {
        let words = self.words.get(..self.used).unwrap_or(&self.words);
        self.picked.pick(wanted);
        let sums = self.sums.get_mut(..self.picked.rows().len());
        let sums = sums.unwrap_or_default();
        sum_squares(rows, words, &self.picked, sums);
        for (&row, &mut sum) in self.picked.rows().iter().zip(sums) {
            each(usize::from(row), single(sum) * self.scale);
        }
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

/// For each row of codes that was picked, four codes for each of `words`, the sum of what `table` makes of
/// the codes times their words.
#[cfg(not(arm_dsp))]
fn sum_variances(
    rows: &[u8],
    words: &[[u32; 4]],
    picked: &Picked,
    table: &[u32; 256],
    sums: &mut [u64],
) {
    sum_rows(rows, words, picked, sums, |code| table[usize::from(code)]);
}

/// For each row of int8 codes that was picked, four for each of `words`, the sum of their squares times their
/// words.
#[cfg(not(arm_dsp))]
fn sum_squares(rows: &[u8], words: &[[u32; 4]], picked: &Picked, sums: &mut [u64]) {
    sum_rows(rows, words, picked, sums, |code| {
        let code = u32::from((code as i8).unsigned_abs());
        code * code
    });
}

#[cfg(not(arm_dsp))]
#[inline]
fn sum_rows(
    rows: &[u8],
    words: &[[u32; 4]],
    picked: &Picked,
    sums: &mut [u64],
    decode: impl Fn(u8) -> u32,
) {
    let stride = 4 * words.len();
    let rows = rows.get(..picked.end() * stride).unwrap_or_default();
    for (&row, sum) in picked.rows().iter().zip(sums) {
        let row = rows.get(usize::from(row) * stride..).unwrap_or_default();
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

    /// Sums of two rows.
    fn both(second: &mut Second, rows: &[u8]) -> [[f32; 2]; 2] {
        let mut sums = [[f32::NAN; 2]; 2];
        second.dot_variances(rows, Alike::NONE, &mut sums[0]);
        second.dot_squares(rows, 0b11, |row, sum| sums[1][row] = sum);
        sums
    }

    /// Rows that another one stands for have its sum, whether it lies before or behind; all others have their own.
    #[test]
    fn rows_alike_have_one_sum() {
        let mut rng = seeded(12);
        let mut second = Second::new();
        for inputs in [8, 32, 61, 64] {
            let moments: Vec<f32> = (0..inputs)
                .map(|_| 0.5 + standard_normal(&mut rng).abs())
                .collect();
            second.pack(&moments);
            let stride = row_stride(inputs);
            let mut rows = std::vec![0_u8; 40 * stride];
            for row in rows.chunks_exact_mut(stride) {
                row[..inputs].fill_with(|| rng.next_u32() as u8);
            }
            let mut alone = [f32::NAN; 40];
            second.dot_variances(&rows, Alike::NONE, &mut alone);
            let alike = Alike {
                others: 1 << 2 | 1 << 7 | 1 << 35,
                first: 4,
            };
            let mut sums = [f32::NAN; 40];
            second.dot_variances(&rows, alike, &mut sums);
            for (row, sum) in sums.iter().enumerate() {
                let own = if [2, 7, 35].contains(&row) { 4 } else { row };
                assert_eq!(*sum, alone[own], "{inputs} {row}");
            }
        }
    }

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
            let mut variances = std::vec![f32::NAN; outputs];
            second.dot_variances(&rows, Alike::NONE, &mut variances);
            let mut squares = std::vec![0.0; outputs];
            let wanted = |index| index % 3 != 1;
            let bits = picked::row_bits((0..outputs).map(wanted));
            second.dot_squares(&rows, bits, |row, sum| squares[row] = sum);
            for (index, row) in rows.chunks_exact(stride).enumerate() {
                let (mut variance, mut square) = (0.0, 0.0);
                for (&code, &x) in row.iter().zip(&moments) {
                    let x = f64::from(x);
                    if code > 0 {
                        variance += libm::exp2((f64::from(code) - 255.0) / 8.0) * x;
                    }
                    square += f64::from(code as i8) * f64::from(code as i8) * x;
                }
                if !wanted(index) {
                    square = 0.0;
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
            let [variances, squares] = both(&mut second, &[9; 8]);
            assert!(variances.iter().chain(&squares).all(|sum| !sum.is_finite()));
        }
    }

    #[test]
    fn no_moments_are_no_sums() {
        let mut second = Second::new();
        second.pack(&[0.0; 4]);
        assert_eq!(both(&mut second, &[9; 8]), [[0.0; 2]; 2]);
        second.pack(&[]);
        assert_eq!(both(&mut second, &[]), [[0.0; 2]; 2]);
    }

    /// Full scale of both: the sum does not wrap.
    #[test]
    fn the_largest_sums_fit() {
        let mut second = Second::new();
        second.pack(&[2.0; 64]);
        let [[sum, _], _] = both(&mut second, &[255; 128]);
        assert!((sum - 128.0).abs() < 1e-4, "{sum}");
        let [_, [_, sum]] = both(&mut second, &[0x80; 128]);
        assert!((sum - 128.0 * 16_384.0).abs() < 1.0, "{sum}");
        // So small that what makes 26 bits of them is no number.
        second.pack(&[1.9e-31; 64]);
        let [[sum, _], _] = both(&mut second, &[255; 128]);
        assert!((0.0..1e-28).contains(&sum), "{sum}");
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
