//! One target's track: all that is known of it, and nothing else.

mod bytes;
mod bytes_error;
mod check;

pub use bytes::TRACK_SNAPSHOT_BYTES;
pub use bytes_error::{TrackBytesError, TrackField};

use crate::blob::Kind;
use crate::clock::{Clock, ClockError, Tick};
use crate::estimate::{Estimate, Outcome};
use crate::inference::Inference;
use crate::likelihood::Likelihood;
use crate::measurement::Measurement;
use crate::memoryless::{self, Memoryless, Past};
use crate::model::{Inner, Model};
use crate::part::Part;
use crate::recursive::{Belief, Recursive};
use crate::rng::{Generator, seeded};
use crate::settings::{Correction, Settings, TrackerError};
use crate::step_error::StepError;
use crate::workspace::Workspace;

/// One target's state, without a reference: the [`Model`] it runs on and the [`Workspace`] it works in
/// are given to every call, and any number of tracks share them. A clone is a snapshot.
///
/// Every estimate is finite, its covariances are positive definite, and its mode is what happened;
/// `docs/limits.md` lists what is refused and bounded, and why.
///
/// ```
/// use bnkf::{Model, OtherKind, Settings, TRACK_SNAPSHOT_BYTES, Track, TrackBytesError, TrackField};
/// # static BLOB: &[u8] = include_bytes!("../models/recursive.bnkf");
///
/// let model = Model::new(BLOB)?;
/// let track = Track::new(&model, Settings::of(model.blob()))?;
/// let mut bytes = [0; TRACK_SNAPSHOT_BYTES];
/// track.to_bytes(&mut bytes);
/// let mut read = Track::from_bytes(&bytes)?;
/// match read.hand_over(&model) {
///     Ok(()) => assert_eq!(read.latest_us(), None),
///     Err(OtherKind { track, model }) => panic!("{track:?} is not {model:?}"),
/// }
/// bytes[100] ^= 1;
/// match Track::from_bytes(&bytes) {
///     Err(TrackBytesError::WrongChecksum) => println!("bytes were lost"),
///     Err(TrackBytesError::Invalid(TrackField::Clock)) => println!("it comes from the future"),
///     other => panic!("{other:?}"),
/// }
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Track {
    /// Checksum of the model it runs on.
    pub(crate) model: u32,
    pub(crate) settings: Settings,
    pub(crate) clock: Clock,
    pub(crate) latest: Option<Measurement>,
    pub(crate) rng: Generator,
    pub(crate) state: State,
}

// Of a size that a track of either kind fits.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug)]
pub(crate) enum State {
    Memoryless(Past),
    Recursive(Belief),
}

/// Memory of a [`Track`], part of the contract.
pub const TRACK_BYTES_MAX: usize = 1_424;
const _: () = assert!(size_of::<Track>() <= TRACK_BYTES_MAX);

/// A track that was to run on a model of another kind than its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OtherKind {
    /// The track's.
    pub track: Kind,
    /// The model's.
    pub model: Kind,
}

impl core::fmt::Display for OtherKind {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { track, model } = self;
        write!(f, "a {track:?} track does not run on a {model:?} model")
    }
}

impl core::error::Error for OtherKind {}

/// A model and the part of a track that runs on it.
enum Run<'r, 'a> {
    Memoryless(Memoryless<'r, 'a>),
    Recursive(Recursive<'r, 'a>),
}

impl Track {
    /// A track that has seen nothing yet.
    ///
    /// # Errors
    /// [`TrackerError`] names the setting.
    pub fn new(model: &Model<'_>, settings: Settings) -> Result<Self, TrackerError> {
        let mut track = Self::idle();
        track.begin(model, settings)?;
        Ok(track)
    }

    /// Room for a track, which runs on no model before [`Track::begin`]. Made before anything runs, it
    /// can be a `static`.
    pub const fn idle() -> Self {
        Self {
            model: 0,
            settings: Settings {
                correction: Correction::Polar,
                inference: Inference::Mean,
                seed: 0,
            },
            clock: Clock::NEW,
            latest: None,
            rng: seeded(0),
            state: State::Recursive(Belief::NONE),
        }
    }

    /// Makes it a track that has seen nothing yet, as [`Track::new`] does, where it is.
    ///
    /// # Errors
    /// [`TrackerError`] names the setting; the track is then as before.
    pub fn begin(&mut self, model: &Model<'_>, settings: Settings) -> Result<(), TrackerError> {
        settings.check(model.blob())?;
        self.model = model.checksum();
        self.settings = settings;
        if self.kind() != model.kind() {
            self.state = match model.kind() {
                Kind::Memoryless => State::Memoryless(Past::NONE),
                Kind::Recursive => State::Recursive(Belief::NONE),
            };
        }
        self.reset();
        Ok(())
    }

