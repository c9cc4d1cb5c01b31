//! One target's tracker, memoryless or recursive as its blob says.
//!
//! The only owner of filter state: everything lives inside [`Tracker`], whose size is fixed.

use crate::blob::{Blob, Kind};
use crate::clock::{Clock, ClockError, Tick};
use crate::estimate::Estimate;
use crate::measurement::Measurement;
use crate::memoryless::Memoryless;
use crate::recursive::Recursive;
use crate::settings::{Settings, TrackerError};
use crate::step_error::StepError;

/// Estimates the position of one target from its radar measurements.
///
/// A memoryless blob holds one network for all axes (BNKF) or one per axis (BNKFe) that answer
/// with a position; a recursive blob holds one that schedules the motion model of a filter.
///
/// Every estimate is finite, its covariances are positive definite, and its mode is what happened;
/// `docs/limits.md` lists what is refused and bounded, and why.
pub struct Tracker<'a> {
    settings: Settings,
    clock: Clock,
    latest: Option<Measurement>,
    inner: Inner<'a>,
}

// One tracker is made once and lives in static memory: the larger size is what counts.
#[allow(clippy::large_enum_variant)]
enum Inner<'a> {
    Memoryless(Memoryless<'a>),
    Recursive(Recursive<'a>),
}

/// Static memory of the tracker is part of its contract: what a caller must set aside.
pub const TRACKER_BYTES_MAX: usize = 4_352;
const _: () = assert!(size_of::<Tracker<'static>>() <= TRACKER_BYTES_MAX);

impl<'a> Tracker<'a> {
    /// A tracker that has seen nothing yet.
    ///
    /// # Errors
    /// [`TrackerError`] names the setting.
    pub fn new(blob: Blob<'a>, settings: Settings) -> Result<Self, TrackerError> {
        settings.check(&blob)?;
        let inner = match blob.kind() {
            Kind::Memoryless => Inner::Memoryless(Memoryless::new(blob, settings)),
            Kind::Recursive => Inner::Recursive(Recursive::new(blob, settings)),
        };
        Ok(Self {
            settings,
            clock: Clock::default(),
            latest: None,
            inner,
        })
    }

    /// The settings given to [`Tracker::new`].
    pub fn settings(&self) -> Settings {
        self.settings
    }

    /// Forgets the target and all times, and starts the random stream again.
    pub fn reset(&mut self) {
        self.clock = Clock::default();
        self.latest = None;
        match &mut self.inner {
            Inner::Memoryless(tracker) => tracker.reset(),
            Inner::Recursive(tracker) => tracker.reset(),
        }
    }

    /// The estimate at the time of `measurement`.
    ///
    /// # Errors
    /// [`StepError`]; the measurement is then ignored.
    pub fn step(&mut self, measurement: &Measurement) -> Result<Estimate, StepError> {
        measurement.check().map_err(StepError::Measurement)?;
        let measurement = measurement.canonical();
        if self.latest == Some(measurement) {
            return Err(StepError::Repeated);
        }
        let time_us = measurement.time_us;
        let tick = self.clock.measured(time_us);
        let tick = tick.map_err(|error| self.refusal(error, time_us))?;
        let anew = tick == Tick::Anew;
        let estimate = match &mut self.inner {
            Inner::Memoryless(tracker) => tracker.step(&measurement, anew),
            Inner::Recursive(tracker) => tracker.step(&measurement, anew),
        }?;
        self.clock.advance(time_us);
        self.latest = Some(measurement);
        Ok(estimate)
    }

    /// The estimate at `time_us` without a measurement, with a covariance that grows: by the motion
    /// model of a recursive blob, and for a memoryless one by the rule in the module `coast`.
    ///
    /// One call reaches at most [`AHEAD_MAX_US`](crate::clock::AHEAD_MAX_US) ahead, and asks the
    /// network at most 41 times.
    ///
    /// # Errors
    /// [`StepError::NotStarted`], [`StepError::TimeWentBack`], [`StepError::TimeTooFarAhead`],
    /// [`StepError::NetworkNotFinite`] or [`StepError::Lost`].
    pub fn coast(&mut self, time_us: u64) -> Result<Estimate, StepError> {
        self.clock
            .check(time_us)
            .map_err(|error| self.refusal(error, time_us))?;
        let estimate = match &mut self.inner {
            Inner::Memoryless(tracker) => tracker.coast(time_us),
            Inner::Recursive(tracker) => tracker.coast(time_us),
        }?;
        self.clock.advance(time_us);
        Ok(estimate)
    }

    fn refusal(&self, error: ClockError, given_us: u64) -> StepError {
        let latest_us = self.clock.latest_us().unwrap_or_default();
        match error {
            ClockError::WentBack => StepError::TimeWentBack {
                latest_us,
                given_us,
            },
            ClockError::TooFarAhead => StepError::TimeTooFarAhead {
                latest_us,
                given_us,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::draft::Draft;
    use crate::estimate::Mode;
    use crate::measurement::Sensed;

    fn measurement(time_us: u64) -> Measurement {
        let sensed = |value, sigma| Some(Sensed { value, sigma });
        Measurement {
            time_us,
            range: sensed(33.0, 0.5),
            elevation: sensed(0.4, 0.01),
            azimuth: sensed(0.5, 0.01),
            range_rate: sensed(0.0, 0.1),
        }
    }

    /// Of both kinds: repeats are refused, a reset forgets them, and two strange times in a row
    /// start anew.
    #[test]
    fn times_repeats_and_resets() {
        for draft in [Draft::memoryless(&[12, 3], 3), Draft::recursive(3)] {
            let bytes = draft.bytes();
            let blob = Blob::parse(&bytes).expect("a blob");
            let settings = Settings::of(&blob);
            let mut tracker = Tracker::new(blob, settings).expect("its own settings");
            assert_eq!(tracker.settings(), settings);
            let mode = |estimate: Result<Estimate, StepError>| estimate.map(|e| e.mode);
            let mut step = |time_us| mode(tracker.step(&measurement(time_us)));
            assert_eq!(step(1_000_000), Ok(Mode::Started));
            assert_eq!(step(1_000_000), Err(StepError::Repeated));
            assert_eq!(step(1_100_000), Ok(Mode::Tracking));
            let far = 3_600_000_000;
            let refusal = StepError::TimeTooFarAhead {
                latest_us: 1_100_000,
                given_us: far,
            };
            assert_eq!(step(far), Err(refusal));
            assert_eq!(step(far + 100_000), Ok(Mode::Started));
            assert_eq!(mode(tracker.coast(far + 200_000)), Ok(Mode::Coasting));
            let refusal = StepError::TimeWentBack {
                latest_us: far + 200_000,
                given_us: far,
            };
            assert_eq!(mode(tracker.coast(far)), Err(refusal));
            tracker.reset();
            assert_eq!(mode(tracker.coast(far)), Err(StepError::NotStarted));
            let again = tracker.step(&measurement(far + 100_000));
            assert_eq!(mode(again), Ok(Mode::Started));
        }
    }
}
