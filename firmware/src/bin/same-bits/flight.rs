//! A flight that no run changes: the hash is of its answers. `examples/c/main.c` flies the same.

use bnkf::{Measurement, Mounting, Sensed, Sensor};

/// Steps of a run, a tenth of a second apart.
pub const STEPS: u64 = 24;

/// Every fifth step is a gap.
pub fn is_gap(step: u64) -> bool {
    step % 5 == 4
}

/// A target that rises and turns, with errors of a tenth of their sigma's size, one wild reading, some
/// without a range or without all but range and azimuth, and one of another radar.
pub fn measurement(time_us: u64, step: u64) -> Measurement {
    let error = |channel: u64| ((step * 7 + channel * 3) % 11) as f32 * 0.04 - 0.2;
    let sensed = |value: f32, sigma: f32, channel: u64| Sensed {
        value: value + sigma * error(channel),
        sigma,
    };
    let wild = if step == 13 { 25.0 } else { 0.0 };
    let along = step as f32;
    let mounting = Mounting::new(0.9, 0.1, -0.05);
    let elevation = sensed(0.2 + 0.006 * along, 0.01, 1);
    let seen = mounting.direction(elevation, sensed(-0.6 + 0.04 * along, 0.01, 2));
    let (flat, no_range) = (step % 7 == 3, step % 11 == 6);
    Measurement {
        time_us,
        range: (!no_range).then_some(sensed(30.0 + 0.15 * along + wild, 0.5, 0)),
        elevation: (!flat).then_some(seen.elevation),
        azimuth: seen.azimuth,
        range_rate: (!flat).then_some(sensed(1.5, 0.1, 3)),
        sensor: if step == 16 {
            Sensor {
                position_m: [0.5, -0.25, 1.0],
                velocity_mps: [0.0, 0.125, 0.0],
            }
        } else {
            Sensor::ORIGIN
        },
    }
}
