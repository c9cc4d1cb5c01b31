//! Why a step was refused.

use crate::clock::AHEAD_MAX_US;
use crate::ekf::EkfError;
use crate::measurement::{Channel, MeasurementError};

/// Why a step was refused; the tracker is as before, apart from what it remembers of strange times (see
/// [`Clock`](crate::clock::Clock)) and from a coast that ends in [`StepError::Lost`].
///
/// ```
/// use bnkf::{Channel, EkfError, MeasurementError, SensorError, StepError};
///
/// fn advice(error: StepError) -> &'static str {
///     match error {
///         StepError::Measurement(MeasurementError::Sigma(Channel::Azimuth)) => "no such azimuth sigma",
///         StepError::Measurement(MeasurementError::Sensor(SensorError::TooFar)) => "choose another origin",
///         StepError::Missing(_) => "this radar does not measure what the model needs",
///         StepError::Repeated | StepError::TimeWentBack { .. } => "look at the radar's clock",
///         StepError::Lost | StepError::NotStarted => "wait for the next measurement",
///         StepError::Correction(EkfError::NotFinite) => "it fits not at all",
///         _ => "log it",
///     }
/// }
/// assert_eq!(advice(StepError::Repeated), "look at the radar's clock");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum StepError {
    /// The measurement cannot be used.
    Measurement(MeasurementError),
    /// The channel is missing, and this step cannot do without: a memoryless blob reads all four,
    /// and a recursive track starts from an azimuth.
    Missing(Channel),
    /// A memoryless blob knows a radar at rest in the origin only; see [`Sensor`](crate::Sensor).
    Sensor,
    /// The same measurement, time, content and sensor, as the latest one.
    Repeated,
    /// The time lies before that of an earlier step.
    TimeWentBack {
        /// Time of the latest step, microseconds.
        latest_us: u64,
        /// Time given, microseconds.
        given_us: u64,
    },
    /// The time lies more than [`AHEAD_MAX_US`] after that of the latest step. A second measurement
    /// in a row from there, or a reset, starts a new track.
    TimeTooFarAhead {
        /// Time of the latest step, microseconds.
        latest_us: u64,
        /// Time given, microseconds.
        given_us: u64,
    },
    /// A track would have to start from this measurement, and it says nothing: a position unsure by more
    /// than [`POSITION_SIGMA_MAX_M`](crate::estimate::POSITION_SIGMA_MAX_M).
    Blunt,
    /// There is nothing to coast from yet.
    NotStarted,
    /// The track began on another model, and was not handed over to this one
    /// ([`Track::hand_over`](crate::Track::hand_over)).
    OtherModel,
    /// The network's output is NaN or infinite.
    NetworkNotFinite,
    /// The correction was refused.
    Correction(EkfError),
    /// What is left of the track says nothing any more (its deviation has passed
    /// [`POSITION_SIGMA_MAX_M`](crate::estimate::POSITION_SIGMA_MAX_M)). Coasting there, it was given up: the next
    /// measurement starts a new one. A forecast that reaches there leaves it as it is.
    Lost,
}

impl core::fmt::Display for StepError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Measurement(error) => write!(f, "measurement: {error}"),
            Self::Missing(channel) => write!(f, "{channel} is missing and needed"),
            Self::Sensor => {
                f.write_str("a memoryless model knows a sensor at rest in the origin only")
            }
            Self::Repeated => f.write_str("the same measurement as the latest one"),
            Self::TimeWentBack {
                latest_us,
                given_us,
            } => {
                write!(f, "time_us went back from {latest_us} to {given_us}")
            }
            Self::TimeTooFarAhead {
                latest_us,
                given_us,
            } => {
                write!(
                    f,
                    "time_us jumped from {latest_us} to {given_us}, more than {AHEAD_MAX_US} ahead"
                )
            }
            Self::Blunt => f.write_str("no track can start from so blunt a measurement"),
            Self::NotStarted => f.write_str("no measurement yet"),
            Self::OtherModel => f.write_str("the track runs on another model"),
            Self::NetworkNotFinite => f.write_str("the network's output is not finite"),
            Self::Correction(error) => write!(f, "correction: {error}"),
            Self::Lost => f.write_str("nothing is known of the target at that time"),
        }
    }
}

impl core::error::Error for StepError {}
