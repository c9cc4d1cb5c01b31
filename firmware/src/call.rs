//! What a tracker is asked at one time.

use crate::estimate::Estimate;
use crate::measurement::Measurement;
use crate::step_error::StepError;
use crate::tracker::Tracker;

/// One call of a tracker that moves it on.
///
/// ```
/// use bnkf::{Call, Measurement};
///
/// /// A scan's call, whether the radar saw the target or not.
/// fn of_scan(time_us: u64, seen: Option<Measurement>) -> Call {
///     Call::new(time_us, seen)
/// }
/// assert_eq!(of_scan(100, None), Call::Coast(100));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Call {
    /// A step with this measurement.
    Step(Measurement),
    /// A coast to this time, microseconds.
    Coast(u64),
}

impl Call {
    /// The call for a time, microseconds: a step with its measurement or, in a gap, a coast.
    pub fn new(time_us: u64, measurement: Option<Measurement>) -> Self {
        measurement.map_or(Self::Coast(time_us), Self::Step)
    }

    /// Its time, microseconds.
    pub fn time_us(&self) -> u64 {
        match self {
            Self::Step(measurement) => measurement.time_us,
            Self::Coast(time_us) => *time_us,
        }
    }

    /// The tracker's answer.
    ///
    /// # Errors
    /// The tracker's.
    pub fn answer(&self, tracker: &mut Tracker<'_>) -> Result<Estimate, StepError> {
        match self {
            Self::Step(measurement) => tracker.step(measurement),
            Self::Coast(time_us) => tracker.coast(*time_us),
        }
    }
}
