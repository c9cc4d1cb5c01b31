//! Where a measurement's sensor is, and how it moves.

use crate::measurement::{RANGE_MAX_M, RANGE_RATE_MAX_MPS};

/// Position and velocity of a sensor in the track's frame: x east, y north, z up.
///
/// Range and angles of its measurements count from its position, along axes parallel to the frame's;
/// range-rate is relative to its velocity. The earth is flat: over a kilometre the vertical turns by
/// 0.16 mrad, less than any angle sigma that matters here.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sensor {
    /// Position, m; each coordinate at most [`SENSOR_POSITION_MAX_M`] in magnitude.
    pub position_m: [f32; 3],
    /// Velocity over ground, m/s; each component at most [`SENSOR_VELOCITY_MAX_MPS`] in magnitude.
    pub velocity_mps: [f32; 3],
}

/// Largest coordinate of a sensor, m: the largest range. Single precision resolves 0.06 m there,
/// and 0.06 mm at a kilometre: an origin near the sensors serves best.
pub const SENSOR_POSITION_MAX_M: f32 = RANGE_MAX_M;
/// Largest component of a sensor's velocity, m/s: the largest range-rate.
pub const SENSOR_VELOCITY_MAX_MPS: f32 = RANGE_RATE_MAX_MPS;

/// Why a [`Sensor`] cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum SensorError {
    /// A number is NaN or infinite.
    NotFinite,
    /// A coordinate is larger than [`SENSOR_POSITION_MAX_M`].
    TooFar,
    /// A component of the velocity is larger than [`SENSOR_VELOCITY_MAX_MPS`].
    TooFast,
}

impl core::fmt::Display for SensorError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotFinite => f.write_str("sensor is not finite"),
            Self::TooFar => {
                let max = SENSOR_POSITION_MAX_M;
                write!(f, "sensor.position_m is not within -{max} to {max}")
            }
            Self::TooFast => {
                let max = SENSOR_VELOCITY_MAX_MPS;
                write!(f, "sensor.velocity_mps is not within -{max} to {max}")
            }
        }
    }
}

impl core::error::Error for SensorError {}

impl Default for Sensor {
    fn default() -> Self {
        Self::ORIGIN
    }
}

impl Sensor {
    /// At rest in the origin.
    pub const ORIGIN: Self = Self::at([0.0; 3]);

    /// At rest.
    pub const fn at(position_m: [f32; 3]) -> Self {
        Self {
            position_m,
            velocity_mps: [0.0; 3],
        }
    }

    /// Checks that every number is finite and within its limit.
    ///
    /// # Errors
    /// [`SensorError`]
    pub fn check(&self) -> Result<(), SensorError> {
        let mut numbers = self.position_m.iter().chain(&self.velocity_mps);
        if !numbers.all(|x| x.is_finite()) {
            return Err(SensorError::NotFinite);
        }
        if self
            .position_m
            .iter()
            .any(|x| x.abs() > SENSOR_POSITION_MAX_M)
        {
            return Err(SensorError::TooFar);
        }
        if self
            .velocity_mps
            .iter()
            .any(|v| v.abs() > SENSOR_VELOCITY_MAX_MPS)
        {
            return Err(SensorError::TooFast);
        }
        Ok(())
    }

    /// The same without negative zeros: subtracting the origin then changes no bit of anything.
    pub(crate) fn canonical(self) -> Self {
        Self {
            position_m: self.position_m.map(|x| x + 0.0),
            velocity_mps: self.velocity_mps.map(|v| v + 0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_where_they_are_said_to_be() {
        assert_eq!(Sensor::default().check(), Ok(()));
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let place = |x: f32| {
                    let mut sensor = Sensor::ORIGIN;
                    sensor.position_m[axis] = sign * x;
                    sensor.check()
                };
                let speed = |v: f32| {
                    let mut sensor = Sensor::ORIGIN;
                    sensor.velocity_mps[axis] = sign * v;
                    sensor.check()
                };
                assert_eq!((place(1e6), speed(1e4)), (Ok(()), Ok(())));
                assert_eq!(place(1.001e6), Err(SensorError::TooFar));
                assert_eq!(speed(1.001e4), Err(SensorError::TooFast));
                for wild in [f32::NAN, f32::INFINITY] {
                    assert_eq!(place(wild), Err(SensorError::NotFinite));
                    assert_eq!(speed(wild), Err(SensorError::NotFinite));
                }
            }
        }
    }

    #[test]
    fn a_canonical_sensor_has_no_negative_zero() {
        let sensor = Sensor {
            position_m: [-0.0, 1.0, -2.0],
            velocity_mps: [3.0, -0.0, 0.0],
        };
        let canonical = sensor.canonical();
        assert_eq!(canonical, sensor);
        let numbers = canonical.position_m.iter().chain(&canonical.velocity_mps);
        for x in numbers {
            assert!(*x != 0.0 || x.is_sign_positive());
        }
    }
}
