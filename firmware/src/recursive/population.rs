//! What a recursive blob says about targets before anything is measured, and its base model.

use crate::measurement::Vectors;
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
    /// Mean horizontal range, m.
    pub horizontal_m: S,
    /// Its standard deviation, m.
    pub horizontal_sigma_m: S,
    /// Mean height over the radar, m.
    pub height_m: S,
    /// Its standard deviation, m.
    pub height_sigma_m: S,
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
        horizontal_m: 29.5,
        horizontal_sigma_m: 7.0,
        height_m: 14.5,
        height_sigma_m: 5.0,
    };

    /// The same for another scalar.
    pub fn known<S: Scalar>(&self) -> Population<S> {
        let c = S::constant;
        Population {
            range_m: c(self.range_m),
            range_sigma_m: c(self.range_sigma_m),
            elevation_rad: c(self.elevation_rad),
            elevation_sigma_rad: c(self.elevation_sigma_rad),
            horizontal_sigma_mps: c(self.horizontal_sigma_mps),
            vertical_sigma_mps: c(self.vertical_sigma_mps),
            acceleration_sigma_mps2: c(self.acceleration_sigma_mps2),
            horizontal_m: c(self.horizontal_m),
            horizontal_sigma_m: c(self.horizontal_sigma_m),
            height_m: c(self.height_m),
            height_sigma_m: c(self.height_sigma_m),
        }
    }
}

impl<S: Scalar> Population<S> {
    /// Standard deviations of a measurement (elevation, azimuth, range, range-rate): a sensor without
    /// a channel is as blunt there as the population is.
    pub fn sigmas_of(&self, vectors: &Vectors<S>) -> [S; 4] {
        let blunt = [
            self.elevation_sigma_rad,
            vectors.sigmas[1],
            self.range_sigma_m,
            self.horizontal_sigma_mps,
        ];
        core::array::from_fn(|i| {
            let present = vectors.present[i];
            present * vectors.sigmas[i] + (S::constant(1.0) - present) * blunt[i]
        })
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_measured_is_as_blunt_as_the_population() {
        let mut vectors = Vectors::whole([0.0; 4], [0.01, 0.02, 3.0, 0.5]);
        let population = Population::PAPER;
        assert_eq!(population.sigmas_of(&vectors), [0.01, 0.02, 3.0, 0.5]);
        vectors.present = [0.0, 1.0, 0.0, 0.0];
        assert_eq!(population.sigmas_of(&vectors), [0.21, 0.02, 6.0, 1.6]);
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
