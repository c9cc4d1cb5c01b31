//! Linear motion models for any time step.

use nalgebra::{Matrix6, SMatrix};

use super::gaussian::Gaussian;

/// How an N-dimensional state moves: `x' = F(dt) x + w`, w ~ N(0, Q(dt)).
pub trait Motion<const N: usize> {
    /// F for a step of `dt_s` >= 0 seconds.
    fn transition(&self, dt_s: f64) -> SMatrix<f64, N, N>;
    /// Q for the same step, positive semi-definite.
    fn noise(&self, dt_s: f64) -> SMatrix<f64, N, N>;
    /// The state a flight begins with, given what is believed of position and velocity.
    fn initial(&self, kinematic: &Gaussian<6>) -> Gaussian<N>;
}

/// Constant velocity driven by white-noise acceleration; state position, velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WhiteAcceleration {
    /// Spectral density of the acceleration on each axis, m^2/s^3.
    pub q_m2_s3: f64,
}

impl Motion<6> for WhiteAcceleration {
    fn transition(&self, dt_s: f64) -> Matrix6<f64> {
        let mut f = Matrix6::identity();
        for axis in 0..3 {
            f[(axis, axis + 3)] = dt_s;
        }
        f
    }

    fn noise(&self, dt_s: f64) -> Matrix6<f64> {
        let mut q = Matrix6::zeros();
        for axis in 0..3 {
            q[(axis, axis)] = self.q_m2_s3 * dt_s.powi(3) / 3.0;
            q[(axis, axis + 3)] = self.q_m2_s3 * dt_s * dt_s / 2.0;
            q[(axis + 3, axis)] = q[(axis, axis + 3)];
            q[(axis + 3, axis + 3)] = self.q_m2_s3 * dt_s;
        }
        q
    }

    fn initial(&self, kinematic: &Gaussian<6>) -> Gaussian<6> {
        *kinematic
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A continuous-time model does not care how a second is cut into steps.
    pub fn assert_divisible<const N: usize>(motion: &impl Motion<N>) {
        let (first, second) = (0.13, 0.31);
        let f = motion.transition(second);
        let step_twice = f * motion.noise(first) * f.transpose() + motion.noise(second);
        assert!((step_twice - motion.noise(first + second)).norm() < 1e-12);
        assert!((f * motion.transition(first) - motion.transition(first + second)).norm() < 1e-12);
    }

    #[test]
    fn two_steps_make_one() {
        assert_divisible(&WhiteAcceleration { q_m2_s3: 0.7 });
    }
}
