//! How a tracker asks its networks.

use crate::blob::field;
use crate::spread::Spread;

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
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(
        try_from = "crate::protocol::InferenceCode",
        into = "crate::protocol::InferenceCode"
    )
)]
pub enum Inference {
    /// Nothing: every weight at its mean.
    Mean,
    /// Monte Carlo passes: the mean and the spread of the answers of drawn weights.
    Passes(Passes),
    /// Mean and covariance of the answers without drawing: each layer's noise to first order.
    Moments,
}

/// Monte Carlo passes per estimate and network, 2 to [`field::PASSES_MAX`]: one alone has no spread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Passes {
    count: u16,
    spread: Spread,
}

/// A number of passes that is zero or above [`field::PASSES_MAX`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PassesError(pub u16);

impl Passes {
    /// How many they are.
    pub const fn count(self) -> u16 {
        self.count
    }

    /// Whose standard deviations they draw with.
    pub const fn spread(self) -> Spread {
        self.spread
    }
}

impl Inference {
    /// So many exact passes; one takes every weight at its mean.
    ///
    /// # Errors
    /// The number is out of range.
    pub const fn of_passes(passes: u16) -> Result<Self, PassesError> {
        match passes {
            1 => Ok(Self::Mean),
            2..=field::PASSES_MAX => Ok(Self::Passes(Passes {
                count: passes,
                spread: Spread::Exact,
            })),
            _ => Err(PassesError(passes)),
        }
    }

    /// The same passes with frozen spreads; without passes nothing is there to freeze.
    pub const fn frozen(self) -> Self {
        match self {
            Self::Passes(passes) => Self::Passes(Passes {
                spread: Spread::Frozen,
                ..passes
            }),
            other => other,
        }
    }

    /// The same with no more than `passes`; without two of them every weight is at its mean.
    pub const fn at_most(self, passes: u16) -> Self {
        match self {
            Self::Passes(own) if own.count() > passes => match Self::of_passes(passes) {
                Ok(Self::Passes(fewer)) => Self::Passes(Passes {
                    spread: own.spread,
                    ..fewer
                }),
                _ => Self::Mean,
            },
            other => other,
        }
    }
}

impl core::fmt::Display for Inference {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Mean => f.write_str("mean weights"),
            Self::Passes(passes) => {
                write!(f, "{} passes", passes.count())?;
                match passes.spread() {
                    Spread::Exact => Ok(()),
                    Spread::Frozen => f.write_str(", frozen spreads"),
                }
            }
            Self::Moments => f.write_str("moments"),
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
            assert_eq!((passes.count(), passes.spread()), (count, Spread::Exact));
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
        assert_eq!(of(100).frozen().at_most(4), of(4).frozen());
        assert_eq!(of(100).frozen().at_most(1), Inference::Mean);
        for other in [Inference::Mean, Inference::Moments] {
            assert_eq!(other.at_most(1), other);
        }
    }

    #[test]
    fn frozen_passes_are_as_many_and_say_so() {
        let exact = Inference::of_passes(16).unwrap();
        let Inference::Passes(frozen) = exact.frozen() else {
            panic!("passes");
        };
        assert_eq!((frozen.count(), frozen.spread()), (16, Spread::Frozen));
        assert_eq!(Inference::Mean.frozen(), Inference::Mean);
        let said = [Inference::Mean, exact, exact.frozen()].map(|inference| inference.to_string());
        assert_eq!(
            said,
            ["mean weights", "16 passes", "16 passes, frozen spreads"]
        );
    }
}
