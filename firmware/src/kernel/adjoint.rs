//! Row vectors times a layer's weights: how outputs depend on what goes into the layer.

use super::packed::{VALUE_MAX, largest_magnitudes, round, steps_per_unit};
use super::{halves, load, multiply_accumulate, sign_extend_even_bytes};
use crate::blob::field::WIDTH_MAX;

/// Rows of a layer that count, of the [`WIDTH_MAX`] of the widest. Where GELU is flat a row counts
/// next to nothing.
const ROWS: usize = 40;
/// Pairs of rows.
pub(super) const PAIRS: usize = ROWS / 2;

/// Two rows of a layer, and what of the `N` vectors belongs to them.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct Pair<const N: usize> {
    /// Where they begin among the codes.
    pub rows: [u32; 2],
    /// One half for each row.
    pub words: [u32; N],
}

/// `N` row vectors, quantised, one number for each row of a layer; of more than forty rows those that
/// hold most.
pub struct Adjoint<const N: usize> {
    /// Those without rows stand at zero and hold zeros.
    pairs: [Pair<N>; PAIRS],
    /// What one step is worth, per vector.
    scale: [f32; N],
}

impl<const N: usize> Adjoint<N> {
    const NONE: Pair<N> = Pair {
        rows: [0; 2],
        words: [0; N],
    };

    /// Room for any layer; holds nothing.
    pub const fn new() -> Self {
        Self {
            pairs: [Self::NONE; PAIRS],
            scale: [0.0; N],
        }
    }

    /// Quantises `vectors` (`[row][vector]`, at most [`WIDTH_MAX`] rows of `stride` codes): 16 bits over
    /// the largest magnitude of each. NaN or infinity gives a scale of NaN or infinity.
    #[inline]
    pub fn pack(&mut self, vectors: &[[f32; N]], stride: usize) {
        let largest = largest_magnitudes(vectors);
        let inverse = largest.map(steps_per_unit);
        self.scale = largest.map(|largest| largest / VALUE_MAX);
        self.pairs = [Self::NONE; PAIRS];
        let mut counting = Counting::of(vectors, &inverse);
        let mut place = 0;
        for (index, vector) in vectors.iter().enumerate() {
            if !counting.next(vector, &inverse) {
                continue;
            }
            if let Some(pair) = self.pairs.get_mut(place / 2) {
                let second = place % 2;
                pair.rows[second] = (index * stride) as u32;
                for (n, word) in pair.words.iter_mut().enumerate() {
                    *word |= round(vector[n] * inverse[n]) << (16 * second);
                }
            }
            place += 1;
        }
    }

    /// Writes to `products` (`[column][vector]`) the sums over rows of vector times int8 code. `codes`
    /// are the rows, of as many codes as [`Adjoint::pack`] was told, at least as many as there are products.
    #[inline]
    pub fn dot_columns(&self, codes: &[u8], products: &mut [[f32; N]]) {
        let mut sums = [[0; N]; WIDTH_MAX];
        let (fours, _) = sums.as_chunks_mut();
        let used = products.len().div_ceil(4).min(fours.len());
        let (fours, _) = fours.split_at_mut(used);
        self.sum_columns(codes, fours);
        for (product, sums) in products.iter_mut().zip(&sums) {
            for (n, product) in product.iter_mut().enumerate() {
                *product = sums[n] as f32 * self.scale[n];
            }
        }
    }

    /// Integer sums of the int8 codes of four columns after four times the halves of the pairs.
    #[inline]
    fn sum_columns(&self, codes: &[u8], sums: &mut [[[i32; N]; 4]]) {
        #[cfg(arm_dsp)]
        if N == 3 && super::arm_columns::sum_columns(codes, &self.pairs, sums) {
            return;
        }
        for (group, sums) in sums.iter_mut().enumerate() {
            let at = |row: u32| {
                let codes = codes.get(row as usize + 4 * group..);
                codes.and_then(|codes| codes.first_chunk()).map_or(0, load)
            };
            for Pair { rows, words } in &self.pairs {
                let codes = rows.map(at);
                for odd in 0..2 {
                    let [first, second] =
                        codes.map(|codes| sign_extend_even_bytes(codes >> (8 * odd)));
                    multiply_accumulate(&mut sums[odd], halves(first & 0xFFFF, second), words);
                    let upper = first >> 16 | second & 0xFFFF_0000;
                    multiply_accumulate(&mut sums[2 + odd], upper, words);
                }
            }
        }
    }
}

impl<const N: usize> Default for Adjoint<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// Which rows count: those whose largest magnitude, to half an octave, is above a bound, and the first
/// of those that reach it.
struct Counting {
    bound: u32,
    /// Rows at the bound that still count.
    left: usize,
}

