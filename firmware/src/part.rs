//! What a build may leave out.

/// A part of the crate that a Cargo feature of the same name brings, all of them by default. What is left out
/// takes neither flash nor room in a [`Workspace`](crate::Workspace); settings that ask for it are refused.
///
/// ```
/// assert!(bnkf::Part::Passes.is_built());
/// assert_eq!(bnkf::Part::Passes.to_string(), "passes");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Part {
    /// Models that answer with a position (BNN, BNKF, BNKFe): feature `memoryless`.
    Memoryless,
    /// Monte Carlo passes: feature `passes`.
    Passes,
    /// Moments without passes: feature `moments`.
    Moments,
}

impl Part {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Memoryless, Self::Passes, Self::Moments];

    /// Whether it is there.
    pub const fn is_built(self) -> bool {
        match self {
            Self::Memoryless => cfg!(feature = "memoryless"),
            Self::Passes => cfg!(feature = "passes"),
            Self::Moments => cfg!(feature = "moments"),
        }
    }

    /// One if it is there, none otherwise: how many rooms it needs.
    pub(crate) const fn count(self) -> usize {
        if self.is_built() { 1 } else { 0 }
    }
}

impl core::fmt::Display for Part {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Memoryless => "memoryless",
            Self::Passes => "passes",
            Self::Moments => "moments",
        })
    }
}
