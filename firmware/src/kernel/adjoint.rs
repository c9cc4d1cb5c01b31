//! Row vectors times a layer's weights: how outputs depend on what goes into the layer.

use super::largest::Largest;
use super::packed::{VALUE_MAX, round, steps_per_unit};
use super::{halves, load, multiply_accumulate, sign_extend_even_bytes, sqrt};
use crate::blob::field::WIDTH_MAX;

/// Rows of a layer that count, of the [`WIDTH_MAX`] of the widest. Where GELU is flat a row counts
/// next to nothing.
const ROWS: usize = 40;
/// Pairs that the microcontroller adds up in one go.
pub(super) const UNROLLED: usize = 4;

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
    pairs: [Pair<N>; ROWS / 2],
    used: usize,
    /// What one step is worth, per vector.
    scale: [f32; N],
    /// The latest sums over rows of code times vector, one for every column.
    sums: [[[i32; N]; 4]; WIDTH_MAX / 4],
}

impl<const N: usize> Adjoint<N> {
    const NONE: Pair<N> = Pair {
        rows: [0; 2],
        words: [0; N],
    };

    /// Room for any layer; holds nothing.
    pub const fn new() -> Self {
        Self {
            pairs: [Self::NONE; ROWS / 2],
            used: 0,
            scale: [0.0; N],
            sums: [[[0; N]; 4]; WIDTH_MAX / 4],
        }
    }

    /// Quantises `vectors` (`[row][vector]`, at most [`WIDTH_MAX`] rows of `stride` codes): 16 bits over
    /// the length of each. NaN or infinity gives a scale of NaN or infinity.
    #[inline]
    pub fn pack(&mut self, vectors: &[[f32; N]], stride: usize) {
        let mut lengths = [0.0; N];
        for vector in vectors {
            for (length, x) in lengths.iter_mut().zip(vector) {
                *length += x * x;
            }
        }
        let lengths = lengths.map(sqrt);
        let inverse = lengths.map(steps_per_unit);
        self.scale = lengths.map(|length| length / VALUE_MAX);
        let mut kept = Largest::<ROWS>::new();
        let mut steps = [0; WIDTH_MAX];
        for (step, vector) in steps.iter_mut().zip(vectors) {
            let mut magnitude = 0.0;
            for (x, inverse) in vector.iter().zip(&inverse) {
                magnitude += (x * inverse).abs();
            }
            *step = Largest::<ROWS>::step(magnitude);
            kept.see(*step);
        }
        kept.decide();
        let rows = vectors.iter().zip(&steps).enumerate();
        let mut rows =
            rows.filter(|(_, (_, step))| kept.keeps(**step))
                .map(|(index, (vector, _))| {
                    let mut q = [0; N];
                    for n in 0..N {
                        q[n] = round(vector[n] * inverse[n]);
                    }
                    ((index * stride) as u32, q)
                });
        self.used = 0;
        for pair in &mut self.pairs {
            let Some((row, low)) = rows.next() else {
                break;
            };
            let (other, high) = rows.next().unwrap_or((row, [0; N]));
            pair.rows = [row, other];
            for n in 0..N {
                pair.words[n] = halves(low[n], high[n]);
            }
            self.used += 1;
        }
        // The loop over them is unrolled.
        let whole = self.used.next_multiple_of(UNROLLED);
        if let Some(rest) = self.pairs.get_mut(self.used..whole) {
            rest.fill(Self::NONE);
            self.used = whole;
        }
    }

    /// Calls `each(column, sums)` with the sums over rows of vector times int8 code, for `columns`
    /// columns. `codes` are the rows, of as many codes as [`Adjoint::pack`] was told.
    #[inline]
    pub fn dot_columns(
        &mut self,
        codes: &[u8],
        columns: usize,
        mut each: impl FnMut(usize, [f32; N]),
    ) {
        let groups = columns.div_ceil(4).min(self.sums.len());
        let pairs = self.pairs.get(..self.used).unwrap_or(&self.pairs);
        sum_columns(codes, pairs, &mut self.sums[..groups]);
        let sums = self.sums.as_flattened().iter().take(columns);
        for (column, sums) in sums.enumerate() {
            let mut products = [0.0; N];
            for n in 0..N {
                products[n] = sums[n] as f32 * self.scale[n];
            }
            each(column, products);
        }
    }
}

impl<const N: usize> Default for Adjoint<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// Integer sums of the int8 codes of four columns after four times the halves of the pairs.
#[inline]
fn sum_columns<const N: usize>(codes: &[u8], pairs: &[Pair<N>], sums: &mut [[[i32; N]; 4]]) {
    #[cfg(arm_dsp)]
    if N == 3 && super::arm_columns::sum_columns(codes, pairs, sums) {
        return;
    }
    for (group, sums) in sums.iter_mut().enumerate() {
        *sums = [[0; N]; 4];
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
            adjoint.dot_columns(&rows, inputs, |column, sums| products[column] = sums);
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
        adjoint.dot_columns(&[1; 256], 4, |column, sums| products[column] = sums);
        let expected: f32 = vectors.iter().map(|v| v[1]).filter(|&x| x > 0.5).sum();
        for [none, sum, other] in products {
            assert_eq!(none, 0.0);
            assert!((sum - expected).abs() < 1e-3 * expected, "{sum} {expected}");
            assert!((other + 0.1 * expected).abs() < 1e-3 * expected);
        }
    }

    /// As many as count, whatever the ties.
    #[test]
    fn of_rows_that_are_alike_as_many_count() {
        let mut adjoint = Adjoint::<1>::new();
        for (count, counting) in [(64, 40.0), (41, 40.0), (40, 40.0), (39, 39.0)] {
            adjoint.pack(&std::vec![[2.0]; count], 4);
            let mut products = [[0.0]; 4];
            adjoint.dot_columns(&std::vec![1; 4 * count], 4, |column, sums| {
                products[column] = sums
            });
            let expected = 2.0 * counting;
            assert!(
                (products[3][0] - expected).abs() < 1e-4 * expected,
                "{count}"
            );
        }
    }

    #[test]
    fn what_is_not_finite_does_not_come_out_as_a_number() {
        for bad in [f32::NAN, f32::INFINITY] {
            let mut adjoint = Adjoint::<2>::new();
            adjoint.pack(&[[1.0, 1.0], [1.0, bad]], 4);
            let mut products = [[0.0; 2]; 4];
            adjoint.dot_columns(&[1; 8], 4, |column, sums| products[column] = sums);
            for product in products {
                assert!((product[0] - 2.0).abs() < 1e-4);
                assert!(!product[1].is_finite());
            }
        }
    }
}
