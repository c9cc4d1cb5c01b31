//! Choices of a tracker.

use crate::blob::{Blob, Kind};
use crate::inference::Inference;

/// What the network's estimate is corrected with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
///
/// ```
/// use bnkf::{Correction, Inference, Model, Settings, Track, TrackerError};
/// # static BLOB: &[u8] = include_bytes!("../models/recursive.bnkf");
///
/// let model = Model::new(BLOB)?;
/// let settings = Settings {
///     inference: Inference::of_passes(16)?,
///     ..Settings::of(model.blob())
/// };
/// Track::new(&model, settings)?;
/// let wrong = Settings { correction: Correction::None, ..settings };
/// let refusal = TrackerError::Correction(Correction::None);
/// assert_eq!(Track::new(&model, wrong).err(), Some(refusal));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    /// Correction step.
    pub correction: Correction,
    /// How the networks are asked.
    pub inference: Inference,
    /// Seed of the passes' generator.
    pub seed: u64,
}

/// Why a [`Tracker`](crate::Tracker) cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum TrackerError {
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
            // No parsed blob asks for a number that is out of range.
            inference: Inference::of_passes(blob.passes()).unwrap_or(Inference::Mean),
            seed: 1,
        }
    }

    /// Checks that a blob can be run so.
    ///
    /// # Errors
    /// [`TrackerError`] names the setting.
    pub fn check(&self, blob: &Blob<'_>) -> Result<(), TrackerError> {
        if blob.kind() == Kind::Recursive && self.correction != Correction::Polar {
            return Err(TrackerError::Correction(self.correction));
        }
        Ok(())
    }
}

impl core::fmt::Display for TrackerError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
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
            assert_eq!(Inference::of_passes(blob.passes()), Ok(own.inference));
            assert_eq!(own.check(&blob), Ok(()));
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
