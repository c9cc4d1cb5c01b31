//! One simulated radar reading in f64, as the host's filters take it.

use crate::radar::pose::Pose;
use bnkf::{Measurement, Sensed};

/// Range, elevation, azimuth and range-rate at one instant, with their standard deviations.
///
/// Frame: x east, y north, z up, counted from the radar's own place; azimuth from +x towards +y, elevation from
/// the horizontal plane, range-rate positive outbound. A noisy range may be negative, a noisy
/// elevation may pass the zenith; the azimuth stays in `(-pi, pi]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Microseconds since the flight's first sample.
    pub time_us: u64,
    /// Range, metres.
    pub range_m: f64,
    /// Elevation, radians.
    pub elevation_rad: f64,
    /// Azimuth, radians.
    pub azimuth_rad: f64,
    /// Range-rate, metres per second.
    pub range_rate_mps: f64,
    /// Standard deviation (1 sigma) of the range, metres.
    pub sigma_range_m: f64,
    /// Standard deviation of the elevation, radians.
    pub sigma_elevation_rad: f64,
    /// Standard deviation of the azimuth, radians.
    pub sigma_azimuth_rad: f64,
    /// Standard deviation of the range-rate, metres per second.
    pub sigma_range_rate_mps: f64,
    /// Where the radar was and how it moved.
    pub sensor: Pose,
    /// How long after its time it comes, microseconds.
    pub late_us: u64,
}

impl From<&Reading> for Measurement {
    /// Rounds every field to the nearest f32, which is what a sensor's frame carries.
    fn from(reading: &Reading) -> Self {
        let sensed = |value, sigma| {
            Some(Sensed {
                value: value as f32,
                sigma: sigma as f32,
            })
        };
        Self {
            time_us: reading.time_us,
            range: sensed(reading.range_m, reading.sigma_range_m),
            elevation: sensed(reading.elevation_rad, reading.sigma_elevation_rad),
            azimuth: sensed(reading.azimuth_rad, reading.sigma_azimuth_rad),
            range_rate: sensed(reading.range_rate_mps, reading.sigma_range_rate_mps),
            sensor: reading.sensor.into(),
        }
    }
}
