//! The motion model that the network's outputs stand for during one prediction.

use super::densities::Densities;
use super::factor::FACTOR_OUTPUTS;
use super::memory::NOTES;
use super::population::Base;
use crate::blob::field::RECURSIVE_OUTPUTS;
use crate::scalar::Scalar;

/// Outputs of the network that schedule the motion model; the factor follows them.
pub const SCHEDULE: usize = 17;
/// First of the outputs that are notes of the network to itself.
pub const NOTE_OUTPUT: usize = SCHEDULE + FACTOR_OUTPUTS;
/// Outputs of the network: the schedule, the factor, then its notes to itself.
pub const OUTPUTS: usize = NOTE_OUTPUT + NOTES;
const _: () = assert!(OUTPUTS == RECURSIVE_OUTPUTS);
/// Scale from an output to a mean jerk, m/s^3.
pub const JERK_SCALE: f64 = 2.0;
/// How much more jerk noise than the base has [`Schedule::wide`].
const WIDE_JERK_NOISE: f64 = 20.0;
/// First of the three outputs that are a mean jerk.
pub const JERK_OUTPUT: usize = 4;
/// First of the three outputs that are a density of jerk noise.
pub const JERK_NOISE_OUTPUT: usize = JERK_OUTPUT + 3;

/// Rates and noise densities of a linear-Gaussian motion model, and trust in the sensor.
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
    /// Process noise.
    pub noise: Densities<S>,
    /// What the sensor's stated variances are multiplied with: angles, range, range-rate.
    pub sensor_scale: [S; 3],
}

impl<S: Scalar> Schedule<S> {
    /// A model for motion that none was trained for: acceleration of about 5 m/s^2 with the base of a
    /// small drone, no damping, and the sensor as it says it is.
    pub fn wide(base: &Base<S>) -> Self {
        let zero = S::constant(0.0);
        Self {
            decay_hz: base.decay_hz,
            damping_hz2: [zero; 2],
            turn_radps: zero,
            jerk_mps3: [zero; 3],
            noise: Densities {
                jerk: [base.jerk_noise * S::constant(WIDE_JERK_NOISE); 3],
                acceleration: [base.acceleration_noise; 3],
                velocity: base.velocity_noise,
            },
            sensor_scale: [S::constant(1.0); 3],
        }
    }

    /// Reads the schedule from the first [`SCHEDULE`] outputs of the network. Outputs are clamped,
    /// so no finite output gives a model that is not stable and finite.
    pub fn read(outputs: &[S], base: &Base<S>) -> Self {
        let c = S::constant;
        let scaled = |i: usize, limit: f64, scale: S| grown(outputs[i].clamp(-limit, limit), scale);
        let noise =
            |from: usize, scale: S| core::array::from_fn(|axis| scaled(from + axis, 7.0, scale));
        let damping = |i: usize| (outputs[i].clamp(-5.0, 5.0) - c(3.0)).softplus();
        Self {
            decay_hz: scaled(0, 3.0, base.decay_hz),
            damping_hz2: [damping(1), damping(2)],
            turn_radps: outputs[3].clamp(-6.0, 6.0),
            jerk_mps3: core::array::from_fn(|axis| {
                c(JERK_SCALE) * outputs[JERK_OUTPUT + axis].clamp(-10.0, 10.0)
            }),
            noise: Densities {
                jerk: noise(JERK_NOISE_OUTPUT, base.jerk_noise),
                acceleration: noise(10, base.acceleration_noise),
                velocity: scaled(13, 7.0, base.velocity_noise),
            },
            sensor_scale: core::array::from_fn(|i| scaled(14 + i, 2.0, c(1.0))),
        }
    }
}

