//! Variances of one layer's activations as the squared means read them.

use super::halves;
use super::largest::Largest;
use super::packed::{VALUE_MAX, largest_magnitude, round, steps_per_unit};
use super::second::STEP;
#[cfg(not(arm_dsp))]
use super::second::{DROPPED, multiply_accumulate_long};
#[cfg(not(arm_dsp))]
use super::{load, sign_extend_even_bytes};
use crate::blob::field::WIDTH_MAX;

/// Groups of four variances that count, of the sixteen of the widest layer.
pub(super) const GROUPS: usize = 8;

/// Where four variances stand, and their quantised values in the order of the codes.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct Group {
    pub at: u32,
    pub words: [u32; 2],
}

impl Group {
    const NONE: Self = Self {
        at: 0,
        words: [0; 2],
    };
}

/// The variances of one layer's activations, quantised, without the groups that hold least: variances
/// are much alike in what they do, and the mean needs no more.
pub struct Spread {
    /// Those without variances stand at zero and hold zeros.
    groups: [Group; GROUPS],
    /// What one step of `words` is worth.
    scale: f32,
    sums: [i32; WIDTH_MAX],
}

impl Spread {
    /// Room for any layer; holds no variances.
    pub const fn new() -> Self {
        Self {
            groups: [Group::NONE; GROUPS],
            scale: 0.0,
            sums: [0; WIDTH_MAX],
        }
    }

    /// Quantises `variances`, at most [`WIDTH_MAX`], none of them negative: 15 bits over the largest.
    /// NaN or infinity gives a scale of NaN or infinity.
    pub fn pack(&mut self, variances: &[f32]) {
        let largest = largest_magnitude(variances);
        let inverse = steps_per_unit(largest);
        self.scale = largest / VALUE_MAX;
        let mut kept = Largest::<GROUPS>::new();
        let mut steps = [0; WIDTH_MAX / 4];
        for (step, group) in steps.iter_mut().zip(variances.chunks(4)) {
            *step = Largest::<GROUPS>::step(group.iter().sum::<f32>() * inverse);
            kept.see(*step);
        }
        kept.decide();
        let groups = variances.chunks(4).enumerate().zip(&steps);
        let mut groups = groups.filter(|(_, step)| kept.keeps(**step));
        for slot in &mut self.groups {
            *slot = groups.next().map_or(Group::NONE, |((index, group), _)| {
                let q = |i: usize| group.get(i).map_or(0, |x| round(x * inverse));
                Group {
                    at: 4 * index as u32,
                    words: [halves(q(0), q(2)), halves(q(1), q(3))],
                }
            });
        }
    }

    /// Writes to `sums` for each of `rows` the sum over inputs of squared int8 code times variance.
    /// Rows have `stride` codes, a multiple of four.
    pub fn dot_squares(&mut self, rows: &[u8], stride: usize, sums: &mut [f32]) {
        let integers = &mut self.sums[..sums.len().min(WIDTH_MAX)];
        #[cfg(arm_dsp)]
        super::arm_second::dot_squares(rows, stride, &self.groups, integers);
        #[cfg(not(arm_dsp))]
        dot_squares(rows, stride, &self.groups, integers);
        let scale = self.scale * STEP;
        for (sum, &integer) in sums.iter_mut().zip(&*integers) {
            *sum = integer as f32 * scale;
        }
    }
}

impl Default for Spread {
    fn default() -> Self {
        Self::new()
    }
}

/// For each row of `stride` codes the sum of the squared codes of the groups times their halves, less
/// the lowest eight bits.
#[cfg(not(arm_dsp))]
fn dot_squares(rows: &[u8], stride: usize, groups: &[Group; GROUPS], sums: &mut [i32]) {
    for (row, sum) in rows.chunks(stride.max(1)).zip(sums) {
        let mut total = 0;
        for Group { at, words } in groups {
            let codes = row.get(*at as usize..).and_then(|row| row.first_chunk());
            let codes = codes.map_or(0, load);
            for (codes, word) in [codes, codes >> 8].into_iter().zip(words) {
                let squared = squares(sign_extend_even_bytes(codes));
                total = multiply_accumulate_long(total, squared, *word);
            }
        }
        *sum = (total >> DROPPED) as i32;
    }
}

/// Both halves squared.
#[cfg(not(arm_dsp))]
fn squares(codes: u32) -> u32 {
    let (low, high) = (i32::from(codes as u16 as i16), codes as i32 >> 16);
    halves((low * low) as u32, (high * high) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::field::row_stride;
    use crate::gaussian::standard_normal;
    use crate::rng::seeded;
    use rand_core::Rng;
    use std::vec::Vec;

    /// Naive f64 sums over the groups that hold most, at widths with and without a rest.
    #[test]
    fn sums_are_naive_sums_over_the_largest_groups() {
        let mut rng = seeded(9);
        let mut spread = Spread::default();
        for (inputs, outputs) in [(64, 64), (64, 3), (13, 5), (2, 4), (1, 1), (50, 7), (33, 2)] {
            let variances: Vec<f32> = (0..inputs)
                .map(|_| 30.0 * standard_normal(&mut rng).abs())
                .collect();
            let stride = row_stride(inputs);
            let mut rows = std::vec![0_u8; outputs * stride];
            for row in rows.chunks_exact_mut(stride) {
                row[..inputs].fill_with(|| rng.next_u32() as u8);
            }
            // The first groups hold most by far.
            let variances: Vec<f32> = variances
                .iter()
                .enumerate()
                .map(|(i, x)| if i < 32 { x + 10.0 } else { x * 1e-2 })
                .collect();
            spread.pack(&variances);
            let mut sums = std::vec![f32::NAN; outputs];
            spread.dot_squares(&rows, stride, &mut sums);
            let largest = f64::from(variances.iter().fold(0.0_f32, |a, &x| a.max(x)));
            for (got, row) in sums.iter().zip(rows.chunks_exact(stride)) {
                let mut expected = 0.0;
                for (codes, group) in row.chunks(4).zip(variances.chunks(4)) {
                    if group[0] > 3.0 {
                        for (&code, &x) in codes.iter().zip(group) {
                            let code = f64::from(code as i8);
                            expected += code * code * f64::from(x);
                        }
                    }
                }
                let error = (f64::from(*got) - expected).abs();
                assert!(
                    error < 1e-3 * (30.0 * largest + expected),
                    "{inputs} {outputs}"
                );
            }
        }
    }

    #[test]
    fn what_is_not_finite_does_not_come_out_as_a_number() {
        for bad in [f32::NAN, f32::INFINITY] {
            let mut spread = Spread::new();
            spread.pack(&[0.5, 0.5, bad, 0.5]);
            let mut sums = [0.0; 2];
            spread.dot_squares(&[9; 8], 4, &mut sums);
            assert!(sums.iter().all(|sum| !sum.is_finite()));
        }
    }

    /// Full scale of both: the sum does not wrap.
    #[test]
    fn the_largest_sum_fits() {
        let mut spread = Spread::new();
        spread.pack(&[2.0; 64]);
        let mut sums = [0.0];
        spread.dot_squares(&[0x80; 64], 64, &mut sums);
        assert!((sums[0] - 64.0 * 16_384.0).abs() < 100.0, "{sums:?}");
    }
}
