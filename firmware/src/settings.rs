//! Choices of a tracker.

use crate::blob::{Blob, Kind, field};
use crate::network::monte_carlo::Spread;

/// What the network's estimate is corrected with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Correction {
    /// Nothing: the network alone (BNN).
    None,
    /// The measured position, converted to Cartesian (BNKF, BNKFe; paper Eq. 12-13).
    Converted,
    /// The measured range, elevation and azimuth themselves, and range-rate where the state has a
    /// velocity. The only one for a recursive blob.
    Polar,
}

/// Choices of a [`Tracker`](crate::Tracker).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Correction step.
    pub correction: Correction,
    /// Monte Carlo passes per estimate and network, 1 to [`field::PASSES_MAX`]. For a recursive
    /// blob one pass means every weight at its mean.
    pub passes: u16,
    /// Whose standard deviations the passes are drawn with: [`Spread::Frozen`] halves their cost.
    pub spread: Spread,
    /// Seed of the passes' generator.
    pub seed: u64,
}

/// Why a [`Tracker`](crate::Tracker) cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrackerError {
    /// The number of passes is zero or above [`field::PASSES_MAX`].
    Passes(u16),
    /// A recursive blob takes [`Correction::Polar`] only.
    Correction(Correction),
}

impl Settings {
    /// The blob's own number of passes, the correction of its kind (the paper's for a memoryless
    /// one), seed 1.
    pub fn of(blob: &Blob<'_>) -> Self {
        let correction = match blob.kind() {
            Kind::Memoryless => Correction::Converted,
            Kind::Recursive => Correction::Polar,
        };
        Self {
            correction,
            passes: blob.passes(),
            spread: Spread::Own,
            seed: 1,
        }
    }

    /// Checks that a blob can be run so.
    ///
    /// # Errors
    /// [`TrackerError`] names the setting.
    pub fn check(&self, blob: &Blob<'_>) -> Result<(), TrackerError> {
        if !(1..=field::PASSES_MAX).contains(&self.passes) {
            return Err(TrackerError::Passes(self.passes));
        }
        if blob.kind() == Kind::Recursive && self.correction != Correction::Polar {
            return Err(TrackerError::Correction(self.correction));
        }
        Ok(())
    }
}

impl core::fmt::Display for TrackerError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Passes(passes) => {
                write!(f, "passes: {passes} is not in 1..={}", field::PASSES_MAX)
            }
            Self::Correction(correction) => {
                write!(
                    f,
                    "correction: {correction:?} does not fit a recursive blob"
                )
            }
        }
    }
}

impl core::error::Error for TrackerError {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::draft::Draft;

    #[test]
    fn settings_of_a_blob_fit_it_and_others_are_named() {
        for (draft, correction) in [
            (Draft::memoryless(&[12, 3], 3), Correction::Converted),
            (Draft::recursive(3), Correction::Polar),
        ] {
            let bytes = draft.bytes();
            let blob = Blob::parse(&bytes).expect("a blob");
            let own = Settings::of(&blob);
            assert_eq!((own.correction, own.seed), (correction, 1));
            assert_eq!(own.passes, blob.passes());
            assert_eq!(own.check(&blob), Ok(()));
            for passes in [0, field::PASSES_MAX + 1] {
                let settings = Settings { passes, ..own };
                assert_eq!(settings.check(&blob), Err(TrackerError::Passes(passes)));
            }
            let alone = Settings {
                correction: Correction::None,
                ..own
            };
            let expected = match blob.kind() {
                Kind::Memoryless => Ok(()),
                Kind::Recursive => Err(TrackerError::Correction(Correction::None)),
            };
            assert_eq!(alone.check(&blob), expected);
        }
    }
}
