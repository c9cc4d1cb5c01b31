//! One target's tracker, memoryless or recursive as its blob says.
//!
//! The only owner of filter state: everything lives inside [`Tracker`], whose size is fixed.

use crate::blob::{Blob, Kind, field};
use crate::ekf::EkfError;
use crate::estimate::Estimate;
use crate::measurement::{Measurement, MeasurementError};
use crate::memoryless::Memoryless;
use crate::recursive::Recursive;

/// What the network's estimate is corrected with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Correction {
    /// Nothing: the network alone (BNN).
    None,
    /// The measured position, converted to Cartesian (BNKF, BNKFe; paper Eq. 12-13).
    Converted,
    /// The measured range, elevation and azimuth themselves, and range-rate where the state has a
    /// velocity. The only one for a recursive blob.
    Polar,
}

/// Choices of a [`Tracker`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Correction step.
    pub correction: Correction,
    /// Monte Carlo passes per estimate and network, 1 to [`field::PASSES_MAX`]. For a recursive
    /// blob one pass means every weight at its mean.
    pub passes: u16,
    /// Seed of the passes' generator.
    pub seed: u64,
}

impl Settings {
    /// The blob's own number of passes, the correction of its kind (the paper's for a memoryless
    /// one), seed 1.
    pub fn of(blob: &Blob<'_>) -> Self {
        let correction = match blob.kind() {
            Kind::Memoryless => Correction::Converted,
            Kind::Recursive => Correction::Polar,
        };
        Self {
            correction,
            passes: blob.passes(),
            seed: 1,
        }
    }
}

/// Why a [`Tracker`] cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrackerError {
    /// The number of passes is zero or above [`field::PASSES_MAX`].
    Passes(u16),
    /// A recursive blob takes [`Correction::Polar`] only.
    Correction(Correction),
}

/// Why a step was refused; the tracker's state is as before, apart from its random stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepError {
    /// The measurement cannot be used.
    Measurement(MeasurementError),
    /// The time lies before that of an earlier step.
    TimeWentBack {
        /// Time of the latest step, microseconds.
        latest_us: u64,
        /// Time given, microseconds.
        given_us: u64,
    },
    /// There is nothing to coast from yet.
    NotStarted,
    /// The network's output is NaN or infinite.
    NetworkNotFinite,
    /// The correction was refused.
    Correction(EkfError),
}

impl core::fmt::Display for TrackerError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Passes(passes) => {
                write!(f, "passes: {passes} is not in 1..={}", field::PASSES_MAX)
            }
            Self::Correction(correction) => {
                write!(
                    f,
                    "correction: {correction:?} does not fit a recursive blob"
                )
            }
        }
    }
}

impl core::error::Error for TrackerError {}

impl core::fmt::Display for StepError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Measurement(error) => write!(f, "measurement: {error}"),
            Self::TimeWentBack {
                latest_us,
                given_us,
            } => {
                write!(f, "time_us went back from {latest_us} to {given_us}")
            }
            Self::NotStarted => f.write_str("no measurement yet"),
            Self::NetworkNotFinite => f.write_str("the network's output is not finite"),
            Self::Correction(error) => write!(f, "correction: {error}"),
        }
    }
}

impl core::error::Error for StepError {}

/// Refuses a time before that of the latest step.
pub(crate) fn check_time(latest_us: Option<u64>, given_us: u64) -> Result<(), StepError> {
    match latest_us {
        Some(latest_us) if given_us < latest_us => Err(StepError::TimeWentBack {
            latest_us,
            given_us,
        }),
        _ => Ok(()),
    }
}

/// Estimates the position of one target from its radar measurements.
///
/// A memoryless blob holds one network for all axes (BNKF) or one per axis (BNKFe) that answer
/// with a position; a recursive blob holds one that schedules the motion model of a filter.
pub struct Tracker<'a> {
    settings: Settings,
    inner: Inner<'a>,
}

// One tracker is made once and lives in static memory: the larger size is what counts.
#[allow(clippy::large_enum_variant)]
enum Inner<'a> {
    Memoryless(Memoryless<'a>),
    Recursive(Recursive<'a>),
}

/// Static memory of the tracker is part of its contract: what a caller must set aside.
pub const TRACKER_BYTES_MAX: usize = 4_096;
const _: () = assert!(size_of::<Tracker<'static>>() <= TRACKER_BYTES_MAX);

impl<'a> Tracker<'a> {
    /// A tracker that has seen nothing yet.
    ///
    /// # Errors
    /// [`TrackerError`] names the setting.
    pub fn new(blob: Blob<'a>, settings: Settings) -> Result<Self, TrackerError> {
        if !(1..=field::PASSES_MAX).contains(&settings.passes) {
            return Err(TrackerError::Passes(settings.passes));
        }
        let inner = match blob.kind() {
            Kind::Memoryless => Inner::Memoryless(Memoryless::new(blob, settings)),
            Kind::Recursive if settings.correction != Correction::Polar => {
                return Err(TrackerError::Correction(settings.correction));
            }
            Kind::Recursive => Inner::Recursive(Recursive::new(blob, settings)),
        };
        Ok(Self { settings, inner })
    }

    /// The settings given to [`Tracker::new`].
    pub fn settings(&self) -> Settings {
        self.settings
    }

    /// Forgets the target and starts the random stream again.
    pub fn reset(&mut self) {
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
        match &mut self.inner {
            Inner::Memoryless(tracker) => tracker.step(measurement),
            Inner::Recursive(tracker) => tracker.step(measurement),
        }
    }

    /// The estimate at `time_us` without a measurement, with a covariance that grows: by the motion
    /// model of a recursive blob, and for a memoryless one by the rule in the module `coast`.
    ///
    /// # Errors
    /// [`StepError::NotStarted`], [`StepError::TimeWentBack`] or [`StepError::NetworkNotFinite`].
    pub fn coast(&mut self, time_us: u64) -> Result<Estimate, StepError> {
        match &mut self.inner {
            Inner::Memoryless(tracker) => tracker.coast(time_us),
            Inner::Recursive(tracker) => tracker.coast(time_us),
        }
    }
}
