//! What follows the hidden layers of a network.

/// The function that each hidden unit ends in; the last layer ends in nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Activation {
    /// `x * Phi(x)`: what this crate's own networks have, and all of version 2.
    #[default]
    Gelu,
    /// `max(x, 0)`.
    Relu,
    /// Hyperbolic tangent.
    Tanh,
    /// `x`.
    Identity,
}

impl Activation {
    /// The id in the blob.
    pub const fn id(self) -> u8 {
        match self {
            Self::Gelu => 0,
            Self::Relu => 1,
            Self::Tanh => 2,
            Self::Identity => 3,
        }
    }

    /// What an id means.
    pub(super) const fn of_id(id: u8) -> Option<Self> {
        match id {
            0 => Some(Self::Gelu),
            1 => Some(Self::Relu),
            2 => Some(Self::Tanh),
            3 => Some(Self::Identity),
            _ => None,
        }
    }
}

impl core::fmt::Display for Activation {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Gelu => "GELU",
            Self::Relu => "ReLU",
            Self::Tanh => "tanh",
            Self::Identity => "identity",
        })
    }
}
