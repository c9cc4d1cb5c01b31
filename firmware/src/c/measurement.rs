//! Measurements.

use super::status::BnkfStatus;
use crate::measurement::{Measurement, Sensed};
use crate::sensor::Sensor;

/// An elevation was measured.
pub const BNKF_ELEVATION: u8 = 1;
/// An azimuth was measured.
pub const BNKF_AZIMUTH: u8 = 2;
/// A range was measured.
pub const BNKF_RANGE: u8 = 4;
/// A range-rate was measured.
pub const BNKF_RANGE_RATE: u8 = 8;
/// In the order of `Channel::ALL`.
pub(super) const CHANNELS: [u8; 4] = [BNKF_ELEVATION, BNKF_AZIMUTH, BNKF_RANGE, BNKF_RANGE_RATE];
const ALL: u8 = BNKF_ELEVATION | BNKF_AZIMUTH | BNKF_RANGE | BNKF_RANGE_RATE;

/// A measured quantity and its standard deviation (1 sigma).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BnkfSensed {
    /// The value: m, rad or m/s.
    pub value: f32,
    /// Its standard deviation, in the same unit.
    pub sigma: f32,
}

/// One measurement. Frame: x east, y north, z up; azimuth from +x towards +y, elevation from the horizontal,
/// range-rate positive outbound. All zero but what was measured is a radar at rest in the origin.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BnkfMeasurement {
    /// Time, microseconds.
    pub time_us: u64,
    /// Elevation, rad.
    pub elevation: BnkfSensed,
    /// Azimuth, rad.
    pub azimuth: BnkfSensed,
    /// Range, m.
    pub range: BnkfSensed,
    /// Range-rate, m/s.
    pub range_rate: BnkfSensed,
    /// Position of the sensor, m.
    pub sensor_position_m: [f32; 3],
    /// Velocity of the sensor, m/s.
    pub sensor_velocity_mps: [f32; 3],
    /// What was measured: the sum of `BNKF_ELEVATION` and so on. What was not is not read.
    pub channels: u8,
}

impl From<Sensed> for BnkfSensed {
    fn from(Sensed { value, sigma }: Sensed) -> Self {
        Self { value, sigma }
    }
}

impl From<BnkfSensed> for Sensed {
    fn from(BnkfSensed { value, sigma }: BnkfSensed) -> Self {
        Self { value, sigma }
    }
}

impl TryFrom<BnkfMeasurement> for Measurement {
    type Error = BnkfStatus;

    fn try_from(measurement: BnkfMeasurement) -> Result<Self, BnkfStatus> {
        let channels = measurement.channels;
        if channels & !ALL != 0 {
            return Err(BnkfStatus::UnknownCode);
        }
        let there = |channel: u8, sensed: BnkfSensed| {
            (channels & channel != 0).then_some(Sensed::from(sensed))
        };
        Ok(Self {
            time_us: measurement.time_us,
            range: there(BNKF_RANGE, measurement.range),
            elevation: there(BNKF_ELEVATION, measurement.elevation),
            azimuth: there(BNKF_AZIMUTH, measurement.azimuth),
            range_rate: there(BNKF_RANGE_RATE, measurement.range_rate),
            sensor: Sensor {
                position_m: measurement.sensor_position_m,
                velocity_mps: measurement.sensor_velocity_mps,
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_is_there_or_not_by_its_own_bit() {
        let sensed = |value| BnkfSensed {
            value,
            sigma: 10.0 * value,
        };
        let nothing = BnkfMeasurement {
            time_us: 5,
            elevation: sensed(1.0),
            azimuth: sensed(2.0),
            range: sensed(3.0),
            range_rate: sensed(4.0),
            sensor_position_m: [5.0, 6.0, 7.0],
            sensor_velocity_mps: [8.0, 9.0, 10.0],
            channels: 0,
        };
        for channels in 0..16 {
            let given = BnkfMeasurement {
                channels,
                ..nothing
            };
            let read = Measurement::try_from(given).expect("known channels");
            assert_eq!(read.time_us, 5);
            assert_eq!(read.sensor.position_m, given.sensor_position_m);
            assert_eq!(read.sensor.velocity_mps, given.sensor_velocity_mps);
            for (place, (bit, sensed)) in CHANNELS.into_iter().zip(read.channels()).enumerate() {
                let value = (place + 1) as f32;
                let expected = (channels & bit != 0).then_some(Sensed {
                    value,
                    sigma: 10.0 * value,
                });
                assert_eq!(sensed, expected);
            }
        }
        let odd = BnkfMeasurement {
            channels: 16,
            ..nothing
        };
        assert_eq!(Measurement::try_from(odd), Err(BnkfStatus::UnknownCode));
    }
}
