//! How well a measurement fits a track.

use super::measurement::CHANNELS;
use crate::likelihood::Likelihood;

/// What a track says of a measurement, for associating plots with tracks.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BnkfLikelihood {
    /// What was measured less what was expected: elevation, azimuth (rad), range (m), range-rate (m/s); zero
    /// where there is none.
    pub innovation: [f32; 4],
    /// Normalised innovation squared.
    pub nis: f32,
    /// Natural logarithm of the density.
    pub ln_likelihood: f32,
    /// What the innovation is of: the sum of `BNKF_ELEVATION` and so on.
    pub channels: u8,
    /// Degrees of freedom of the NIS.
    pub degrees: u8,
    /// Whether a step's gate would pass the measurement. It passes many that are another target's: associate by
    /// `nis` and `ln_likelihood`.
    pub passes_gate: bool,
}

impl From<&Likelihood> for BnkfLikelihood {
    fn from(likelihood: &Likelihood) -> Self {
        let there = likelihood.innovation.iter().zip(CHANNELS);
        Self {
            innovation: likelihood.innovation.map(Option::unwrap_or_default),
            nis: likelihood.nis,
            ln_likelihood: likelihood.ln_likelihood,
            channels: there
                .filter(|(innovation, _)| innovation.is_some())
                .fold(0, |channels, (_, channel)| channels | channel),
            degrees: likelihood.degrees,
            passes_gate: likelihood.passes_gate,
        }
    }
}
