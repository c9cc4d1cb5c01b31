//! Compares the image's estimates with those of the same tracker on the host, bit for bit.

use bnkf::blob::Blob;
use bnkf::call::Call;
use bnkf::protocol::{EstimateFrame, RefusalCode};
use bnkf::{Measurement, Settings, Tracker, TrackerError};
use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::sampling::{RadarSettings, sample_radars, time_us};
use bnkf_model_export::radar::sensors::Sensors;

use crate::image::question::Questions;
use crate::image::session::{ImageSession, SessionError};

/// One step of a recorded sequence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedStep {
    /// Microseconds.
    pub time_us: u64,
    /// What was measured; `None` in a gap.
    pub measurement: Option<Measurement>,
}

/// What radars report of a flight, step by step.
pub fn record(flight: &Flight, radar: &RadarSettings, sensors: &Sensors) -> Vec<RecordedStep> {
    let readings = sample_radars(flight, radar, |turn, time_s| sensors.pose(turn, time_s));
    let steps = flight.samples.iter().zip(readings);
    steps
        .map(|(sample, reading)| RecordedStep {
            time_us: time_us(flight, sample.time_s),
            measurement: reading.as_ref().map(Measurement::from),
        })
        .collect()
}

/// What a tracker made of one step.
pub type Outcome = Result<EstimateFrame, RefusalCode>;

/// A step whose outcomes differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Index of the step.
    pub step: usize,
    /// On the image.
    pub image: Outcome,
    /// On the host.
    pub host: Outcome,
}

/// Result of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Steps compared.
    pub steps: usize,
    /// Steps with the same outcome to the last bit.
    pub identical: usize,
    /// Steps that both refused alike; part of `identical`.
    pub refused: usize,
    /// The first difference.
    pub first_difference: Option<Difference>,
    /// Cost of each estimate from a measurement, counter ticks: instructions in QEMU.
    pub ticks_measured: Vec<u32>,
    /// Cost of each estimate without one, counter ticks.
    pub ticks_coasted: Vec<u32>,
    /// Forecasts after every step.
    pub forecasts: Questions,
    /// Likelihoods of every measurement, before its step.
    pub likelihoods: Questions,
}

/// Smallest, middle and largest of some counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spread {
    /// Smallest.
    pub min: u32,
    /// Lower median.
    pub median: u32,
    /// Largest.
    pub max: u32,
}

impl Spread {
    /// The spread of `counts`, or `None` when there are none.
    pub fn of(counts: &[u32]) -> Option<Self> {
        let mut sorted = counts.to_vec();
        sorted.sort_unstable();
        Some(Self {
            min: *sorted.first()?,
            median: *sorted.get((sorted.len() - 1) / 2)?,
            max: *sorted.last()?,
        })
    }
}

/// Why the two cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum EqualityError {
    /// The conversation with the image failed.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The host's tracker cannot be made.
    #[error("{0}")]
    Tracker(#[from] TrackerError),
}

/// Runs `steps` through a new track of the image and of the host's tracker.
///
/// # Errors
/// The settings are refused or the image does not answer. A difference is not an error.
pub fn compare(
    session: &mut ImageSession,
    blob: Blob<'_>,
    settings: Settings,
    steps: &[RecordedStep],
) -> Result<Comparison, EqualityError> {
    let mut tracker = Tracker::new(blob, settings)?;
    session.reset(settings.into())?;
    let mut comparison = Comparison {
        steps: steps.len(),
        identical: 0,
        refused: 0,
        first_difference: None,
        ticks_measured: Vec::new(),
        ticks_coasted: Vec::new(),
        forecasts: Questions::default(),
        likelihoods: Questions::default(),
    };
    for (index, step) in steps.iter().enumerate() {
        if let Some(measurement) = &step.measurement {
            let likelihoods = &mut comparison.likelihoods;
            likelihoods.ask_likelihood(session, &mut tracker, measurement)?;
        }
        let image = session.step(step.time_us, step.measurement.as_ref())?;
        let host = Call::new(step.time_us, step.measurement)
            .answer(&mut tracker)
            .map(|estimate| EstimateFrame::new(&estimate, 0))
            .map_err(RefusalCode::from);
        if let Ok(estimate) = &image {
            match step.measurement {
                Some(_) => comparison.ticks_measured.push(estimate.ticks),
                None => comparison.ticks_coasted.push(estimate.ticks),
            }
        }
        let same = match (&image, &host) {
            (Ok(image), Ok(host)) => image.same_bits(host),
            (Err(image), Err(host)) => image == host,
            _ => false,
        };
        if same {
            comparison.identical += 1;
            comparison.refused += usize::from(host.is_err());
        } else if comparison.first_difference.is_none() {
            comparison.first_difference = Some(Difference {
                step: index,
                image,
                host,
            });
        }
        let forecasts = &mut comparison.forecasts;
        forecasts.ask_forecast(session, &mut tracker, step.time_us)?;
    }
    Ok(comparison)
}

impl Comparison {
    /// Whether every step and every answer agreed.
    pub fn all_identical(&self) -> bool {
        self.identical == self.steps
            && self.forecasts.all_identical()
            && self.likelihoods.all_identical()
    }
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let show = |outcome: &Outcome| match outcome {
            Ok(estimate) => format!(
                "position {:?} m, NIS {:?}",
                estimate.position_m, estimate.nis
            ),
            Err(code) => format!("refused, {code}"),
        };
        write!(
            f,
            "step {}: image {}; host {}",
            self.step,
            show(&self.image),
            show(&self.host)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::Spread;

    #[test]
    fn a_spread_does_not_depend_on_the_order() {
        assert_eq!(Spread::of(&[]), None);
        let spread = |min, median, max| Some(Spread { min, median, max });
        assert_eq!(Spread::of(&[5]), spread(5, 5, 5));
        assert_eq!(Spread::of(&[9, 1, 4, 2]), spread(1, 2, 9));
    }
}
