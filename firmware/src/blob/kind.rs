//! What a blob's networks estimate, and from which inputs.

use super::{Activation, field};

/// What the networks of a blob estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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

    /// What an id means to a blob of `kind`.
    pub(super) const fn of_id(id: u8, kind: Kind) -> Option<Self> {
        match (kind, id) {
            (Kind::Memoryless, 1) => Some(Self::Polar12),
            (Kind::Memoryless, 2) => Some(Self::Polar13),
            (Kind::Recursive, 3) => Some(Self::Recursive64),
            _ => None,
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

    /// What an id means.
    pub(super) const fn of_id(id: u8) -> Option<Self> {
        match id {
            1 => Some(Self::Memoryless),
            2 => Some(Self::Recursive),
            _ => None,
        }
    }

    /// Number of parameters that follow the header in a version of the format.
    pub const fn parameters(self, version: u16) -> usize {
        match self {
            Self::Memoryless => field::MEMORYLESS_PARAMETERS,
            Self::Recursive if version < field::VERSION_BEND => field::RECURSIVE_PARAMETERS_BEFORE,
            Self::Recursive => field::RECURSIVE_PARAMETERS,
        }
    }

    /// The oldest version that holds so many parameters and networks whose hidden layers end so: what is to be
    /// written, so that readers of before can read what they could.
    pub fn oldest_version(self, parameters: usize, activation: Activation) -> u16 {
        match (self, activation) {
            (Self::Recursive, _) if parameters > field::RECURSIVE_PARAMETERS_BEFORE => {
                field::VERSION_BEND
            }
            (_, Activation::Gelu) => field::VERSION_GELU,
            _ => field::VERSION_ACTIVATION,
        }
    }

    /// The parameters of the latest version, in their order, with what each may be.
    pub const fn parameter_limits(self) -> &'static [ParameterLimits] {
        match self {
            Self::Memoryless => &MEMORYLESS,
            Self::Recursive => &RECURSIVE,
        }
    }
}

/// A parameter's name and the values that make sense.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterLimits {
    /// Name and unit.
    pub name: &'static str,
    /// Least value.
    pub least: f32,
    /// Largest value.
    pub most: f32,
}

const fn limits(name: &'static str, least: f32, most: f32) -> ParameterLimits {
    ParameterLimits { name, least, most }
}

/// Anything from a crawl to ten times the speed of sound.
const MEMORYLESS: [ParameterLimits; field::MEMORYLESS_PARAMETERS] = [
    limits("speed sigma [m/s]", 1e-3, 3e3),
    limits("acceleration sigma [m/s^2]", 1e-3, 3e3),
];

/// As far as radars measure; decay and densities from motion that changes over hours to motion that
/// changes within a sample, so that every network's answer, up to e^7 times as much, stays finite.
const RECURSIVE: [ParameterLimits; field::RECURSIVE_PARAMETERS] = [
    limits("mean range [m]", 0.1, 1e6),
    limits("range sigma [m]", 1e-3, 1e6),
    limits("mean elevation [rad]", -1.6, 1.6),
    limits("elevation sigma [rad]", 1e-4, 3.2),
    limits("horizontal speed sigma [m/s]", 1e-3, 3e3),
    limits("vertical speed sigma [m/s]", 1e-3, 3e3),
    limits("acceleration sigma [m/s^2]", 1e-3, 3e3),
    limits("acceleration decay [1/s]", 1e-3, 1e2),
    limits("jerk noise [m^2/s^5]", 1e-6, 1e6),
    limits("acceleration noise [m^2/s^3]", 1e-9, 1e6),
    limits("velocity noise [m^2/s]", 1e-9, 1e6),
    limits("mean horizontal range [m]", 0.0, 1e6),
    limits("horizontal range sigma [m]", 1e-3, 1e6),
    limits("mean height [m]", -1e6, 1e6),
    limits("height sigma [m]", 1e-3, 1e6),
    limits("largest speed [m/s]", 1e-3, 3e3),
    limits("largest acceleration [m/s^2]", 1e-3, 3e3),
    limits("least range [m]", 0.0, 1e6),
    limits("largest range [m]", 0.0, 1e6),
    limits("least elevation [rad]", -1.6, 1.6),
    limits("largest elevation [rad]", -1.6, 1.6),
    limits("confidence [steps]", 1.0, 1e6),
    limits("prior of the first manoeuvre", 1e-9, 0.3),
    limits("jerk of the first manoeuvre", 1.0, 1e4),
    limits("acceleration of the first manoeuvre", 1.0, 1e4),
    limits("velocity of the first manoeuvre", 1.0, 1e4),
    limits("prior of the second manoeuvre", 1e-9, 0.3),
    limits("jerk of the second manoeuvre", 1.0, 1e4),
    limits("acceleration of the second manoeuvre", 1.0, 1e4),
    limits("velocity of the second manoeuvre", 1.0, 1e4),
    limits("prior of an outlier", 1e-9, 0.3),
    limits("variance of an outlier", 1.0, 1e6),
    limits("part of a forecast's bend", 0.0, 1.5),
];