    /// Lets another model of its kind go on with it. What the network noted for itself is forgotten, and how
    /// its forecasts came true: of one model both say nothing to another.
    ///
    /// # Errors
    /// [`OtherKind`]; the track is then as before.
    pub fn hand_over(&mut self, model: &Model<'_>) -> Result<(), OtherKind> {
        self.fits(model)?;
        if self.model != model.checksum()
            && let State::Recursive(belief) = &mut self.state
        {
            belief.forget_model();
        }
        self.model = model.checksum();
        Ok(())
    }

    /// Whether a model is of its kind.
    ///
    /// # Errors
    /// [`OtherKind`]
    pub fn fits(&self, model: &Model<'_>) -> Result<(), OtherKind> {
        let (track, model) = (self.kind(), model.kind());
        if track == model {
            Ok(())
        } else {
            Err(OtherKind { track, model })
        }
    }

    /// The kind of model that it runs on.
    pub fn kind(&self) -> Kind {
        match &self.state {
            State::Memoryless(_) => Kind::Memoryless,
            State::Recursive(_) => Kind::Recursive,
        }
    }

    /// The settings that it began with.
    pub fn settings(&self) -> Settings {
        self.settings
    }

    /// Time of the latest measurement or coast, microseconds.
    pub fn latest_us(&self) -> Option<u64> {
        self.clock.latest_us()
    }

    /// Forgets the target and all times, and starts the random stream again.
    pub fn reset(&mut self) {
        self.clock = Clock::NEW;
        self.latest = None;
        self.rng = seeded(self.settings.seed);
        match &mut self.state {
            State::Memoryless(past) => *past = Past::NONE,
            State::Recursive(belief) => belief.forget(),
        }
    }

    /// The estimate at the time of `measurement`.
    ///
    /// # Errors
    /// [`StepError`]; the measurement is then ignored.
    #[inline(never)]
    pub fn step(
        &mut self,
        model: &Model<'_>,
        workspace: &mut Workspace,
        measurement: &Measurement,
    ) -> Result<Estimate, StepError> {
        measurement.check().map_err(StepError::Measurement)?;
        let measurement = measurement.canonical();
        if self.latest == Some(measurement) {
            return Err(StepError::Repeated);
        }
        self.belongs_to(model)?;
        let time_us = measurement.time_us;
        let tick = self.clock.measured(time_us);
        let tick = tick.map_err(|error| self.refusal(error, time_us))?;
        let anew = tick == Tick::Anew;
        // Only then the estimate: it is large, and would weigh on the stack of all this.
        let rng = self.rng.clone();
        let outcome = match self.on(model, workspace)? {
            Run::Memoryless(mut run) => run.step(&measurement, anew),
            Run::Recursive(mut run) => run.step(&measurement, anew),
        };
        let outcome = outcome.inspect_err(|_| self.rng = rng)?;
        self.clock.advance(time_us);
        self.latest = Some(measurement);
        self.estimate(model, outcome)
    }

    /// The estimate at `time_us` without a measurement, with a covariance that grows: by the motion
    /// model of a recursive blob, and for a memoryless one by the rule in the module `coast`.
    ///
    /// One call reaches at most [`AHEAD_MAX_US`](crate::clock::AHEAD_MAX_US) ahead, and asks the
    /// network at most 41 times.
    ///
    /// # Errors
    /// [`StepError::NotStarted`], [`StepError::TimeWentBack`], [`StepError::TimeTooFarAhead`],
    /// [`StepError::NetworkNotFinite`] or [`StepError::OtherModel`]; or [`StepError::Lost`], and then the target is
    /// forgotten.
    #[inline(never)]
    pub fn coast(
        &mut self,
        model: &Model<'_>,
        workspace: &mut Workspace,
        time_us: u64,
    ) -> Result<Estimate, StepError> {
        self.reaches(time_us)?;
        let rng = self.rng.clone();
        let outcome = match self.on(model, workspace)? {
            Run::Memoryless(mut run) => {
                let estimate = run.coast(time_us)?;
                self.clock.advance(time_us);
                return Ok(estimate);
            }
            Run::Recursive(mut run) => run.coast(time_us),
        };
        let outcome = outcome.inspect_err(|_| self.rng = rng)?;
        self.clock.advance(time_us);
        self.estimate(model, outcome)
    }

    /// What a step left as an estimate.
    // Written where it will be: inlined, it would be made on the stack and moved there.
    #[inline(never)]
    fn estimate(&self, model: &Model<'_>, outcome: Outcome) -> Result<Estimate, StepError> {
        match (&model.inner, &self.state) {
            (Inner::Memoryless(_), State::Memoryless(past)) => {
                let latest = past.latest.as_ref().ok_or(StepError::NotStarted)?;
                Ok(memoryless::estimate(latest, outcome))
            }
            (Inner::Recursive(model), State::Recursive(belief)) => {
                let target = belief.target.as_ref().ok_or(StepError::NotStarted)?;
                Ok(model.estimate(target, outcome))
            }
            _ => Err(StepError::OtherModel),
        }
    }

