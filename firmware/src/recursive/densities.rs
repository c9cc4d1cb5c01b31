//! How strong the process noise is.

use crate::scalar::Scalar;

/// Spectral densities of the process noise; three-vectors run along the level line of sight:
/// radial, lateral, vertical.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Densities<S> {
    /// White jerk, m^2/s^5.
    pub jerk: [S; 3],
    /// White acceleration, m^2/s^3.
    pub acceleration: [S; 3],
    /// White velocity, m^2/s, the same in every direction.
    pub velocity: S,
}

impl<S: Scalar> Densities<S> {
    /// Those of two noises that do not depend on each other.
    pub fn plus(&self, other: &Self) -> Self {
        let sum = |a: &[S; 3], b: &[S; 3]| core::array::from_fn(|axis| a[axis] + b[axis]);
        Self {
            jerk: sum(&self.jerk, &other.jerk),
            acceleration: sum(&self.acceleration, &other.acceleration),
            velocity: self.velocity + other.velocity,
        }
    }

    /// Each multiplied.
    pub fn scaled(&self, jerk: S, acceleration: S, velocity: S) -> Self {
        Self {
            jerk: self.jerk.map(|density| density * jerk),
            acceleration: self.acceleration.map(|density| density * acceleration),
            velocity: self.velocity * velocity,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noises_add_up_and_are_multiplied_each() {
        let noise = Densities {
            jerk: [1.0, 2.0, 3.0],
            acceleration: [4.0, 5.0, 6.0],
            velocity: 7.0,
        };
        let sum = noise.plus(&noise.scaled(10.0, 100.0, 1000.0));
        assert_eq!(sum.jerk, [11.0, 22.0, 33.0]);
        assert_eq!(sum.acceleration, [404.0, 505.0, 606.0]);
        assert_eq!(sum.velocity, 7007.0);
    }
}
