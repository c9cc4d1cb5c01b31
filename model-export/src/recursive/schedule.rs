//! The motion model that the network's outputs stand for during one prediction.

use super::carry::MEMORY;
use super::scalar::Scalar;

/// Outputs that schedule the motion model.
pub const SCHEDULE: usize = 17;
/// First of the three outputs that are a mean jerk.
pub const JERK_OUTPUT: usize = bnkf::recursive::JERK_OUTPUT;
/// Scale from them to m/s^3.
pub const JERK_SCALE: f64 = bnkf::recursive::JERK_SCALE as f64;
/// First of the three outputs that are a density of jerk noise.
pub const JERK_NOISE_OUTPUT: usize = JERK_OUTPUT + 3;
/// Outputs of the network: the schedule, then its memory.
pub const OUTPUTS: usize = SCHEDULE + MEMORY;

/// Rates and noise densities of a linear-Gaussian motion model.
///
/// Three-vectors run along the level line of sight: radial, lateral, vertical.
#[derive(Clone, Copy, Debug)]
pub struct Schedule<S> {
    /// Rate at which acceleration decays, 1/s.
    pub decay_hz: S,
    /// Jerk per velocity against the motion, horizontal and vertical, 1/s^2.
    pub damping_hz2: [S; 2],
    /// Rate at which the acceleration turns about the vertical, rad/s.
    pub turn_radps: S,
    /// Mean jerk, m/s^3.
    pub jerk_mps3: [S; 3],
    /// Spectral density of white jerk, m^2/s^5.
    pub jerk_noise: [S; 3],
    /// Spectral density of white acceleration, m^2/s^3.
    pub acceleration_noise: [S; 3],
    /// Spectral density of white velocity, m^2/s.
    pub velocity_noise: S,
    /// What the sensor's stated variances are multiplied with: angles, range, range-rate.
    pub sensor_scale: [S; 3],
}

/// The schedule of a network that answers zero: a Singer model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Base {
    /// Rate at which acceleration decays, 1/s.
    pub decay_hz: f64,
    /// Spectral density of white jerk, m^2/s^5.
    pub jerk_noise: f64,
    /// Spectral density of white acceleration, m^2/s^3.
    pub acceleration_noise: f64,
    /// Spectral density of white velocity, m^2/s.
    pub velocity_noise: f64,
}

impl Base {
    /// A drone of a few metres a second in the paper's volume.
    pub const DRONE: Self = Self {
        decay_hz: 1.0,
        jerk_noise: 3.0,
        acceleration_noise: 0.03,
        velocity_noise: 1e-4,
    };
}

impl<S: Scalar> Schedule<S> {
    /// Reads the schedule from the first [`SCHEDULE`] outputs of the network.
    pub fn read(outputs: &[S], base: &Base) -> Self {
        let c = S::constant;
        let scaled =
            |output: S, limit: f64, scale: f64| output.clamp(-limit, limit).exp() * c(scale);
        let noise = |from: usize, scale: f64| {
            core::array::from_fn(|axis| scaled(outputs[from + axis], 7.0, scale))
        };
        let damping = |output: S| (output.clamp(-5.0, 5.0) - c(3.0)).softplus();
        Self {
            decay_hz: scaled(outputs[0], 3.0, base.decay_hz),
            damping_hz2: [damping(outputs[1]), damping(outputs[2])],
            turn_radps: outputs[3].clamp(-6.0, 6.0),
            jerk_mps3: core::array::from_fn(|axis| {
                c(JERK_SCALE) * outputs[JERK_OUTPUT + axis].clamp(-10.0, 10.0)
            }),
            jerk_noise: noise(JERK_NOISE_OUTPUT, base.jerk_noise),
            acceleration_noise: noise(10, base.acceleration_noise),
            velocity_noise: scaled(outputs[13], 7.0, base.velocity_noise),
            sensor_scale: core::array::from_fn(|i| scaled(outputs[14 + i], 2.0, 1.0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_outputs_are_the_base() {
        let schedule = Schedule::<f64>::read(&[0.0; OUTPUTS], &Base::DRONE);
        assert_eq!(schedule.decay_hz, Base::DRONE.decay_hz);
        assert_eq!(schedule.jerk_noise, [Base::DRONE.jerk_noise; 3]);
        assert!(schedule.damping_hz2[0] < 0.05);
    }

    #[test]
    fn wild_outputs_stay_bounded() {
        for wild in [1e30, -1e30] {
            let schedule = Schedule::<f64>::read(&[wild; OUTPUTS], &Base::DRONE);
            assert!(schedule.decay_hz > 0.0 && schedule.decay_hz < 25.0);
            assert!(schedule.turn_radps.abs() <= 6.0);
            assert!(schedule.jerk_noise[0] > 0.0 && schedule.jerk_noise[0] < 5e3);
        }
    }
}
