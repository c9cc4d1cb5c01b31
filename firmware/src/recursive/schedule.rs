//! The motion model that the network's outputs stand for during one prediction.

use libm::{expf, logf};

use super::population::Base;

/// Outputs of the network that schedule the motion model; its memory follows them.
pub const SCHEDULE: usize = 17;
/// Scale from an output to a mean jerk, m/s^3.
pub const JERK_SCALE: f32 = 2.0;
/// First of the three outputs that are a mean jerk.
pub const JERK_OUTPUT: usize = 4;

/// Rates and noise densities of a linear-Gaussian motion model, and trust in the sensor.
///
/// Three-vectors run along the level line of sight: radial, lateral, vertical.
#[derive(Clone, Copy, Debug)]
pub struct Schedule {
    /// Rate at which acceleration decays, 1/s.
    pub decay_hz: f32,
    /// Jerk per velocity against the motion, horizontal and vertical, 1/s^2.
    pub damping_hz2: [f32; 2],
    /// Rate at which the acceleration turns about the vertical, rad/s.
    pub turn_radps: f32,
    /// Mean jerk, m/s^3.
    pub jerk_mps3: [f32; 3],
    /// Spectral density of white jerk, m^2/s^5.
    pub jerk_noise: [f32; 3],
    /// Spectral density of white acceleration, m^2/s^3.
    pub acceleration_noise: [f32; 3],
    /// Spectral density of white velocity, m^2/s.
    pub velocity_noise: f32,
    /// What the sensor's stated variances are multiplied with: angles, range, range-rate.
    pub sensor_scale: [f32; 3],
}

impl Schedule {
    /// Reads the schedule from the first [`SCHEDULE`] outputs of the network. Outputs are clamped,
    /// so no finite output gives a model that is not stable and finite.
    pub fn read(outputs: &[f32], base: &Base) -> Self {
        let scaled =
            |i: usize, limit: f32, scale: f32| expf(outputs[i].clamp(-limit, limit)) * scale;
        let noise =
            |from: usize, scale: f32| core::array::from_fn(|axis| scaled(from + axis, 7.0, scale));
        let damping = |i: usize| softplus(outputs[i].clamp(-5.0, 5.0) - 3.0);
        Self {
            decay_hz: scaled(0, 3.0, base.decay_hz),
            damping_hz2: [damping(1), damping(2)],
            turn_radps: outputs[3].clamp(-6.0, 6.0),
            jerk_mps3: core::array::from_fn(|axis| {
                JERK_SCALE * outputs[JERK_OUTPUT + axis].clamp(-10.0, 10.0)
            }),
            jerk_noise: noise(7, base.jerk_noise),
            acceleration_noise: noise(10, base.acceleration_noise),
            velocity_noise: scaled(13, 7.0, base.velocity_noise),
            sensor_scale: core::array::from_fn(|i| scaled(14 + i, 2.0, 1.0)),
        }
    }
}

/// `ln(1 + e^x)`, written so that neither end overflows.
fn softplus(x: f32) -> f32 {
    let positive = if x > 0.0 { x } else { 0.0 };
    positive + logf(1.0 + expf(-x.abs()))
}
