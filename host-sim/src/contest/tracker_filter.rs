//! The firmware's tracker as a method under test.

use bnkf::blob::Blob;
use bnkf::{Correction, Estimate, Measurement, Mode, Settings, StepError, Tracker, TrackerError};
use bnkf_model_export::radar::reading::Reading;
use nalgebra::{Matrix3, Vector3};

use crate::filter::{Fate, Filter, FilterError, Nis, PositionEstimate, Start};

/// A [`Tracker`] fed with readings rounded to what a sensor's frame carries, coasting in gaps.
pub struct TrackerFilter<'a> {
    tracker: Tracker<'a>,
}

impl<'a> TrackerFilter<'a> {
    /// A filter over the networks of `blob`.
    ///
    /// # Errors
    /// The settings do not fit.
    pub fn new(blob: Blob<'a>, settings: Settings) -> Result<Self, TrackerError> {
        Ok(Self {
            tracker: Tracker::new(blob, settings)?,
        })
    }

    fn position_estimate(
        &self,
        answer: Result<Estimate, StepError>,
    ) -> Result<PositionEstimate, FilterError> {
        let estimate = answer.map_err(FilterError::Tracker)?;
        let corrected = self.tracker.settings().correction != Correction::None;
        let nis = Nis {
            value: f64::from(estimate.nis),
            // A recursive filter measures its velocity too.
            degrees: if estimate.motion.is_some() { 4 } else { 3 },
        };
        Ok(PositionEstimate {
            position_m: Vector3::from(estimate.position_m).map(f64::from),
            covariance_m2: Matrix3::from_fn(|row, column| {
                f64::from(estimate.covariance_m2[row][column])
            }),
            nis: (corrected && estimate.mode == Mode::Tracking).then_some(nis),
            fate: match estimate.mode {
                Mode::Started | Mode::Tracking => Some(Fate::Used),
                Mode::Rejected => Some(Fate::Rejected),
                Mode::Restarted => Some(Fate::Restarted),
                Mode::Coasting => None,
            },
        })
    }
}

impl Filter for TrackerFilter<'_> {
    fn start(&mut self, start: &Start<'_>) -> Result<PositionEstimate, FilterError> {
        self.tracker.reset();
        let answer = self.tracker.step(&Measurement::from(start.reading));
        self.position_estimate(answer)
    }

    fn step(
        &mut self,
        time_us: u64,
        reading: Option<&Reading>,
    ) -> Result<PositionEstimate, FilterError> {
        let answer = match reading {
            Some(reading) => self.tracker.step(&Measurement::from(reading)),
            None => self.tracker.coast(time_us),
        };
        self.position_estimate(answer)
    }
}
