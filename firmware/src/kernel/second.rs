//! Sums in 64 bits of decoded variances times what a [`Vector`] holds: second moments of activations.

#[cfg(arm_dsp)]
use super::arm_second;
use super::{VARIANCE_MAX, Vector};
#[cfg(not(arm_dsp))]
use super::{VARIANCES, halves};

/// Bits of a sum that are dropped, so that what is left fits a word.
#[cfg(not(arm_dsp))]
pub(super) const DROPPED: u32 = 8;
/// What is left of a sum counts so many.
pub(super) const STEP: f32 = 256.0;

impl Vector {
    /// Writes to `sums` for each of `rows` the sum over inputs of variance times activation, in
    /// units of the layer's largest variance. Variances below 1/16,000 of that count as zero here.
    ///
    /// Rows are variance codes padded with zeros to a multiple of four, at least as many as there are
    /// sums; no activation is negative.
    pub fn dot_variances(&mut self, rows: &[u8], sums: &mut [f32]) {
        let words = self.words.get(..self.used).unwrap_or(&self.words);
        let (words, _) = words.as_chunks();
        let count = sums.len().min(self.sums.len());
        let integers = &mut self.sums[..count];
        let rows = rows.get(..4 * words.len() * count).unwrap_or_default();
        #[cfg(arm_dsp)]
        arm_second::dot_variances(rows, words, integers);
        #[cfg(not(arm_dsp))]
        dot_variances(rows, words, integers);
        let scale = self.scale * (STEP / VARIANCE_MAX as f32);
        for (sum, &integer) in sums.iter_mut().zip(&*integers) {
            *sum = integer as f32 * scale;
        }
    }
}

/// For each row of four codes for every pair of `words` the sum of the decoded variances times their
/// halves, less the lowest eight bits.
#[cfg(not(arm_dsp))]
fn dot_variances(rows: &[u8], words: &[[u32; 2]], sums: &mut [i32]) {
    for (row, sum) in rows.chunks((4 * words.len()).max(1)).zip(sums) {
        let mut total = 0;
        for (codes, words) in row.as_chunks::<4>().0.iter().zip(words) {
            let [a, b, c, d] = codes.map(|code| u32::from(VARIANCES[usize::from(code)]));
            total = multiply_accumulate_long(total, halves(a, c), words[0]);
            total = multiply_accumulate_long(total, halves(b, d), words[1]);
        }
        *sum = (total >> DROPPED) as i32;
    }
}

/// `sum` plus the products of the two halves of `a` and `b`.
#[cfg(not(arm_dsp))]
#[inline]
pub(super) fn multiply_accumulate_long(sum: i64, a: u32, b: u32) -> i64 {
    let product = |a: u32, b: u32| i64::from(a as u16 as i16) * i64::from(b as u16 as i16);
    sum + product(a, b) + product(a >> 16, b >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::field::row_stride;
    use crate::gaussian::standard_normal;
    use crate::rng::seeded;
    use rand_core::Rng;
    use std::vec::Vec;

    /// Naive f64 sums, at widths with and without a rest.
    #[test]
    fn sums_are_naive_sums() {
        let mut rng = seeded(11);
        let mut vector = Vector::new();
        for (inputs, outputs) in [(64, 64), (64, 3), (13, 5), (2, 4), (1, 1), (50, 7)] {
            let moments: Vec<f32> = (0..inputs)
                .map(|_| 30.0 * standard_normal(&mut rng).abs())
                .collect();
            let stride = row_stride(inputs);
            let mut rows = std::vec![0_u8; outputs * stride];
            for row in rows.chunks_exact_mut(stride) {
                row[..inputs].fill_with(|| rng.next_u32() as u8);
            }
            vector.pack(&moments);
            let mut sums = std::vec![f32::NAN; outputs];
            vector.dot_variances(&rows, &mut sums);
            for (got, row) in sums.iter().zip(rows.chunks_exact(stride)) {
                let terms = row.iter().zip(&moments).filter(|(code, _)| **code > 0);
                let expected: f64 = terms
                    .map(|(&code, &x)| libm::exp2((f64::from(code) - 255.0) / 8.0) * f64::from(x))
                    .sum();
                // Half a step of 15 bits of activation and of 13 bits of variance for every input.
                let largest = f64::from(moments.iter().fold(0.0_f32, |a, &x| a.max(x)));
                assert!((f64::from(*got) - expected).abs() < 2e-3 * (largest + expected));
            }
        }
    }

    #[test]
    fn what_is_not_finite_does_not_come_out_as_a_number() {
        for bad in [f32::NAN, f32::INFINITY] {
            let mut vector = Vector::new();
            vector.pack(&[0.5, 0.5, bad, 0.5]);
            let mut sums = [0.0; 2];
            vector.dot_variances(&[9; 8], &mut sums);
            assert!(sums.iter().all(|sum| !sum.is_finite()));
        }
    }

    /// Full scale of both: the sum does not wrap.
    #[test]
    fn the_largest_sum_fits() {
        let mut vector = Vector::new();
        vector.pack(&[2.0; 64]);
        let mut sums = [0.0];
        vector.dot_variances(&[255; 64], &mut sums);
        assert!((sums[0] - 128.0).abs() < 0.01, "{sums:?}");
    }
}
