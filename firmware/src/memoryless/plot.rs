//! What the memoryless networks read of a measurement.

use crate::measurement::{Channel, Measurement, Sensed};
use crate::step_error::StepError;

/// A measurement with all four channels, which the networks read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plot {
    /// Microseconds.
    pub time_us: u64,
    /// Range, m.
    pub range: Sensed,
    /// Elevation, rad.
    pub elevation: Sensed,
    /// Azimuth, rad.
    pub azimuth: Sensed,
    /// Range-rate, m/s.
    pub range_rate: Sensed,
}

impl Plot {
    /// The four channels of a measurement.
    ///
    /// # Errors
    /// [`StepError::Missing`] names the first that is not there.
    pub fn of(measurement: &Measurement) -> Result<Self, StepError> {
        let [elevation, azimuth, range, range_rate] = measurement.channels();
        let needed = |sensed: Option<Sensed>, channel| sensed.ok_or(StepError::Missing(channel));
        Ok(Self {
            time_us: measurement.time_us,
            range: needed(range, Channel::Range)?,
            elevation: needed(elevation, Channel::Elevation)?,
            azimuth: needed(azimuth, Channel::Azimuth)?,
            range_rate: needed(range_rate, Channel::RangeRate)?,
        })
    }
}
