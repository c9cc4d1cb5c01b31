//! What a recursive blob says about targets before anything is measured, and its base model.

use crate::blob::{Floats, field::RECURSIVE_PARAMETERS};
use crate::scalar::Scalar;

/// Where and how fast targets are before any measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Population<S> {
    /// Mean range, m.
    pub range_m: S,
    /// Standard deviation of the range, m.
    pub range_sigma_m: S,
    /// Mean elevation, rad.
    pub elevation_rad: S,
    /// Standard deviation of the elevation, rad.
    pub elevation_sigma_rad: S,
    /// Standard deviation of each horizontal velocity, m/s.
    pub horizontal_sigma_mps: S,
    /// Standard deviation of the vertical velocity, m/s.
    pub vertical_sigma_mps: S,
    /// Standard deviation of each acceleration, m/s^2.
    pub acceleration_sigma_mps2: S,
}

/// The motion model that a network answering zero schedules: a Singer model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Base<S> {
    /// Rate at which acceleration decays, 1/s.
    pub decay_hz: S,
    /// Spectral density of white jerk, m^2/s^5.
    pub jerk_noise: S,
    /// Spectral density of white acceleration, m^2/s^3.
    pub acceleration_noise: S,
    /// Spectral density of white velocity, m^2/s.
    pub velocity_noise: S,
}

impl Population<f64> {
    /// About that of flights in the paper's volume, for a tracker without training.
    pub const PAPER: Self = Self {
        range_m: 33.5,
        range_sigma_m: 6.0,
        elevation_rad: 0.5,
        elevation_sigma_rad: 0.21,
        horizontal_sigma_mps: 1.6,
        vertical_sigma_mps: 0.5,
        acceleration_sigma_mps2: 2.0,
    };
}

impl Base<f64> {
    /// A drone of a few metres a second in the paper's volume.
    pub const DRONE: Self = Self {
        decay_hz: 1.0,
        jerk_noise: 3.0,
        acceleration_noise: 0.03,
        velocity_noise: 1e-4,
    };

    /// The same numbers for a step written in `S`.
    pub fn known<S: Scalar>(&self) -> Base<S> {
        Base {
            decay_hz: S::constant(self.decay_hz),
            jerk_noise: S::constant(self.jerk_noise),
            acceleration_noise: S::constant(self.acceleration_noise),
            velocity_noise: S::constant(self.velocity_noise),
        }
    }
}

/// Both from a recursive blob's parameters, which are their fields in order.
pub fn read<S: From<f32>>(parameters: Floats<'_>) -> (Population<S>, Base<S>) {
    let p = |index| S::from(parameters.get(index));
    let population = Population {
        range_m: p(0),
        range_sigma_m: p(1),
        elevation_rad: p(2),
        elevation_sigma_rad: p(3),
        horizontal_sigma_mps: p(4),
        vertical_sigma_mps: p(5),
        acceleration_sigma_mps2: p(6),
    };
    let base = Base {
        decay_hz: p(7),
        jerk_noise: p(8),
        acceleration_noise: p(9),
        velocity_noise: p(10),
    };
    (population, base)
}

/// A recursive blob's parameters in their order, the inverse of [`read`].
pub fn parameters(population: &Population<f64>, base: &Base<f64>) -> [f32; RECURSIVE_PARAMETERS] {
    [
        population.range_m,
        population.range_sigma_m,
        population.elevation_rad,
        population.elevation_sigma_rad,
        population.horizontal_sigma_mps,
        population.vertical_sigma_mps,
        population.acceleration_sigma_mps2,
        base.decay_hz,
        base.jerk_noise,
        base.acceleration_noise,
        base.velocity_noise,
    ]
    .map(|value| value as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_come_back() {
        let list = parameters(&Population::PAPER, &Base::DRONE);
        let mut draft = crate::blob::draft::Draft::recursive(3);
        draft.parameters = list.to_vec();
        let bytes = draft.bytes();
        let blob = crate::blob::Blob::parse(&bytes).expect("a blob");
        let (population, base) = read::<f64>(blob.parameters());
        assert_eq!(parameters(&population, &base), list);
        assert_eq!(population.range_m, 33.5);
        assert!((base.velocity_noise - 1e-4).abs() < 1e-10);
    }

    #[test]
    fn a_base_is_known_to_every_scalar() {
        let single: Base<f32> = Base::DRONE.known();
        assert_eq!((single.decay_hz, single.jerk_noise), (1.0, 3.0));
        assert_eq!(
            (single.acceleration_noise, single.velocity_noise),
            (0.03, 1e-4)
        );
    }
}
