//! Choices of a tracker.

use crate::blob::{Blob, Kind};
use crate::inference::Inference;
use crate::part::Part;

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
    /// This build leaves out what the blob or the inference needs.
    LeftOut(Part),
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

    /// Whether a model of a kind that is run so needs a part.
    pub fn needs(&self, kind: Kind, part: Part) -> bool {
        match part {
            Part::Memoryless => kind == Kind::Memoryless,
            Part::Passes => matches!(self.inference, Inference::Passes(_)),
            Part::Moments => self.inference == Inference::Moments,
        }
    }

    /// What it needs and this build leaves out.
    pub(crate) fn left_out(&self, kind: Kind) -> Option<Part> {
        let mut parts = Part::ALL.into_iter();
        parts.find(|part| self.needs(kind, *part) && !part.is_built())
    }

    /// Checks that a blob can be run so.
    ///
    /// # Errors
    /// [`TrackerError`] names the setting.
    pub fn check(&self, blob: &Blob<'_>) -> Result<(), TrackerError> {
        if blob.kind() == Kind::Recursive && self.correction != Correction::Polar {
            return Err(TrackerError::Correction(self.correction));
        }
        match self.left_out(blob.kind()) {
            Some(part) => Err(TrackerError::LeftOut(part)),
            None => Ok(()),
        }
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
            Self::LeftOut(part) => write!(f, "this build is without the feature {part}"),
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
            for (inference, part) in [
                (Inference::Mean, None),
                (
                    Inference::of_passes(16).expect("passes"),
                    Some(Part::Passes),
                ),
                (Inference::Moments, Some(Part::Moments)),
            ] {
                let settings = Settings { inference, ..own };
                let kind = (blob.kind() == Kind::Memoryless).then_some(Part::Memoryless);
                let needed = |part: &Part| settings.needs(blob.kind(), *part);
                let parts: std::vec::Vec<Part> = Part::ALL.into_iter().filter(needed).collect();
                let expected: std::vec::Vec<Part> = kind.into_iter().chain(part).collect();
                assert_eq!(parts, expected);
                let left_out = expected.into_iter().find(|part| !part.is_built());
                let expected = left_out.map_or(Ok(()), |part| Err(TrackerError::LeftOut(part)));
                assert_eq!(settings.check(&blob), expected);
            }
        }
    }
}
