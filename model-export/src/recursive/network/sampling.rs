//! Which weights are distributions and which are numbers.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Layers whose weights are sampled in training and keep a variance in the blob.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sampling {
    /// A Bayesian network
    EveryLayer,
    /// Only the last layer is Bayesian
    LastLayer,
    /// The deterministic twin
    Nothing,
}

impl Sampling {
    /// Whether the weights of `layer` (of `layers`, from 0) are distributions.
    #[must_use]
    pub fn covers(self, layer: usize, layers: usize) -> bool {
        match self {
            Self::EveryLayer => true,
            Self::LastLayer => layer + 1 == layers,
            Self::Nothing => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Sampling;

    #[test]
    fn layers_are_covered_as_named() {
        let covered = |sampling: Sampling| [0, 3, 4].map(|layer| sampling.covers(layer, 5));
        assert_eq!(covered(Sampling::EveryLayer), [true; 3]);
        assert_eq!(covered(Sampling::LastLayer), [false, false, true]);
        assert_eq!(covered(Sampling::Nothing), [false; 3]);
    }
}
