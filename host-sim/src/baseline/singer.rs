//! Singer's model with a velocity that fades: what the tuned filters believe of a drone.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::gaussian::Gaussian;
use super::motion::Motion;

/// Each axis carries an exponentially correlated acceleration (Singer 1970), white acceleration
/// on top, and a damped velocity; state position, velocity, acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Singer {
    /// Standard deviation of the correlated acceleration on each axis, m/s^2.
    pub acceleration_sigma_mps2: f64,
    /// Time after which its correlation has fallen to 1/e, s.
    pub correlation_time_s: f64,
    /// Rate at which a velocity is forgotten, 1/s. A drone that stays in its volume cannot keep a
    /// velocity for long. Without this the velocity's variance grows without bound through a
    /// long dead time, and at high noise the filter reads a range out of the turns it sees: the
    /// error along the line of sight then exceeds its covariance by a factor of two.
    pub damping_per_s: f64,
    /// Spectral density of the white acceleration on each axis, m^2/s^3.
    pub q_m2_s3: f64,
}

impl Motion<9> for Singer {
    fn drift(&self) -> SMatrix<f64, 9, 9> {
        let mut a = SMatrix::<f64, 9, 9>::zeros();
        for axis in 0..3 {
            a[(axis, axis + 3)] = 1.0;
            a[(axis + 3, axis + 3)] = -self.damping_per_s;
            a[(axis + 3, axis + 6)] = 1.0;
            a[(axis + 6, axis + 6)] = -1.0 / self.correlation_time_s;
        }
        a
    }

    fn diffusion(&self) -> SMatrix<f64, 9, 9> {
        let jerk = 2.0 * self.acceleration_sigma_mps2.powi(2) / self.correlation_time_s;
        let mut d = SMatrix::<f64, 9, 9>::zeros();
        for axis in 0..3 {
            d[(axis + 3, axis + 3)] = self.q_m2_s3;
            d[(axis + 6, axis + 6)] = jerk;
        }
        d
    }

    /// The acceleration starts at its stationary distribution.
    fn initial(&self, kinematic: &Gaussian<6>) -> Gaussian<9> {
        let mut mean = SVector::<f64, 9>::zeros();
        mean.fixed_rows_mut::<6>(0).copy_from(&kinematic.mean);
        let mut covariance = SMatrix::<f64, 9, 9>::zeros();
        covariance
            .fixed_view_mut::<6, 6>(0, 0)
            .copy_from(&kinematic.covariance);
        for axis in 6..9 {
            covariance[(axis, axis)] = self.acceleration_sigma_mps2.powi(2);
        }
        Gaussian { mean, covariance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baseline::discrete::Discrete;

    /// However long a filter coasts, acceleration and velocity keep their stationary variance:
    /// sigma^2 for the one, q / 2d + sigma^2 tau / (d (1 + d tau)) for the other.
    #[test]
    fn long_coasting_is_bounded() {
        let motion = Singer {
            acceleration_sigma_mps2: 1.7,
            correlation_time_s: 0.8,
            damping_per_s: 0.5,
            q_m2_s3: 0.3,
        };
        let kinematic = Gaussian {
            mean: nalgebra::Vector6::repeat(1.0),
            covariance: nalgebra::Matrix6::identity(),
        };
        let step = Discrete::new(&motion, 200.0);
        let after = motion.initial(&kinematic).predicted(&step);
        assert!((after.covariance[(7, 7)] - 1.7 * 1.7).abs() < 1e-9);
        let velocity = 0.3 / (2.0 * 0.5) + 1.7 * 1.7 * 0.8 / (0.5 * (1.0 + 0.5 * 0.8));
        assert!((after.covariance[(4, 4)] - velocity).abs() < 1e-9);
    }
}
