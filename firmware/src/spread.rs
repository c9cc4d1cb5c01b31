//! Whose standard deviations a Monte Carlo pass draws with.

/// Whose standard deviations the pre-activations of a pass are drawn with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Spread {
    /// The pass's own, as drawing every weight has it.
    Exact,
    /// Those of the first passes: an eighth of all, at least [`LANES`](crate::network::LANES), have
    /// their own, and the others the root of those passes' mean variance, which halves their cost. What
    /// this neglects, that a pass with larger activations spreads more, is small beside the error of a
    /// hundred passes (`docs/kernels.md`).
    Frozen,
}

impl Spread {
    /// How many of `blocks` of passes that run together have their own.
    pub(crate) const fn exact_blocks(self, blocks: u16) -> u16 {
        match self {
            Self::Frozen if blocks >= 16 => blocks / 8,
            Self::Frozen if blocks > 0 => 1,
            _ => blocks,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_eighth_of_frozen_passes_is_exact_and_never_none() {
        for blocks in 0..100 {
            assert_eq!(Spread::Exact.exact_blocks(blocks), blocks);
        }
        for (blocks, exact) in [
            (0, 0),
            (1, 1),
            (4, 1),
            (15, 1),
            (16, 2),
            (25, 3),
            (2_500, 312),
        ] {
            assert_eq!(Spread::Frozen.exact_blocks(blocks), exact, "{blocks}");
        }
    }
}
