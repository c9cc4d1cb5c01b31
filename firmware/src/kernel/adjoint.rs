//! Row vectors times a layer's weights: how outputs depend on what goes into the layer.

use super::packed::{VALUE_MAX, round, steps_per_unit};
use super::{halves, load, multiply_accumulate, sign_extend_even_bytes, sqrt};
use crate::blob::field::WIDTH_MAX;

/// Row vectors that go through a layer together: one for each axis.
pub const VECTORS: usize = 3;
/// Pairs that the microcontroller adds up in one go: with more, what is padded costs more than loops save.
pub(super) const UNROLLED: usize = 2;
/// The pairs of the widest layer.
const PAIRS: usize = (WIDTH_MAX / 2).next_multiple_of(UNROLLED);
/// A row counts if it holds this share of the vectors' lengths, all together; next to nothing goes through
/// the others, where GELU is flat or the unit was given up.
const SHARE: f32 = 0.02;

/// Two rows of a layer, and what of the vectors belongs to them.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Pair {
    /// Where they begin among the codes.
    pub rows: [u32; 2],
    /// One half for each row.
    pub words: [u32; VECTORS],
}

impl Pair {
    const NONE: Self = Self {
        rows: [0; 2],
        words: [0; VECTORS],
    };
}

/// Row vectors, quantised, one number for each row of a layer that counts.
#[derive(Debug)]
pub struct Adjoint {
    pairs: [Pair; PAIRS],
    used: usize,
    /// What one step is worth, per vector.
    scale: [f32; VECTORS],
    /// The latest sums over rows of code times vector, one for every column.
    sums: [[[i32; VECTORS]; 4]; WIDTH_MAX / 4],
}

impl Adjoint {
    /// Room for any layer; holds nothing.
    pub const fn new() -> Self {
        Self {
            pairs: [Pair::NONE; PAIRS],
            used: 0,
            scale: [0.0; VECTORS],
            sums: [[[0; VECTORS]; 4]; WIDTH_MAX / 4],
        }
    }

    /// Quantises `vectors` (`[row][vector]`, at most [`WIDTH_MAX`] rows of `stride` codes), whose sums of squares
    /// are `squares`: 16 bits over the length of each. NaN or infinity gives a scale of NaN or infinity.
    #[inline]
    pub fn pack(&mut self, vectors: &[[f32; VECTORS]], squares: &[f32; VECTORS], stride: usize) {
        // Multiplied before the root, or the compiler would carry the caller's sums as integers, the root's operands.
        self.scale = squares.map(|square| sqrt(square * (1.0 / (VALUE_MAX * VALUE_MAX))));
        let inverse = self.scale.map(|scale| steps_per_unit(scale * VALUE_MAX));
        let mut rows = (0_u32..)
            .step_by(stride.max(1))
            .zip(vectors)
            .filter_map(|(row, vector)| {
                let [a, b, c] = core::array::from_fn(|n| vector[n] * inverse[n]);
                let little = a.abs() + b.abs() + c.abs() < SHARE * VALUE_MAX;
                (!little).then(|| (row, [a, b, c].map(round)))
            });
        self.used = 0;
        for pair in &mut self.pairs {
            let Some((row, low)) = rows.next() else {
                break;
            };
            let (other, high) = rows.next().unwrap_or((row, [0; VECTORS]));
            pair.rows = [row, other];
            for n in 0..VECTORS {
                pair.words[n] = halves(low[n], high[n]);
            }
            self.used += 1;
        }
        // The loop over them is unrolled.
        let whole = self.used.next_multiple_of(UNROLLED);
        if let Some(rest) = self.pairs.get_mut(self.used..whole) {
            rest.fill(Pair::NONE);
            self.used = whole;
        }
    }

    /// For each of `columns` the sums over rows of vector times int8 code. `codes` are the rows, of as many
    /// codes as [`Adjoint::pack`] was told.
    #[inline]
    pub fn dot_columns(
        &mut self,
        codes: &[u8],
        columns: usize,
    ) -> impl Iterator<Item = [f32; VECTORS]> + use<'_> {
        let groups = columns.div_ceil(4).min(self.sums.len());
        let pairs = self.pairs.get(..self.used).unwrap_or(&self.pairs);
        sum_columns(codes, pairs, &mut self.sums[..groups]);
        let sums = self.sums.as_flattened();
        let sums = sums.get(..columns).unwrap_or(sums);
        let scale = self.scale;
        sums.iter()
            .map(move |sums| core::array::from_fn(|n| sums[n] as f32 * scale[n]))
    }
}

impl Default for Adjoint {
    fn default() -> Self {
        Self::new()
    }
}

