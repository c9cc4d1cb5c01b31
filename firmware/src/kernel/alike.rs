//! Rows of a layer's variance codes that say nearly the same.

use super::picked::{self, RowBits};
use crate::blob::field::WIDTH_MAX;

/// Rows that one of them stands for. Units that training gave up have kept the prior's variance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Alike {
    /// Those that another stands for.
    pub others: RowBits,
    /// That one.
    pub first: u8,
}

impl Alike {
    /// Every row for itself.
    pub const NONE: Self = Self {
        others: 0,
        first: 0,
    };

    /// Of the rows that are like none before them the one that most others are like, and those; rows are `stride`
    /// codes long.
    pub fn of(rows: &[u8], stride: usize) -> Self {
        let mut best = Self::NONE;
        let (mut most, mut met) = (0, 0);
        // A row is never empty, which the compiler does not know.
        let all = || rows.chunks_exact(stride.max(1)).take(WIDTH_MAX);
        for (first, row) in all().enumerate() {
            if met >> first & 1 == 1 {
                continue;
            }
            let mut found = Self {
                first: first as u8,
                ..Self::NONE
            };
            for (index, other) in all().enumerate() {
                if index != first && are_alike(row, other) {
                    found.others |= 1 << index;
                }
            }
            met |= found.others;
            let many = found.others.count_ones();
            if many > most {
                (best, most) = (found, many);
            }
        }
        best
    }

    /// Place of the row that stands for others among those that nothing stands for.
    #[inline]
    pub fn own(&self) -> usize {
        let before = self.others & picked::leading(usize::from(self.first));
        usize::from(self.first) - before.count_ones() as usize
    }
}

/// Whether two rows of variance codes differ by less than a code on average, nine per cent of a variance, even
/// if up to three are padding.
fn are_alike(row: &[u8], other: &[u8]) -> bool {
    let most = row.len() as u32;
    let mut apart = 0;
    for (&a, &b) in row.iter().zip(other) {
        apart += u32::from(a.abs_diff(b));
        // Most that differ do so at once.
        if apart >= most {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Rows as wide as any, and ones that are padded. Two are like each other, and two others like a third; a
    /// fourth differs from it by a code.
    #[test]
    fn the_row_that_most_are_like_stands_for_them() {
        for (inputs, stride) in [(64, 64), (61, 64), (8, 8)] {
            let mut rows: Vec<u8> = (0..64 * stride)
                .map(|i| {
                    if i % stride < inputs {
                        (i / stride * 4) as u8
                    } else {
                        0
                    }
                })
                .collect();
            let one: Vec<u8> = (0..inputs).map(|i| 20 + 3 * i as u8).collect();
            let turned: Vec<u8> = one.iter().rev().copied().collect();
            let raised = |by: u8, many: usize| {
                let mut row = one.clone();
                row[..many].iter_mut().for_each(|code| *code += by);
                row
            };
            for (row, codes) in [
                (3, &turned),
                (7, &turned),
                (33, &one),
                (40, &raised(1, inputs.min(stride - 1))),
                (50, &raised(2, stride / 2)),
                (63, &one),
            ] {
                rows[row * stride..][..inputs].copy_from_slice(codes);
            }
            let found = Alike::of(&rows, stride);
            let expected = Alike {
                others: 1 << 40 | 1 << 63,
                first: 33,
            };
            assert_eq!(found, expected, "{inputs}");
        }
    }

    #[test]
    fn rows_apart_and_no_rows_stand_for_themselves() {
        let apart: Vec<u8> = (0..64).flat_map(|row| [4 * row as u8; 8]).collect();
        assert_eq!(Alike::of(&apart, 8), Alike::NONE);
        assert_eq!(Alike::of(&[], 0), Alike::NONE);
    }
}
