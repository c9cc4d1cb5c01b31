//! How strong the process noise is.

use crate::scalar::Scalar;

/// Spectral densities of the process noise; three-vectors run along the level line of sight:
/// radial, lateral, vertical.
#[derive(Clone, Copy, Debug)]
pub struct Densities<S> {
    /// White jerk, m^2/s^5.
    pub jerk: [S; 3],
    /// White acceleration, m^2/s^3.
    pub acceleration: [S; 3],
    /// White velocity, m^2/s, the same in every direction.
    pub velocity: S,
}

impl<S: Scalar> Densities<S> {
    /// Each multiplied.
    pub fn scaled(&self, jerk: S, acceleration: S, velocity: S) -> Self {
        Self {
            jerk: self.jerk.map(|density| density * jerk),
            acceleration: self.acceleration.map(|density| density * acceleration),
            velocity: self.velocity * velocity,
        }
    }
}
