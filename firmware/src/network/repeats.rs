//! Rows of weight variances that say nearly the same, found once for a model: moments sum one of them.

use super::Network;
use crate::blob::field::{LAYERS_MAX, row_stride};
use crate::kernel::{Alike, RowBits};

/// In every layer of a network the rows of variance codes that one of them stands for.
#[derive(Clone, Copy, Debug)]
pub struct Repeats {
    // Two lists take less room than one of pairs.
    others: [RowBits; LAYERS_MAX],
    first: [u8; LAYERS_MAX],
}

impl Repeats {
    /// Every row for itself.
    pub const NONE: Self = Self {
        others: [Alike::NONE.others; LAYERS_MAX],
        first: [Alike::NONE.first; LAYERS_MAX],
    };

    /// Compares the rows of every layer with each other.
    pub fn of(network: &Network<'_>) -> Self {
        let mut repeats = Self::NONE;
        let rooms = repeats.others.iter_mut().zip(&mut repeats.first);
        for (index, (others, first)) in rooms.enumerate().take(network.view.layers()) {
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
