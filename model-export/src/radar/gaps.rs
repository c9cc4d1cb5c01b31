//! The paper's sparse sampling: periodic blocks of measurements, then of silence.
//!
//! Of every `chunk = round(N / 10)` samples the first `round(chunk * rate)` are measured and the
//! rest are not. Nothing here panics.

use serde::{Deserialize, Serialize};

/// The part of the samples that the radar measures, above 0 and at most 1.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct SamplingRate(f64);

/// A sampling rate that is not above 0 and at most 1.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("sampling rate {0} is not above 0 and at most 1")]
pub struct SamplingRateError(pub f64);

impl SamplingRate {
    /// Every sample is measured.
    pub const FULL: Self = Self(1.0);
    /// Three of four.
    pub const THREE_QUARTERS: Self = Self(0.75);
    /// Every other.
    pub const HALF: Self = Self(0.5);
    /// The paper's three rates.
    pub const ALL: [Self; 3] = [Self::FULL, Self::THREE_QUARTERS, Self::HALF];

    /// A checked rate.
    ///
    /// # Errors
    /// The rate is NaN, not above 0, or above 1.
    pub fn new(rate: f64) -> Result<Self, SamplingRateError> {
        if rate > 0.0 && rate <= 1.0 {
            Ok(Self(rate))
        } else {
            Err(SamplingRateError(rate))
        }
    }

    /// The rate as a number.
    #[must_use]
    pub fn get(self) -> f64 {
        self.0
    }
}

impl TryFrom<f64> for SamplingRate {
    type Error = SamplingRateError;

    fn try_from(rate: f64) -> Result<Self, Self::Error> {
        Self::new(rate)
    }
}

impl From<SamplingRate> for f64 {
    fn from(rate: SamplingRate) -> Self {
        rate.0
    }
}

impl std::fmt::Display for SamplingRate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.2}", self.0)
    }
}

/// Which of `samples` samples are measured. The first always is: it starts the filters.
#[must_use]
pub fn measured(samples: usize, rate: SamplingRate) -> Vec<bool> {
    measured_from(samples, rate, 0)
}

/// Like [`measured`], entering the periodic pattern `phase` samples in (training varies it).
#[must_use]
pub fn measured_from(samples: usize, rate: SamplingRate, phase: usize) -> Vec<bool> {
    let chunk = period(samples);
    let kept = (chunk as f64 * rate.0).round() as usize;
    (0..samples)
        .map(|i| i == 0 || (i % chunk + phase % chunk) % chunk < kept)
        .collect()
}

/// Length of the pattern for a flight of `samples` samples, at least 1.
#[must_use]
pub fn period(samples: usize) -> usize {
    ((samples as f64 / 10.0).round() as usize).max(1)
}

#[cfg(test)]
mod tests {
    use super::{SamplingRate, SamplingRateError, measured, measured_from, period};
    use proptest::prelude::*;

    #[test]
    fn a_150_sample_flight_has_the_papers_blocks() {
        assert_eq!(period(150), 15);
        for (rate, kept) in SamplingRate::ALL.into_iter().zip([15, 11, 8]) {
            let mask = measured(150, rate);
            for (i, seen) in mask.iter().enumerate() {
                assert_eq!(*seen, i % 15 < kept, "sample {i} at rate {rate}");
            }
        }
    }

    #[test]
    fn rates_outside_the_unit_interval_are_refused() {
        for rate in [0.0, -0.5, 1.0 + 1e-12, f64::INFINITY] {
            assert_eq!(SamplingRate::new(rate), Err(SamplingRateError(rate)));
        }
        assert!(SamplingRate::new(f64::NAN).is_err());
        assert!(serde_json::from_str::<SamplingRate>("1.5").is_err());
        assert_eq!(
            serde_json::from_str::<SamplingRate>("0.75").unwrap(),
            SamplingRate::THREE_QUARTERS
        );
    }

    proptest! {
        #[test]
        fn the_first_sample_is_measured_and_the_share_is_near_the_rate(
            samples in 1_usize..5000, rate in 0.01..=1.0_f64, phase in any::<usize>()
        ) {
            let rate = SamplingRate::new(rate).unwrap();
            let mask = measured_from(samples, rate, phase);
            prop_assert_eq!(mask.len(), samples);
            prop_assert!(mask[0]);
            // Rounding costs half a sample a period, a cut period at most one period.
            let seen = mask.iter().filter(|seen| **seen).count() as f64;
            let periods = samples as f64 / period(samples) as f64;
            let slack = 0.5 * periods + period(samples) as f64 + 1.0;
            prop_assert!((seen - rate.get() * samples as f64).abs() <= slack);
        }

        #[test]
        fn the_phase_shifts_the_pattern(samples in 20_usize..500, phase in 0_usize..50) {
            let from_start = measured(samples, SamplingRate::HALF);
            let shifted = measured_from(samples, SamplingRate::HALF, phase);
            let phase = phase % period(samples);
            for i in 1..samples - phase {
                prop_assert_eq!(shifted[i], from_start[i + phase]);
            }
        }
    }
}
