//! What the memoryless networks read of a measurement.

use crate::measurement::{Channel, Measurement, Sensed};
use crate::sensor::Sensor;
use crate::step_error::StepError;

/// A measurement from the origin with all four channels, which the networks read.
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
    /// [`StepError::Missing`] names the first that is not there; [`StepError::Sensor`] if the sensor
    /// moves or is elsewhere, because what the networks know of places and of range-rates they know of
    /// one radar at rest.
    pub fn of(measurement: &Measurement) -> Result<Self, StepError> {
        if measurement.sensor != Sensor::ORIGIN {
            return Err(StepError::Sensor);
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_has_its_place_and_is_needed() {
        let sensed = |value: f32| Some(Sensed { value, sigma: 0.1 });
        let whole = Measurement {
            time_us: 5,
            range: sensed(1.0),
            elevation: sensed(2.0),
            azimuth: sensed(3.0),
            range_rate: sensed(4.0),
            sensor: Sensor::ORIGIN,
        };
        let plot = Plot::of(&whole).expect("whole");
        let values = [plot.range, plot.elevation, plot.azimuth, plot.range_rate];
        assert_eq!(values.map(|sensed| sensed.value), [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(plot.time_us, 5);
        let mut partial = whole;
        partial.range_rate = None;
        let missing = StepError::Missing(Channel::RangeRate);
        assert_eq!(Plot::of(&partial), Err(missing));
        partial.elevation = None;
        let missing = StepError::Missing(Channel::Elevation);
        assert_eq!(Plot::of(&partial), Err(missing));
        for axis in 0..3 {
            let (mut away, mut moving) = (whole, whole);
            away.sensor.position_m[axis] = -0.1;
            moving.sensor.velocity_mps[axis] = 0.1;
            assert_eq!(Plot::of(&away), Err(StepError::Sensor));
            assert_eq!(Plot::of(&moving), Err(StepError::Sensor));
        }
    }
}
