//! Which flights a filter's parameters were fitted to.

use serde::{Deserialize, Serialize};

/// Flights to tune on. None of them is ever evaluated with what was tuned on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TunedOn {
    /// Generated flights, the same whatever is evaluated.
    Generated,
    /// The recordings that the fold does not test.
    Recordings,
    /// Those recordings, and as many generated flights, or sixty if they are fewer.
    Both,
}

impl TunedOn {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Generated, Self::Recordings, Self::Both];

    /// Name in tables and results.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Generated => "generated",
            Self::Recordings => "recordings",
            Self::Both => "both",
        }
    }
}

impl std::fmt::Display for TunedOn {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.label())
    }
}
