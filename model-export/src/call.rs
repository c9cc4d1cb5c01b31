//! What a tracker is asked at one time.

use bnkf::{Estimate, Measurement, StepError, Tracker};

/// One call of a tracker.
#[derive(Clone, Copy, Debug)]
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
