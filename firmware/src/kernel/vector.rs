//! One input vector as the integer kernels read it, for a pass with every weight at its mean.

use super::packed::{VALUE_MAX, WORDS, largest_magnitude, round, steps_per_unit};
#[cfg(arm_vfp)]
use super::vfp;
use super::{dot_rows, halves};
use crate::blob::field::WIDTH_MAX;

/// The quantised activations of one layer: the values of one lane of [`Packed`](super::Packed),
/// without the squares.
pub struct Vector {
    words: [u32; WORDS],
    /// Words in use: two for every group of four inputs.
    used: usize,
    /// What one step of `words` is worth.
    scale: f32,
    /// The latest sums over inputs of code times word, one for every row.
    sums: [i32; WIDTH_MAX],
}

impl Vector {
    /// Room for any layer; holds no inputs.
    pub const fn new() -> Self {
        Self {
            words: [0; WORDS],
            used: 0,
            scale: 0.0,
            sums: [0; WIDTH_MAX],
        }
    }

    /// Quantises `activations`, at most [`WIDTH_MAX`] of them: 16 bits over the largest magnitude. NaN
    /// or infinity gives a scale of NaN or infinity, so that no sum comes out as a number.
    #[inline]
    pub fn pack(&mut self, activations: &[f32]) {
        let largest = largest_magnitude(activations);
        let inverse = steps_per_unit(largest);
        self.scale = largest / VALUE_MAX;
        let q = |x: f32| round(x * inverse);
        let (groups, rest) = activations.as_chunks::<4>();
        let (pairs, _) = self.words.as_chunks_mut::<2>();
        let whole = groups.len().min(pairs.len());
        let (pairs, left) = pairs.split_at_mut(whole);
        self.used = 2 * whole;
        #[cfg(arm_vfp)]
        vfp::quantise_vector(groups, inverse, pairs);
        #[cfg(not(arm_vfp))]
        for (&[a, b, c, d], pair) in groups.iter().zip(pairs) {
            *pair = [halves(q(a), q(c)), halves(q(b), q(d))];
        }
        if let ([first, more @ ..], [pair, ..]) = (rest, left) {
            let more = |i: usize| more.get(i).map_or(0, |&x| q(x));
            *pair = [halves(q(*first), more(1)), more(0)];
            self.used += 2;
        }
    }

    /// Writes to `means` for each of `rows` the sum over inputs of code times activation, times its
    /// scale, plus its bias.
    ///
    /// Rows are int8 codes padded with zeros to a multiple of four, at most [`WIDTH_MAX`] of them;
    /// `scales` and `biases` are little-endian f32, one for every row.
    #[inline]
    pub fn dot_rows(
        &mut self,
        rows: &[u8],
        scales: &[[u8; 4]],
        biases: &[[u8; 4]],
        means: &mut [f32],
    ) {
        let count = scales.len().min(biases.len()).min(means.len());
        let sums = &mut self.sums[..count.min(WIDTH_MAX)];
        let words = self.words.get(..self.used).unwrap_or(&self.words);
        dot_rows(rows, words, sums);
        #[cfg(arm_vfp)]
        let (sums, scales, biases, means) = {
            let (sums, sums_left) = sums.as_chunks();
            let whole = 4 * sums.len();
            let (scales, scales_left) = scales.split_at(whole);
            let (biases, biases_left) = biases.split_at(whole);
            let (means, means_left) = means.split_at_mut(whole);
            let (scales, biases) = (scales.as_chunks().0, biases.as_chunks().0);
            vfp::scale_rows(sums, self.scale, scales, biases, means.as_chunks_mut().0);
            (sums_left, scales_left, biases_left, means_left)
        };
        let channels = scales.iter().zip(biases).zip(means);
        for (&sum, ((&scale, &bias), mean)) in sums.iter().zip(channels) {
            let [scale, bias] = [scale, bias].map(f32::from_le_bytes);
            *mean = sum as f32 * self.scale * scale + bias;
        }
    }
}

impl Default for Vector {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::field::row_stride;
    use crate::gaussian::standard_normal;
    use crate::kernel::Packed;
    use crate::rng::seeded;
    use rand_core::Rng;
    use std::vec::Vec;

