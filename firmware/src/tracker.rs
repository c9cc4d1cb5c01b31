//! One target's tracker, memoryless or recursive as its blob says.
//!
//! The only owner of filter state: everything lives inside [`Tracker`], whose size is fixed.

use crate::blob::{Blob, Kind};
use crate::clock::{Clock, ClockError, Tick};
use crate::estimate::Estimate;
use crate::likelihood::Likelihood;
use crate::measurement::Measurement;
use crate::memoryless::{self, Memoryless};
use crate::recursive::{self, Recursive};
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

/// What a [`Tracker`] knows at one time, apart from its model and its settings.
#[derive(Clone)]
pub(crate) struct Snapshot {
    clock: Clock,
    latest: Option<Measurement>,
    inner: InnerSnapshot,
}

// As of `Inner`.
#[allow(clippy::large_enum_variant)]
#[derive(Clone)]
enum InnerSnapshot {
    Memoryless(memoryless::Snapshot),
    Recursive(recursive::Snapshot),
}

impl Snapshot {
    /// The tracker's latest time, microseconds.
    pub fn latest_us(&self) -> Option<u64> {
        self.clock.latest_us()
    }
}

/// Static memory of the tracker is part of its contract: what a caller must set aside.
pub const TRACKER_BYTES_MAX: usize = 6_144;
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

    /// Time of the latest measurement or coast, microseconds.
    pub fn latest_us(&self) -> Option<u64> {
        self.clock.latest_us()
    }

    /// A copy of what it knows, for [`Tracker::restore`].
    pub(crate) fn snapshot(&self) -> Snapshot {
        Snapshot {
            clock: self.clock,
            latest: self.latest,
            inner: match &self.inner {
                Inner::Memoryless(tracker) => InnerSnapshot::Memoryless(tracker.snapshot()),
                Inner::Recursive(tracker) => InnerSnapshot::Recursive(tracker.snapshot()),
            },
        }
    }

    /// Goes back to what it knew when `snapshot` was taken of it, or of another tracker of its kind.
    pub(crate) fn restore(&mut self, snapshot: &Snapshot) {
        self.clock = snapshot.clock;
        self.latest = snapshot.latest;
        match (&mut self.inner, &snapshot.inner) {
            (Inner::Memoryless(tracker), InnerSnapshot::Memoryless(snapshot)) => {
                tracker.restore(snapshot);
            }
            (Inner::Recursive(tracker), InnerSnapshot::Recursive(snapshot)) => {
                tracker.restore(snapshot);
            }
            // Of the other kind: there is nothing of it to know.
            _ => self.reset(),
        }
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

    /// Where the target will be at `time_us`: [`Tracker::forecasts`] for one time.
    ///
    /// # Errors
    /// As [`Tracker::forecasts`].
    pub fn forecast(&mut self, time_us: u64) -> Result<Estimate, StepError> {
        let [forecast] = self.forecasts(&[time_us])?;
        Ok(forecast)
    }

    /// Where the target will be at each of `times_us`, which lie in order, none of them before the
    /// latest step or coast. All have [`Mode::Coasting`](crate::Mode::Coasting).
    ///
    /// The track stays as it is: time, state, random stream. Later estimates are the same to the bit;
    /// `&mut` is for the network's scratch alone. A recursive blob's network is asked once for all
    /// times, and its answer goes on in parts that double, so that half a second, one and two cost
    /// three predictions; what [`Tracker::coast`] gives is a little better and many times dearer. A
    /// memoryless blob forecasts by its rule for gaps, which is what `coast` says.
    ///
    /// No time may lie further than [`AHEAD_MAX_US`](crate::clock::AHEAD_MAX_US) ahead.
    ///
    /// # Errors
    /// [`StepError::NotStarted`]; [`StepError::TimeWentBack`], also for times out of order;
    /// [`StepError::TimeTooFarAhead`], [`StepError::NetworkNotFinite`]; [`StepError::Lost`] where
    /// nothing could be said of the last of the times any more, though the track goes on.
    pub fn forecasts<const N: usize>(
        &mut self,
        times_us: &[u64; N],
    ) -> Result<[Estimate; N], StepError> {
        let mut before_us = self.clock.latest_us().ok_or(StepError::NotStarted)?;
        for &time_us in times_us {
            if time_us < before_us {
                return Err(StepError::TimeWentBack {
                    latest_us: before_us,
                    given_us: time_us,
                });
            }
            self.clock
                .check(time_us)
                .map_err(|error| self.refusal(error, time_us))?;
            before_us = time_us;
        }
        match &mut self.inner {
            Inner::Memoryless(tracker) => tracker.forecasts(times_us),
            Inner::Recursive(tracker) => tracker.forecasts(times_us),
        }
    }

    /// How well `measurement` fits the track, for whoever has several plots or several tracks and
    /// must say which belong together. The track stays as it is, as in [`Tracker::forecasts`].
    ///
    /// # Errors
    /// [`StepError::Measurement`], [`StepError::NotStarted`], [`StepError::TimeWentBack`],
    /// [`StepError::TimeTooFarAhead`], [`StepError::NetworkNotFinite`], [`StepError::Lost`];
    /// [`StepError::Correction`] where single precision has no finite number for it: it fits not at all.
    pub fn likelihood(&mut self, measurement: &Measurement) -> Result<Likelihood, StepError> {
        measurement.check().map_err(StepError::Measurement)?;
        let measurement = measurement.canonical();
        let time_us = measurement.time_us;
        self.clock
            .check(time_us)
            .map_err(|error| self.refusal(error, time_us))?;
        match &mut self.inner {
            Inner::Memoryless(tracker) => tracker.likelihood(&measurement),
            Inner::Recursive(tracker) => tracker.likelihood(&measurement),
        }
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
            sensor: crate::sensor::Sensor::ORIGIN,
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
