//! What a blob's networks estimate, and from which inputs.

use super::field;

/// What the networks of a blob estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Position from the previous and the current measurement (the paper's BNN, BNKF, BNKFe).
    Memoryless,
    /// A schedule of the motion model of a recursive filter.
    Recursive,
}

/// What the inputs of the network are, in order.
///
/// The polar layouts start with range, elevation, azimuth and range-rate of the previous
/// measurement, then the same four of the current one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeatureLayout {
    /// The paper's twelve: both measurements, then the four sigmas as they are.
    Polar12,
    /// Both measurements with the previous azimuth unwrapped towards the current one, the natural
    /// logarithms of the four sigmas, and the time between the measurements in seconds.
    Polar13,
    /// State, covariance and statistics of the recursive filter; `BLOB.md` lists them.
    Recursive64,
}

impl FeatureLayout {
    /// The id in the blob.
    pub const fn id(self) -> u8 {
        match self {
            Self::Polar12 => 1,
            Self::Polar13 => 2,
            Self::Recursive64 => 3,
        }
    }

    /// Number of features.
    pub const fn len(self) -> usize {
        match self {
            Self::Polar12 => 12,
            Self::Polar13 => 13,
            Self::Recursive64 => 64,
        }
    }

    /// Never: every layout has features.
    pub const fn is_empty(self) -> bool {
        false
    }
}

impl Kind {
    /// The id in the blob.
    pub const fn id(self) -> u8 {
        match self {
            Self::Memoryless => 1,
            Self::Recursive => 2,
        }
    }

    /// Number of parameters that follow the header.
    pub const fn parameters(self) -> usize {
        match self {
            Self::Memoryless => field::MEMORYLESS_PARAMETERS,
            Self::Recursive => field::RECURSIVE_PARAMETERS,
        }
    }
}
