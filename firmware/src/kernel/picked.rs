//! Rows of a layer that are summed, of all that it has.

use crate::blob::field::WIDTH_MAX;

const _: () = assert!(WIDTH_MAX <= u8::MAX as usize);

/// Their indices.
#[derive(Debug)]
pub(super) struct Picked {
    rows: [u8; WIDTH_MAX],
    count: u8,
    /// One more than the largest of them.
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

    /// Forgets all.
    pub fn clear(&mut self) {
        (self.count, self.end) = (0, 0);
    }

    /// How many there are.
    pub fn count(&self) -> u8 {
        self.count
    }

    /// One row more.
    #[inline]
    pub fn push(&mut self, row: usize) {
        if let Some(slot) = self.rows.get_mut(usize::from(self.count)) {
            *slot = row as u8;
            self.count += 1;
            self.end = self.end.max(row + 1);
        }
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