/// A multiple of a scale, by its logarithm.
// Eleven times a step, once in flash.
#[inline(never)]
fn grown<S: Scalar>(ln: S, scale: S) -> S {
    ln.exp() * scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_outputs_are_the_base() {
        let schedule = Schedule::read(&[0.0; SCHEDULE], &Base::DRONE);
        assert_eq!(schedule.decay_hz, Base::DRONE.decay_hz);
        assert_eq!(schedule.noise.jerk, [Base::DRONE.jerk_noise; 3]);
        assert_eq!(
            schedule.noise.acceleration,
            [Base::DRONE.acceleration_noise; 3]
        );
        assert_eq!(schedule.noise.velocity, Base::DRONE.velocity_noise);
        assert_eq!(schedule.jerk_mps3, [0.0; 3]);
        assert_eq!(schedule.turn_radps, 0.0);
        assert_eq!(schedule.sensor_scale, [1.0; 3]);
        let damping = (1.0 + (-3.0_f64).exp()).ln();
        assert!((schedule.damping_hz2[0] - damping).abs() < 1e-15);
        assert_eq!(schedule.damping_hz2[0], schedule.damping_hz2[1]);
    }

    /// Every output moves what `BLOB.md` says, and nothing else.
    #[test]
    fn every_output_has_its_place() {
        let flat = |s: Schedule<f64>| {
            let mut list = [0.0; SCHEDULE];
            list[0] = (s.decay_hz / Base::DRONE.decay_hz).ln();
            for (i, damping) in s.damping_hz2.into_iter().enumerate() {
                list[1 + i] = (damping.exp() - 1.0).ln() + 3.0;
            }
            list[3] = s.turn_radps;
            for axis in 0..3 {
                list[4 + axis] = s.jerk_mps3[axis] / 2.0;
                list[7 + axis] = (s.noise.jerk[axis] / Base::DRONE.jerk_noise).ln();
                let noise = s.noise.acceleration[axis] / Base::DRONE.acceleration_noise;
                list[10 + axis] = noise.ln();
                list[14 + axis] = s.sensor_scale[axis].ln();
            }
            list[13] = (s.noise.velocity / Base::DRONE.velocity_noise).ln();
            list
        };
        for output in 0..SCHEDULE {
            let mut outputs = [0.0; SCHEDULE];
            outputs[output] = 0.7;
            for (got, expected) in flat(Schedule::read(&outputs, &Base::DRONE))
                .into_iter()
                .zip(outputs)
            {
                assert!((got - expected).abs() < 1e-12, "output {output}: {got}");
            }
        }
    }

    #[test]
    fn wild_outputs_stay_bounded() {
        for (wild, sign) in [(1e30, 1.0), (-1e30, -1.0_f64)] {
            let schedule = Schedule::read(&[wild; SCHEDULE], &Base::DRONE);
            assert_eq!(schedule.decay_hz, (3.0 * sign).exp());
            assert_eq!(schedule.turn_radps, 6.0 * sign);
            assert_eq!(schedule.jerk_mps3, [20.0 * sign; 3]);
            assert!((schedule.noise.jerk[2] / (7.0 * sign).exp() - 3.0).abs() < 1e-12);
            assert!((schedule.sensor_scale[0] / (2.0 * sign).exp() - 1.0).abs() < 1e-12);
            let damping = (1.0 + (5.0 * sign - 3.0).exp()).ln();
            assert!((schedule.damping_hz2[1] - damping).abs() < 1e-12);
        }
    }

    /// Twenty times the base's jerk noise, and otherwise the base without any driving.
    #[test]
    fn the_wide_model_is_the_base_with_more_jerk() {
        let wide = Schedule::wide(&Base::DRONE);
        assert_eq!(wide.noise.jerk, [60.0; 3]);
        assert_eq!(wide.noise.acceleration, [0.03; 3]);
        assert_eq!((wide.noise.velocity, wide.decay_hz), (1e-4, 1.0));
        assert_eq!((wide.damping_hz2, wide.turn_radps), ([0.0; 2], 0.0));
        assert_eq!((wide.jerk_mps3, wide.sensor_scale), ([0.0; 3], [1.0; 3]));
    }
}
