//! One target's tracker, memoryless or recursive as its blob says.

use crate::estimate::Estimate;
use crate::likelihood::Likelihood;
use crate::measurement::Measurement;
use crate::model::{MODEL_BYTES_MAX, Model};
use crate::settings::{Settings, TrackerError};
use crate::step_error::StepError;
use crate::track::{OtherKind, TRACK_BYTES_MAX, Track};
use crate::workspace::{WORKSPACE_BYTES_MAX, Workspace};

/// Estimates the position of one target from its radar measurements: a [`Model`], a [`Workspace`] and
/// a [`Track`] in one. For several targets have one of each and a track for every target.
#[derive(Debug)]
pub struct Tracker<'a> {
    model: Model<'a>,
    workspace: Workspace,
    track: Track,
}

/// Static memory of the tracker is part of its contract: what a caller must set aside.
pub const TRACKER_BYTES_MAX: usize = WORKSPACE_BYTES_MAX + TRACK_BYTES_MAX + MODEL_BYTES_MAX;
const _: () = assert!(size_of::<Tracker<'static>>() <= TRACKER_BYTES_MAX);

impl<'a> Tracker<'a> {
    /// A tracker that has seen nothing yet, of a [`Model`] or a [`Blob`](crate::blob::Blob).
    ///
    /// # Errors
    /// [`TrackerError`] names the setting.
    pub fn new(model: impl Into<Model<'a>>, settings: Settings) -> Result<Self, TrackerError> {
        let model = model.into();
        Ok(Self {
            track: Track::new(&model, settings)?,
            workspace: Workspace::new(),
            model,
        })
    }

    /// The settings given to [`Tracker::new`].
    pub fn settings(&self) -> Settings {
        self.track.settings()
    }

    /// Time of the latest measurement or coast, microseconds.
    pub fn latest_us(&self) -> Option<u64> {
        self.track.latest_us()
    }

    /// The track, to be cloned or written down.
    pub fn track(&self) -> &Track {
        &self.track
    }

    /// Goes on with another track, which may be one of another model of its kind
    /// ([`Track::hand_over`]).
    ///
    /// # Errors
    /// [`OtherKind`]; the tracker is then as before.
    pub fn resume(&mut self, track: &Track) -> Result<(), OtherKind> {
        track.fits(&self.model)?;
        self.track.clone_from(track);
        self.track.hand_over(&self.model)
    }

    /// Goes back to a clone of its own track.
    pub(crate) fn rewind(&mut self, track: &Track) {
        self.track.clone_from(track);
    }

    /// Forgets the target and all times, and starts the random stream again.
    pub fn reset(&mut self) {
        self.track.reset();
    }

    /// The estimate at the time of `measurement`: [`Track::step`].
    ///
    /// # Errors
    /// [`StepError`]; the measurement is then ignored.
    pub fn step(&mut self, measurement: &Measurement) -> Result<Estimate, StepError> {
        self.track
            .step(&self.model, &mut self.workspace, measurement)
    }

    /// The estimate at `time_us` without a measurement: [`Track::coast`].
    ///
    /// # Errors
    /// As there.
    pub fn coast(&mut self, time_us: u64) -> Result<Estimate, StepError> {
        self.track.coast(&self.model, &mut self.workspace, time_us)
    }

    /// Where the target will be at `time_us`: [`Tracker::forecasts`] for one time.
    ///
    /// # Errors
    /// As [`Track::forecasts`].
    pub fn forecast(&mut self, time_us: u64) -> Result<Estimate, StepError> {
        let [forecast] = self.forecasts(&[time_us])?;
        Ok(forecast)
    }

    /// Where the target will be at each of `times_us`: [`Track::forecasts`].
    ///
    /// # Errors
    /// As there.
    pub fn forecasts<const N: usize>(
        &mut self,
        times_us: &[u64; N],
    ) -> Result<[Estimate; N], StepError> {
        self.track
            .forecasts(&self.model, &mut self.workspace, times_us)
    }

    /// How well `measurement` fits the track: [`Track::likelihood`].
    ///
    /// # Errors
    /// As there.
    pub fn likelihood(&mut self, measurement: &Measurement) -> Result<Likelihood, StepError> {
        self.track
            .likelihood(&self.model, &mut self.workspace, measurement)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::draft::Draft;
    use crate::blob::{Blob, Kind};
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

    /// A track goes on in another tracker of its kind, with the same model to the bit.
    #[test]
    fn a_tracker_resumes_what_another_began() {
        let blobs = [Draft::recursive(3), Draft::memoryless(&[12, 3], 3)].map(|d| d.bytes());
        let [recursive, memoryless] = [0, 1].map(|i: usize| {
            let blob = Blob::parse(&blobs[i]).expect("a blob");
            Tracker::new(blob, Settings::of(&blob)).expect("its own settings")
        });
        let (mut first, mut other) = (recursive, memoryless);
        for tenth in 0..5 {
            first.step(&measurement(100_000 * tenth)).expect("a step");
        }
        let refusal = other.resume(first.track()).expect_err("another kind");
        assert_eq!(
            (refusal.track, refusal.model),
            (Kind::Recursive, Kind::Memoryless)
        );
        assert_eq!(other.latest_us(), None);
        let blob = Blob::parse(&blobs[0]).expect("a blob");
        let mut second = Tracker::new(blob, Settings::of(&blob)).expect("its own settings");
        second.resume(first.track()).expect("its kind");
        assert_eq!(second.coast(500_000), first.coast(500_000));
    }
}
