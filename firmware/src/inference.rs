//! How a tracker asks its networks.

use crate::blob::field;

/// What becomes of the doubt about the weights.
///
/// ```
/// use bnkf::{Inference, Passes, PassesError};
///
/// let sixteen = Inference::of_passes(16)?;
/// assert!(matches!(sixteen, Inference::Passes(passes) if Passes::count(passes) == 16));
/// assert_eq!(Inference::of_passes(1)?, Inference::Mean);
/// assert_eq!(Inference::of_passes(0), Err(PassesError(0)));
/// # Ok::<(), PassesError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inference {
    /// Nothing: every weight at its mean.
    Mean,
    /// Monte Carlo passes: the mean and the spread of the answers of drawn weights.
    Passes(Passes),
}

/// Monte Carlo passes per estimate and network, 2 to [`field::PASSES_MAX`]: one alone has no spread.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Passes(u16);

/// A number of passes that is zero or above [`field::PASSES_MAX`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PassesError(pub u16);

impl Passes {
    /// How many they are.
    pub const fn count(self) -> u16 {
        self.0
    }
}

impl Inference {
    /// So many passes; one takes every weight at its mean.
    ///
    /// # Errors
    /// The number is out of range.
    pub const fn of_passes(passes: u16) -> Result<Self, PassesError> {
        match passes {
            1 => Ok(Self::Mean),
            2..=field::PASSES_MAX => Ok(Self::Passes(Passes(passes))),
            _ => Err(PassesError(passes)),
        }
    }

    /// The same with no more than `passes`; without two of them every weight is at its mean.
    pub const fn at_most(self, passes: u16) -> Self {
        match self {
            Self::Passes(own) if own.count() > passes => match Self::of_passes(passes) {
                Ok(fewer) => fewer,
                Err(PassesError(_)) => Self::Mean,
            },
            other => other,
        }
    }
}

impl core::fmt::Display for Inference {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Mean => f.write_str("mean weights"),
            Self::Passes(passes) => write!(f, "{} passes", passes.count()),
        }
    }
}

impl core::fmt::Display for PassesError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "passes: {} is not in 1..={}", self.0, field::PASSES_MAX)
    }
}

impl core::error::Error for PassesError {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn one_pass_is_the_mean_and_numbers_out_of_range_are_named() {
        assert_eq!(Inference::of_passes(1), Ok(Inference::Mean));
        for count in [2, 100, field::PASSES_MAX] {
            let Ok(Inference::Passes(passes)) = Inference::of_passes(count) else {
                panic!("{count} passes");
            };
            assert_eq!(passes.count(), count);
        }
        for count in [0, field::PASSES_MAX + 1, u16::MAX] {
            let error = Inference::of_passes(count).expect_err("out of range");
            assert_eq!(error, PassesError(count));
            let expected = std::format!("passes: {count} is not in 1..=10000");
            assert_eq!(error.to_string(), expected);
        }
    }

    #[test]
    fn fewer_passes_are_never_more() {
        let of = |passes| Inference::of_passes(passes).unwrap();
        assert_eq!(of(100).at_most(4), of(4));
        assert_eq!(of(3).at_most(4), of(3));
        for few in [0, 1] {
            assert_eq!(of(100).at_most(few), Inference::Mean);
        }
        assert_eq!(Inference::Mean.at_most(4), Inference::Mean);
    }
}
