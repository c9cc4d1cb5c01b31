//! Where a course wants the vehicle to be at one instant.

use nalgebra::Vector3;

/// Position, m, with its first two derivatives in time, m/s and m/s^2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    pub position_m: Vector3<f64>,
    pub velocity_mps: Vector3<f64>,
    pub acceleration_mps2: Vector3<f64>,
}

#[cfg(test)]
impl Reference {
    /// Panics unless the derivatives in `at(t)` agree with central differences of its values.
    pub fn assert_consistent(at: impl Fn(f64) -> Self, t_s: f64) {
        let h_s = 1e-4;
        let (before, here, after) = (at(t_s - h_s), at(t_s), at(t_s + h_s));
        let velocity_mps = (after.position_m - before.position_m) / (2.0 * h_s);
        let acceleration_mps2 = (after.velocity_mps - before.velocity_mps) / (2.0 * h_s);
        assert!((velocity_mps - here.velocity_mps).norm() < 1e-5);
        assert!((acceleration_mps2 - here.acceleration_mps2).norm() < 1e-5);
    }
}
