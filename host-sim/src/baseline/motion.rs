//! Linear motion models in continuous time.

use nalgebra::{Matrix6, SMatrix};

use super::gaussian::Gaussian;

/// How an N-dimensional state moves: `dx = A x dt + dw`, dw white with covariance D dt.
pub trait Motion<const N: usize> {
    /// A, 1/s.
    fn drift(&self) -> SMatrix<f64, N, N>;
    /// D, positive semi-definite.
    fn diffusion(&self) -> SMatrix<f64, N, N>;
    /// The state a flight begins with, given what is believed of position and velocity.
    fn initial(&self, kinematic: &Gaussian<6>) -> Gaussian<N>;
}

/// Constant velocity driven by white-noise acceleration; state position, velocity. The paper's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WhiteAcceleration {
    /// Spectral density of the acceleration on each axis, m^2/s^3.
    pub q_m2_s3: f64,
}

impl Motion<6> for WhiteAcceleration {
    fn drift(&self) -> Matrix6<f64> {
        let mut a = Matrix6::zeros();
        for axis in 0..3 {
            a[(axis, axis + 3)] = 1.0;
        }
        a
    }

    fn diffusion(&self) -> Matrix6<f64> {
        let mut d = Matrix6::zeros();
        for axis in 3..6 {
            d[(axis, axis)] = self.q_m2_s3;
        }
        d
    }

    fn initial(&self, kinematic: &Gaussian<6>) -> Gaussian<6> {
        *kinematic
    }
}