/// Integer sums of the int8 codes of four columns after four times the halves of the pairs.
#[inline]
fn sum_columns(codes: &[u8], pairs: &[Pair], sums: &mut [[[i32; VECTORS]; 4]]) {
    #[cfg(arm_dsp)]
    if super::arm_columns::sum_columns(codes, pairs, sums) {
        return;
    }
    for (group, sums) in sums.iter_mut().enumerate() {
        *sums = [[0; VECTORS]; 4];
        let at = |row: u32| {
            let codes = codes.get(row as usize + 4 * group..);
            codes.and_then(|codes| codes.first_chunk()).map_or(0, load)
        };
        for Pair { rows, words } in pairs {
            let codes = rows.map(at);
            for odd in 0..2 {
                let [first, second] = codes.map(|codes| sign_extend_even_bytes(codes >> (8 * odd)));
                multiply_accumulate(&mut sums[odd], halves(first & 0xFFFF, second), words);
                let upper = first >> 16 | second & 0xFFFF_0000;
                multiply_accumulate(&mut sums[2 + odd], upper, words);
            }
        }
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

    fn pack(adjoint: &mut Adjoint, vectors: &[[f32; VECTORS]], stride: usize) {
        let squares = |n: usize| vectors.iter().map(|vector| vector[n] * vector[n]).sum();
        adjoint.pack(vectors, &core::array::from_fn(squares), stride);
    }

    /// Naive f64 sums, with inputs and outputs that are no multiple of four or two; what does not count is
    /// little beside the rest.
    #[test]
    fn products_are_naive_sums() {
        let mut rng = seeded(10);
        let mut adjoint = Adjoint::default();
        for (inputs, outputs) in [(64, 64), (64, 3), (13, 5), (2, 4), (1, 1), (50, 7), (6, 39)] {
            let vectors: Vec<[f32; 3]> = (0..outputs)
                .map(|_| [0.01, 1.0, 50.0].map(|size| size * standard_normal(&mut rng)))
                .collect();
            let stride = row_stride(inputs);
            let mut rows = std::vec![0_u8; outputs * stride];
            for row in rows.chunks_exact_mut(stride) {
                row[..inputs].fill_with(|| rng.next_u32() as u8);
            }
            pack(&mut adjoint, &vectors, stride);
            let products: Vec<_> = adjoint.dot_columns(&rows, inputs).collect();
            assert_eq!(products.len(), inputs);
            for (input, got) in products.iter().enumerate() {
                for n in 0..3 {
                    let (mut sum, mut size) = (0.0, 0.0);
                    for (row, vector) in rows.chunks_exact(stride).zip(&vectors) {
                        let term = f64::from(row[input] as i8) * f64::from(vector[n]);
                        sum += term;
                        size += term.abs();
                    }
                    let error = (f64::from(got[n]) - sum).abs();
                    assert!(
                        error < 3e-4 * size + 1e-9,
                        "{inputs} {outputs}: {error} {size}"
                    );
                }
            }
        }
    }

    /// Of 64 rows 24 are smaller by far, and only they are left out.
    #[test]
    fn rows_that_hold_next_to_nothing_are_left_out() {
        let mut adjoint = Adjoint::new();
        let vectors: Vec<[f32; 3]> = (0..64)
            .map(|row| {
                let size = if row % 8 < 3 { 0.1 } else { 10.0 + row as f32 };
                [0.0, size, -0.1 * size]
            })
            .collect();
        pack(&mut adjoint, &vectors, 4);
        let products: Vec<_> = adjoint.dot_columns(&[1; 256], 4).collect();
        let expected: f32 = vectors.iter().map(|v| v[1]).filter(|&x| x > 0.5).sum();
        assert_eq!(products.len(), 4);
        for [none, sum, other] in products {
            assert_eq!(none, 0.0);
            assert!((sum - expected).abs() < 1e-3 * expected, "{sum} {expected}");
            assert!((other + 0.1 * expected).abs() < 1e-3 * expected);
        }
    }

    /// Neither whole pairs nor whole fours of pairs, and all that fit.
    #[test]
    fn every_row_counts_that_holds_its_share() {
        let mut adjoint = Adjoint::new();
        for count in [64, 63, 41, 9, 1] {
            pack(&mut adjoint, &std::vec![[2.0, 0.0, 0.0]; count], 4);
            let codes = std::vec![1; 4 * count];
            let products: Vec<_> = adjoint.dot_columns(&codes, 4).collect();
            let expected = 2.0 * count as f32;
            let apart = (products[3][0] - expected).abs();
            assert!(apart < 1e-3 * expected, "{count}");
        }
    }

    #[test]
    fn what_is_not_finite_does_not_come_out_as_a_number() {
        for bad in [f32::NAN, f32::INFINITY] {
            let mut adjoint = Adjoint::new();
            pack(&mut adjoint, &[[1.0, 1.0, 0.0], [1.0, bad, 0.0]], 4);
            for product in adjoint.dot_columns(&[1; 8], 4) {
                assert!((product[0] - 2.0).abs() < 1e-4);
                assert!(!product[1].is_finite());
            }
        }
    }
}
