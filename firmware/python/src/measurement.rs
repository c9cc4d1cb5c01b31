//! A measurement out of Python's arguments.

use bnkf::{Measurement, Sensed, Sensor};

/// Value and standard deviation, if it was measured.
pub type Channel = Option<(f64, f64)>;

/// Range, elevation, azimuth and range-rate at one time, from a sensor at a place (the origin) that moves (at rest).
pub fn measurement(
    time_us: u64,
    [range, elevation, azimuth, range_rate]: [Channel; 4],
    position_m: Option<[f64; 3]>,
    velocity_mps: Option<[f64; 3]>,
) -> Measurement {
    let sensed = |channel: Channel| {
        channel.map(|(value, sigma)| Sensed {
            value: value as f32,
            sigma: sigma as f32,
        })
    };
    let single = |numbers: Option<[f64; 3]>| numbers.unwrap_or_default().map(|x| x as f32);
    Measurement {
        time_us,
        range: sensed(range),
        elevation: sensed(elevation),
        azimuth: sensed(azimuth),
        range_rate: sensed(range_rate),
        sensor: Sensor {
            position_m: single(position_m),
            velocity_mps: single(velocity_mps),
        },
    }
}
