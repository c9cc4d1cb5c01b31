//! Rows of weight variances that say nearly the same, found once for a model: moments sum one of them.

use super::Network;
use crate::blob::field::{LAYERS_MAX, row_stride};
use crate::kernel::{Alike, RowBits};

/// In every layer of a network but the last, whose rows are few, the rows of variance codes that one of them stands
/// for.
#[derive(Clone, Copy, Debug)]
pub struct Repeats {
    // Two lists take less room than one of pairs.
    others: [RowBits; LAYERS_MAX - 1],
    first: [u8; LAYERS_MAX - 1],
}

impl Repeats {
    /// Every row for itself.
    pub const NONE: Self = Self {
        others: [Alike::NONE.others; LAYERS_MAX - 1],
        first: [Alike::NONE.first; LAYERS_MAX - 1],
    };

    /// Compares the rows of every layer with each other.
    pub fn of(network: &Network<'_>) -> Self {
        let mut repeats = Self::NONE;
        let rooms = repeats.others.iter_mut().zip(&mut repeats.first);
        let last = network.view.layers().saturating_sub(1);
        for (index, (others, first)) in rooms.enumerate().take(last) {
            let layer = network.view.layer(index);
            let alike = Alike::of(layer.variance_codes, row_stride(layer.inputs));
            (*others, *first) = (alike.others, alike.first);
        }
        repeats
    }

    /// Those of layer `index`.
    #[inline]
    pub(super) fn layer(&self, index: usize) -> Alike {
        match (self.others.get(index), self.first.get(index)) {
            (Some(&others), Some(&first)) => Alike { others, first },
            _ => Alike::NONE,
        }
    }
}
