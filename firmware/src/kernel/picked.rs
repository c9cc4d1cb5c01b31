//! Rows of a layer that are summed, of all that it has.

use crate::blob::field::WIDTH_MAX;

const _: () = assert!(WIDTH_MAX <= u64::BITS as usize);

/// One bit for each row of a layer, the lowest for the first.
pub type RowBits = u64;

/// Bits of the rows that `are` says, at most as many as a layer has.
#[inline]
pub fn row_bits(are: impl Iterator<Item = bool>) -> RowBits {
    let (mut bits, mut free) = (0, RowBits::BITS);
    for is in are.take(WIDTH_MAX) {
        bits = bits >> 1 | RowBits::from(is) << (RowBits::BITS - 1);
        free -= 1;
    }
    bits.checked_shr(free).unwrap_or(0)
}

/// Bits of so many rows from the first on.
#[inline]
pub(super) fn leading(count: usize) -> RowBits {
    let beyond = RowBits::MAX.checked_shl(count as u32).unwrap_or(0);
    !beyond
}

/// The rows' indices.
#[derive(Debug)]
pub(super) struct Picked {
    rows: [u8; WIDTH_MAX],
    count: u8,
    /// One more than the last of them.
    end: usize,
}

impl Picked {
    /// None.
    pub const fn new() -> Self {
        Self {
            rows: [0; WIDTH_MAX],
            count: 0,
            end: 0,
        }
    }

    /// These rows and no others.
    // Once in flash.
    #[inline(never)]
    pub fn pick(&mut self, rows: RowBits) {
        let (mut slots, mut last) = (self.rows.iter_mut(), None);
        // By words of the microcontroller.
        for (bits, from) in [(rows as u32, 0), ((rows >> 32) as u32, 32)] {
            let mut bits = bits;
            while bits != 0 {
                let row = from + bits.trailing_zeros();
                if let Some(slot) = slots.next() {
                    *slot = row as u8;
                }
                last = Some(row as usize);
                bits &= bits - 1;
            }
        }
        self.count = rows.count_ones() as u8;
        self.end = last.map_or(0, |last| last + 1);
    }

    /// Their indices.
    #[inline]
    pub fn rows(&self) -> &[u8] {
        self.rows.get(..usize::from(self.count)).unwrap_or_default()
    }

    /// How many rows a layer has that has all of them.
    #[inline]
    pub fn end(&self) -> usize {
        self.end
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_picked_by_their_bits() {
        let mut picked = Picked::new();
        for wanted in [
            &[][..],
            &[0],
            &[63],
            &[5, 31, 32, 40],
            &core::array::from_fn::<_, 64, _>(|row| row as u8),
        ] {
            let are = (0..64).map(|row| wanted.contains(&row));
            let bits = row_bits(are);
            assert_eq!(bits, wanted.iter().map(|row| 1 << row).sum());
            picked.pick(bits);
            assert_eq!(picked.rows(), wanted);
            let end = wanted.last().map_or(0, |&last| usize::from(last) + 1);
            assert_eq!(picked.end(), end);
        }
    }

    #[test]
    fn bits_are_of_as_many_rows_as_there_are() {
        for count in [0, 1, 3, 33, 63, 64] {
            let all = row_bits((0..count).map(|_| true));
            assert_eq!(all.count_ones() as usize, count);
            assert_eq!(all, leading(count));
        }
        assert_eq!(row_bits((0..100).map(|row| row > 62)), 1 << 63);
    }
}
