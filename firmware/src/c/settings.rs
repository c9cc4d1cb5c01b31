//! Settings of a track.

use super::status::BnkfStatus;
use crate::inference::Inference;
use crate::settings::{Correction, Settings};
use crate::spread::Spread;

/// What the network's estimate is corrected with.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BnkfCorrection {
    /// Nothing: the network alone. For a memoryless model.
    None = 0,
    /// The measured position, converted to Cartesian. For a memoryless model.
    Converted = 1,
    /// What was measured itself; the only one for a recursive model.
    Polar = 2,
}

/// What becomes of the doubt about the weights.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BnkfInferenceKind {
    /// Nothing: every weight at its mean.
    Mean = 0,
    /// Monte Carlo passes with drawn weights.
    Passes = 1,
    /// The same, most of them with the standard deviations of the first ones.
    FrozenPasses = 2,
    /// Mean and covariance without drawing.
    Moments = 3,
}

/// How a track asks its network.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BnkfInference {
    /// A `BnkfInferenceKind`.
    pub kind: u8,
    /// Passes, 2 to 10000, where it is by passes; else zero.
    pub passes: u16,
}

/// Settings of a track; `bnkf_model_settings` fills them in.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BnkfSettings {
    /// A `BnkfCorrection`.
    pub correction: u8,
    /// How the network is asked.
    pub inference: BnkfInference,
    /// Seed of the passes.
    pub seed: u64,
}

impl From<Settings> for BnkfSettings {
    fn from(settings: Settings) -> Self {
        let correction = match settings.correction {
            Correction::None => BnkfCorrection::None,
            Correction::Converted => BnkfCorrection::Converted,
            Correction::Polar => BnkfCorrection::Polar,
        };
        Self {
            correction: correction as u8,
            inference: settings.inference.into(),
            seed: settings.seed,
        }
    }
}

impl From<Inference> for BnkfInference {
    fn from(inference: Inference) -> Self {
        let (kind, passes) = match inference {
            Inference::Mean => (BnkfInferenceKind::Mean, 0),
            Inference::Passes(passes) => match passes.spread() {
                Spread::Exact => (BnkfInferenceKind::Passes, passes.count()),
                Spread::Frozen => (BnkfInferenceKind::FrozenPasses, passes.count()),
            },
            Inference::Moments => (BnkfInferenceKind::Moments, 0),
        };
        Self {
            kind: kind as u8,
            passes,
        }
    }
}

impl TryFrom<BnkfSettings> for Settings {
    type Error = BnkfStatus;

    fn try_from(settings: BnkfSettings) -> Result<Self, BnkfStatus> {
        const NONE: u8 = BnkfCorrection::None as u8;
        const CONVERTED: u8 = BnkfCorrection::Converted as u8;
        const POLAR: u8 = BnkfCorrection::Polar as u8;
        Ok(Self {
            correction: match settings.correction {
                NONE => Correction::None,
                CONVERTED => Correction::Converted,
                POLAR => Correction::Polar,
                _ => return Err(BnkfStatus::UnknownCode),
            },
            inference: settings.inference.try_into()?,
            seed: settings.seed,
        })
    }
}

impl TryFrom<BnkfInference> for Inference {
    type Error = BnkfStatus;

    fn try_from(BnkfInference { kind, passes }: BnkfInference) -> Result<Self, BnkfStatus> {
        const MEAN: u8 = BnkfInferenceKind::Mean as u8;
        const PASSES: u8 = BnkfInferenceKind::Passes as u8;
        const FROZEN: u8 = BnkfInferenceKind::FrozenPasses as u8;
        const MOMENTS: u8 = BnkfInferenceKind::Moments as u8;
        let exact = || Self::of_passes(passes).map_err(|_| BnkfStatus::SettingsPasses);
        match (kind, passes) {
            (MEAN, 0) => Ok(Self::Mean),
            (MOMENTS, 0) => Ok(Self::Moments),
            // One pass is the mean, which has its own kind.
            (MEAN | MOMENTS, _) | (PASSES | FROZEN, 1) => Err(BnkfStatus::SettingsPasses),
            (PASSES, _) => exact(),
            (FROZEN, _) => exact().map(Self::frozen),
            _ => Err(BnkfStatus::UnknownCode),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_come_back_as_they_were_and_others_are_refused() {
        let corrections = [Correction::None, Correction::Converted, Correction::Polar];
        for correction in corrections {
            let exact = [1, 2, 100, 10_000].map(|n| Inference::of_passes(n).expect("in range"));
            let frozen = exact.map(Inference::frozen);
            for inference in exact.into_iter().chain(frozen).chain([Inference::Moments]) {
                let settings = Settings {
                    correction,
                    inference,
                    seed: 7 << 40,
                };
                let there = BnkfSettings::from(settings);
                assert_eq!(Settings::try_from(there), Ok(settings));
                let odd = BnkfSettings {
                    correction: 3,
                    ..there
                };
                assert_eq!(Settings::try_from(odd), Err(BnkfStatus::UnknownCode));
            }
        }
        let of = |kind, passes| Inference::try_from(BnkfInference { kind, passes });
        for (kind, passes) in [
            (0, 1),
            (0, 100),
            (1, 0),
            (1, 1),
            (1, 10_001),
            (2, 1),
            (3, 2),
        ] {
            let refusal = Err(BnkfStatus::SettingsPasses);
            assert_eq!(of(kind, passes), refusal, "{kind} {passes}");
        }
        assert_eq!(of(u8::MAX, 0), Err(BnkfStatus::UnknownCode));
    }
}