    /// Where the target will be at each of `times_us`, which lie in order, none of them before the
    /// latest step or coast. All have [`Mode::Coasting`](crate::Mode::Coasting).
    ///
    /// The track stays as it is: time, state, random stream. Later estimates are the same to the bit;
    /// `&mut` is for the random stream, which is put back. A recursive blob's network is asked once for all
    /// times, and its answer goes on in parts that double, so that half a second, one and two cost
    /// three predictions; what [`Track::coast`] gives is a little better and many times dearer. A
    /// memoryless blob forecasts by its rule for gaps, which is what `coast` says.
    ///
    /// No time may lie further than [`AHEAD_MAX_US`](crate::clock::AHEAD_MAX_US) ahead.
    ///
    /// # Errors
    /// [`StepError::NotStarted`]; [`StepError::TimeWentBack`], also for times out of order;
    /// [`StepError::TimeTooFarAhead`], [`StepError::NetworkNotFinite`], [`StepError::OtherModel`];
    /// [`StepError::Lost`] where nothing could be said of the last of the times any more, though the
    /// track goes on.
    pub fn forecasts<const N: usize>(
        &mut self,
        model: &Model<'_>,
        workspace: &mut Workspace,
        times_us: &[u64; N],
    ) -> Result<[Estimate; N], StepError> {
        let mut forecasts = [Estimate::NONE; N];
        self.forecast_each(model, workspace, times_us, |place, estimate| {
            if let Some(forecast) = forecasts.get_mut(place) {
                *forecast = *estimate;
            }
        })?;
        Ok(forecasts)
    }

    /// [`Track::forecasts`], given to `each` one by one with its place among the times: only one
    /// estimate, which is large, lies in memory at a time.
    ///
    /// # Errors
    /// As there; some may have been given before.
    pub fn forecast_each(
        &mut self,
        model: &Model<'_>,
        workspace: &mut Workspace,
        times_us: &[u64],
        mut each: impl FnMut(usize, &Estimate),
    ) -> Result<(), StepError> {
        let mut before_us = self.clock.latest_us().ok_or(StepError::NotStarted)?;
        for &time_us in times_us {
            if time_us < before_us {
                return Err(StepError::TimeWentBack {
                    latest_us: before_us,
                    given_us: time_us,
                });
            }
            self.reaches(time_us)?;
            before_us = time_us;
        }
        match self.on(model, workspace)? {
            Run::Memoryless(run) => run.forecast_each(times_us, &mut each),
            Run::Recursive(mut run) => run.forecast_each(times_us, &mut each),
        }
    }

    /// How well `measurement` fits the track, for whoever has several plots or several tracks and
    /// must say which belong together. The track stays as it is, as in [`Track::forecasts`].
    ///
    /// # Errors
    /// [`StepError::Measurement`], [`StepError::NotStarted`], [`StepError::TimeWentBack`],
    /// [`StepError::TimeTooFarAhead`], [`StepError::NetworkNotFinite`], [`StepError::Lost`],
    /// [`StepError::OtherModel`]; [`StepError::Correction`] where single precision has no finite number
    /// for it: it fits not at all.
    #[inline(never)]
    pub fn likelihood(
        &mut self,
        model: &Model<'_>,
        workspace: &mut Workspace,
        measurement: &Measurement,
    ) -> Result<Likelihood, StepError> {
        measurement.check().map_err(StepError::Measurement)?;
        let measurement = measurement.canonical();
        self.reaches(measurement.time_us)?;
        match self.on(model, workspace)? {
            Run::Memoryless(run) => run.likelihood(&measurement),
            Run::Recursive(mut run) => run.likelihood(&measurement),
        }
    }

    /// Everything that a call works with.
    fn on<'r, 'a>(
        &'r mut self,
        model: &'r Model<'a>,
        workspace: &'r mut Workspace,
    ) -> Result<Run<'r, 'a>, StepError> {
        self.belongs_to(model)?;
        let (settings, rng) = (&self.settings, &mut self.rng);
        match (&model.inner, &mut self.state) {
            // No settings were accepted for what is left out, so that none of it is called.
            (Inner::Memoryless(_), _) if !Part::Memoryless.is_built() => Err(StepError::OtherModel),
            (Inner::Memoryless(model), State::Memoryless(past)) => {
                Ok(Run::Memoryless(Memoryless {
                    model,
                    settings,
                    rng,
                    past,
                    workspace,
                }))
            }
            (Inner::Recursive(model), State::Recursive(belief)) => Ok(Run::Recursive(Recursive {
                model,
                settings,
                rng,
                belief,
                workspace,
            })),
            _ => Err(StepError::OtherModel),
        }
    }

    fn belongs_to(&self, model: &Model<'_>) -> Result<(), StepError> {
        if self.model == model.checksum() {
            Ok(())
        } else {
            Err(StepError::OtherModel)
        }
    }

    /// Whether the track can be asked about a time.
    fn reaches(&self, time_us: u64) -> Result<(), StepError> {
        self.clock
            .check(time_us)
            .map_err(|error| self.refusal(error, time_us))
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
mod tests;