    /// What the rows give with a scale of 1 and no bias.
    fn dots(vector: &mut Vector, rows: &[u8], count: usize) -> Vec<f32> {
        let mut means = std::vec![f32::NAN; count];
        let scales = std::vec![1.0_f32.to_le_bytes(); count];
        vector.dot_rows(rows, &scales, &std::vec![[0; 4]; count], &mut means);
        means
    }

    /// Naive f64 sums over the unquantised activations, at widths with and without a rest and with
    /// rows that are no multiple of four; and bit for bit what a lane of the passes gives.
    #[test]
    fn means_are_naive_sums_and_those_of_a_lane() {
        let mut rng = seeded(7);
        let mut vector = Vector::default();
        for (inputs, outputs) in [(64, 64), (64, 26), (13, 5), (2, 4), (1, 1), (3, 9), (50, 3)] {
            let mut normals = |count: usize| -> Vec<f32> {
                (0..count)
                    .map(|_| 30.0 * standard_normal(&mut rng))
                    .collect()
            };
            let (activations, scales, biases) =
                (normals(inputs), normals(outputs), normals(outputs));
            let stride = row_stride(inputs);
            let mut rows = std::vec![0_u8; outputs * stride];
            for row in rows.chunks_exact_mut(stride) {
                row[..inputs].fill_with(|| rng.next_u32() as u8);
            }
            let bytes = |x: &[f32]| x.iter().map(|x| x.to_le_bytes()).collect::<Vec<_>>();
            let mut means = std::vec![f32::NAN; outputs + 1];
            vector.pack(&activations);
            vector.dot_rows(&rows, &bytes(&scales), &bytes(&biases), &mut means);
            assert!(means[outputs].is_nan());

            let mut packed = Packed::<4>::new();
            let lanes: Vec<[f32; 4]> = activations.iter().map(|&x| [0.5, x, -x, 1.0]).collect();
            packed.pack(&lanes);
            for (output, row) in rows.chunks_exact(stride).enumerate() {
                let (scale, bias) = (scales[output], biases[output]);
                assert_eq!(means[output], packed.dots(row, row).0[1] * scale + bias);
                let (mut dot, mut size) = (f64::from(bias), f64::from(bias.abs()));
                for (&code, &x) in row.iter().zip(&activations) {
                    let term = f64::from(code as i8) * f64::from(x) * f64::from(scale);
                    dot += term;
                    size += term.abs();
                }
                // Half a step of 1/32767 of the largest for every input.
                assert!((f64::from(means[output]) - dot).abs() < 3e-4 * (30.0 + size));
            }
        }
    }

    /// Codes of one input at a time read back what was quantised.
    #[test]
    fn values_are_16_bits_of_the_largest() {
        let activations = [0.25_f32, -1.0, 0.5, 0.75, -0.125, 0.3, 1e-9];
        let mut vector = Vector::new();
        vector.pack(&activations);
        for (input, x) in activations.into_iter().enumerate() {
            let mut row = [0; 8];
            row[input] = 1;
            let expected = libm::rintf(x * 32_767.0) * (1.0 / 32_767.0);
            assert_eq!(dots(&mut vector, &row, 1), [expected]);
        }
    }

    #[test]
    fn what_is_not_finite_does_not_come_out_as_a_number() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for at in [1, 5] {
                let mut activations = [0.5; 6];
                activations[at] = bad;
                let mut vector = Vector::new();
                vector.pack(&activations);
                let means = dots(&mut vector, &[1; 5 * 8], 5);
                assert!(means.iter().all(|mean| !mean.is_finite()));
            }
        }
    }

    #[test]
    fn a_shorter_layer_after_a_longer_one_leaves_its_rest_unread() {
        let mut vector = Vector::new();
        vector.pack(&[9.0; 8]);
        vector.pack(&[1.0; 3]);
        assert_eq!(dots(&mut vector, &[1; 20], 5), [3.0; 5]);
    }

    #[test]
    fn no_inputs_are_no_sums() {
        assert_eq!(dots(&mut Vector::new(), &[], 5), [0.0; 5]);
    }

    #[test]
    fn memory_is_what_the_widest_layer_needs() {
        let words_and_sums = 2 * WIDTH_MAX + 4 * WIDTH_MAX;
        assert_eq!(size_of::<Vector>(), words_and_sums + 2 * size_of::<usize>());
    }
}