impl Counting {
    /// Half octaves from the first on that 16 bits have.
    const STEPS: usize = 34;

    fn of<const N: usize>(vectors: &[[f32; N]], inverse: &[f32; N]) -> Self {
        let mut counts = [0_usize; Self::STEPS];
        for vector in vectors {
            if let Some(count) = counts.get_mut(step(vector, inverse) as usize) {
                *count += 1;
            }
        }
        let (mut bound, mut left) = (Self::STEPS as u32, ROWS);
        for count in counts.iter().rev() {
            bound -= 1;
            if *count > left {
                break;
            }
            left -= count;
        }
        Self { bound, left }
    }

    /// Whether the next row counts.
    #[inline]
    fn next<const N: usize>(&mut self, vector: &[f32; N], inverse: &[f32; N]) -> bool {
        let step = step(vector, inverse);
        let at_bound = step == self.bound && self.left > 0;
        if at_bound {
            self.left -= 1;
        }
        step > self.bound || at_bound
    }
}

/// Half octaves of a row's largest magnitude above half a step; zero below.
#[inline]
fn step<const N: usize>(vector: &[f32; N], inverse: &[f32; N]) -> u32 {
    const HALF: u32 = 0.5_f32.to_bits();
    let mut largest = HALF;
    for (x, inverse) in vector.iter().zip(inverse) {
        largest = largest.max((x * inverse).to_bits() & 0x7FFF_FFFF);
    }
    (largest - HALF) >> 22
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::field::row_stride;
    use crate::gaussian::standard_normal;
    use crate::rng::seeded;
    use rand_core::Rng;
    use std::vec::Vec;

    /// Naive f64 sums, with inputs and outputs that are no multiple of four or two, and no more rows than
    /// count.
    #[test]
    fn products_are_naive_sums() {
        let mut rng = seeded(10);
        let mut adjoint = Adjoint::<3>::default();
        for (inputs, outputs) in [(64, 40), (64, 3), (13, 5), (2, 4), (1, 1), (50, 7), (6, 39)] {
            let vectors: Vec<[f32; 3]> = (0..outputs)
                .map(|_| [0.01, 1.0, 50.0].map(|size| size * standard_normal(&mut rng)))
                .collect();
            let stride = row_stride(inputs);
            let mut rows = std::vec![0_u8; outputs * stride];
            for row in rows.chunks_exact_mut(stride) {
                row[..inputs].fill_with(|| rng.next_u32() as u8);
            }
            adjoint.pack(&vectors, stride);
            let mut products = std::vec![[f32::NAN; 3]; inputs];
            adjoint.dot_columns(&rows, &mut products);
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
    fn of_many_rows_the_largest_count() {
        let mut adjoint = Adjoint::<3>::new();
        let vectors: Vec<[f32; 3]> = (0..64)
            .map(|row| {
                let size = if row % 8 < 3 { 0.01 } else { 1.0 + row as f32 };
                [0.0, size, -0.1 * size]
            })
            .collect();
        adjoint.pack(&vectors, 4);
        let mut products = [[f32::NAN; 3]; 4];
        adjoint.dot_columns(&[1; 256], &mut products);
        let expected: f32 = vectors.iter().map(|v| v[1]).filter(|&x| x > 0.5).sum();
        for [none, sum, other] in products {
            assert_eq!(none, 0.0);
            assert!((sum - expected).abs() < 1e-3 * expected, "{sum} {expected}");
            assert!((other + 0.1 * expected).abs() < 1e-3 * expected);
        }
    }

    /// As many as count, whatever the ties.
    #[test]
    fn of_rows_that_are_alike_forty_count() {
        let mut adjoint = Adjoint::<1>::new();
        for (count, counting) in [(64, 40.0), (41, 40.0), (40, 40.0), (39, 39.0)] {
            adjoint.pack(&std::vec![[2.0]; count], 4);
            let mut products = [[0.0]; 4];
            adjoint.dot_columns(&std::vec![1; 4 * count], &mut products);
            assert!((products[3][0] - 2.0 * counting).abs() < 1e-3, "{count}");
        }
    }

    #[test]
    fn what_is_not_finite_does_not_come_out_as_a_number() {
        for bad in [f32::NAN, f32::INFINITY] {
            let mut adjoint = Adjoint::<2>::new();
            adjoint.pack(&[[1.0, 1.0], [1.0, bad]], 4);
            let mut products = [[0.0; 2]; 4];
            adjoint.dot_columns(&[1; 8], &mut products);
            for product in products {
                assert_eq!(product[0], 2.0);
                assert!(!product[1].is_finite());
            }
        }
    }
}
