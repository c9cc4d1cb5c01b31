//! The firmware's tracker as a method under test.

use bnkf::blob::Blob;
use bnkf::{Correction, Doubt, Estimate, LateTracker, Measurement, Mode, Settings};
use bnkf::{StepError, Tracker, TrackerError};
use bnkf_model_export::radar::reading::Reading;
use bnkf_model_export::scoring::position::position;

use crate::filter::{
    Fate, Filter, FilterError, Forecasts, HORIZONS_US, Nis, PositionEstimate, Start,
};

/// A [`Tracker`] fed with readings rounded to what a sensor's frame carries, coasting in gaps.
pub struct TrackerFilter<'a> {
    tracker: LateTracker<'a>,
    said: Option<(Mode, Doubt)>,
}

impl<'a> TrackerFilter<'a> {
    /// A filter over the networks of `blob`.
    ///
    /// # Errors
    /// The settings do not fit.
    pub fn new(blob: Blob<'a>, settings: Settings) -> Result<Self, TrackerError> {
        Ok(Self {
            tracker: LateTracker::new(Tracker::new(blob, settings)?),
            said: None,
        })
    }

    /// How its last estimate came about and what it suspects; `None` if it refused.
    pub const fn said(&self) -> Option<(Mode, Doubt)> {
        self.said
    }

    fn position_estimate(
        &self,
        answer: Result<Estimate, StepError>,
        reading: Option<&Reading>,
    ) -> Result<PositionEstimate, FilterError> {
        let estimate = answer.map_err(FilterError::Tracker)?;
        let corrected = self.tracker.tracker().settings().correction != Correction::None;
        let nis = reading.and_then(|reading| nis_of(&estimate, reading));
        let (position_m, covariance_m2) = position(&estimate);
        Ok(PositionEstimate {
            position_m,
            covariance_m2,
            nis: nis.filter(|_| corrected),
            fate: match estimate.mode {
                Mode::Started | Mode::Tracking => Some(Fate::Used),
                Mode::Rejected => Some(Fate::Rejected),
                Mode::Restarted => Some(Fate::Restarted),
                Mode::Coasting => None,
            },
            outside: estimate.outside,
        })
    }
}

/// The NIS of an estimate that `reading` met, used or not, with its degrees of freedom; a start met no prediction.
pub fn nis_of(estimate: &Estimate, reading: &Reading) -> Option<Nis> {
    matches!(estimate.mode, Mode::Tracking | Mode::Rejected).then(|| Nis {
        value: f64::from(estimate.nis),
        // A recursive filter measures its velocity too, and may lack a channel.
        degrees: match estimate.motion {
            Some(_) => reading.measured(),
            None => 3,
        },
    })
}

impl Filter for TrackerFilter<'_> {
    fn start(&mut self, start: &Start<'_>) -> Result<PositionEstimate, FilterError> {
        self.tracker.reset();
        let answer = self.tracker.step(&Measurement::from(start.reading));
        self.position_estimate(answer, Some(start.reading))
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
        let said = |estimate: &Estimate| (estimate.mode, estimate.doubt);
        self.said = answer.as_ref().ok().map(said);
        self.position_estimate(answer, reading)
    }

    fn late(&mut self, reading: &Reading) -> Result<PositionEstimate, FilterError> {
        let answer = self.tracker.step(&Measurement::from(reading));
        self.position_estimate(answer, Some(reading))
    }

    fn forecast(&mut self, times_us: &[u64; HORIZONS_US.len()]) -> Result<Forecasts, FilterError> {
        let forecasts = self.tracker.forecasts(times_us);
        let forecasts = forecasts.map_err(FilterError::Tracker)?;
        let [near, middle, far] =
            forecasts.map(|forecast| self.position_estimate(Ok(forecast), None));
        Ok([near?, middle?, far?])
    }
}

#[cfg(test)]
mod tests {
    use bnkf::Settings;
    use bnkf::blob::Kind;
    use bnkf_model_export::radar::pose::Pose;
    use bnkf_model_export::radar::reading::Reading;
    use nalgebra::Vector3;

    use super::TrackerFilter;
    use crate::contest::default_models;
    use crate::filter::{Fate, Filter, Start};

    #[test]
    fn a_target_beyond_the_population_is_outside() {
        let models = default_models::load().unwrap();
        let found = models
            .iter()
            .find(|model| model.blob().kind() == Kind::Recursive);
        let blob = found.unwrap().blob();
        for (range_m, outside) in [(33.0, false), (300.0, true)] {
            let reading = |time_us| Reading {
                time_us,
                range_m,
                elevation_rad: 0.4,
                azimuth_rad: 0.5,
                range_rate_mps: 0.0,
                sigma_range_m: 0.1,
                sigma_elevation_rad: 0.005,
                sigma_azimuth_rad: 0.005,
                sigma_range_rate_mps: 0.05,
                sensor: Pose::ORIGIN,
                late_us: 0,
            };
            let mut filter = TrackerFilter::new(blob, Settings::of(&blob)).unwrap();
            let start = Start {
                reading: &reading(0),
                true_position_m: Vector3::zeros(),
                true_velocity_mps: Vector3::zeros(),
            };
            assert_eq!(filter.start(&start).unwrap().outside, outside);
            let later = filter.step(100_000, Some(&reading(100_000))).unwrap();
            assert_eq!((later.outside, later.fate), (outside, Some(Fate::Used)));
            assert_eq!(filter.step(200_000, None).unwrap().outside, outside);
        }
    }
}
