//! Flight at a known level turn rate whose velocity fades.

use nalgebra::Matrix6;

use super::gaussian::Gaussian;
use super::motion::{Motion, WhiteAcceleration};

/// A coordinated turn about the vertical with damped velocity and white-noise acceleration; state
/// position, velocity. The vertical axis does not turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// Turn rate, rad/s, positive from x (east) towards y (north).
    pub turn_rate_radps: f64,
    /// Rate at which a velocity is forgotten, 1/s; see [`super::singer::Singer::damping_per_s`].
    pub damping_per_s: f64,
    /// Spectral density of the acceleration on each axis, m^2/s^3.
    pub q_m2_s3: f64,
}

impl Motion<6> for Turn {
    fn drift(&self) -> Matrix6<f64> {
        let mut a = WhiteAcceleration {
            q_m2_s3: self.q_m2_s3,
        }
        .drift();
        for axis in 3..6 {
            a[(axis, axis)] = -self.damping_per_s;
        }
        a[(3, 4)] = -self.turn_rate_radps;
        a[(4, 3)] = self.turn_rate_radps;
        a
    }

    fn diffusion(&self) -> Matrix6<f64> {
        WhiteAcceleration {
            q_m2_s3: self.q_m2_s3,
        }
        .diffusion()
    }

    fn initial(&self, kinematic: &Gaussian<6>) -> Gaussian<6> {
        *kinematic
    }
}
