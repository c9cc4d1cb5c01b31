//! What a recursive blob says about targets before anything is measured, and its base model.

use crate::blob::Floats;

/// Where and how fast targets are before any measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Population {
    /// Mean range, m.
    pub range_m: f32,
    /// Standard deviation of the range, m.
    pub range_sigma_m: f32,
    /// Mean elevation, rad.
    pub elevation_rad: f32,
    /// Standard deviation of the elevation, rad.
    pub elevation_sigma_rad: f32,
    /// Standard deviation of each horizontal velocity, m/s.
    pub horizontal_sigma_mps: f32,
    /// Standard deviation of the vertical velocity, m/s.
    pub vertical_sigma_mps: f32,
    /// Standard deviation of each acceleration, m/s^2.
    pub acceleration_sigma_mps2: f32,
}

/// The motion model that a network answering zero schedules: a Singer model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Base {
    /// Rate at which acceleration decays, 1/s.
    pub decay_hz: f32,
    /// Spectral density of white jerk, m^2/s^5.
    pub jerk_noise: f32,
    /// Spectral density of white acceleration, m^2/s^3.
    pub acceleration_noise: f32,
    /// Spectral density of white velocity, m^2/s.
    pub velocity_noise: f32,
}

/// Reads both from a recursive blob's parameters, which are their fields in order.
pub(crate) fn read(parameters: Floats<'_>) -> (Population, Base) {
    let p = |index| parameters.get(index);
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
