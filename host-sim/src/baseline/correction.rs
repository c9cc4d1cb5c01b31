//! Taking a reading into a Gaussian belief, linearised (EKF) or through sigma points (UKF, CKF).

use nalgebra::{Matrix4, SMatrix, Vector4};

use super::gaussian::{Gaussian, symmetric};
use super::sensor::{self, Observation};
use super::sigma_points::Spread;
use crate::filter::{FilterError, Nis};

/// How the measurement function's nonlinearity is met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Correction {
    /// Jacobian at the predicted mean.
    Extended,
    /// Unscented transform.
    SigmaPoints(Spread),
}

/// What a correction learnt about the reading beforehand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// Normalised innovation squared, four degrees of freedom.
    pub nis: Nis,
    /// Log of the predicted density at the reading, natural units.
    pub log_likelihood: f64,
}

/// What is known of the reading before it is seen.
pub(super) struct Expectation<const N: usize> {
    /// Reading minus its predicted mean, angles wrapped.
    pub innovation: Vector4<f64>,
    /// Covariance of the innovation.
    pub covariance: Matrix4<f64>,
    /// Covariance of state and reading.
    pub cross: SMatrix<f64, N, 4>,
}

impl<const N: usize> Expectation<N> {
    /// Gain and [`Innovation`].
    fn gain(&self) -> Result<(SMatrix<f64, N, 4>, Innovation), FilterError> {
        let factor = self
            .covariance
            .cholesky()
            .ok_or(FilterError::NotPositiveDefinite)?;
        let gain = factor.solve(&self.cross.transpose()).transpose();
        let nis = self.innovation.dot(&factor.solve(&self.innovation));
        let half_log_det: f64 = factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
        let log_likelihood = -0.5 * nis - half_log_det - 2.0 * core::f64::consts::TAU.ln();
        let innovation = Innovation {
            nis: Nis {
                value: nis,
                degrees: 4,
            },
            log_likelihood,
        };
        Ok((gain, innovation))
    }
}

impl Correction {
    /// The belief after `observation`.
    ///
    /// # Errors
    /// The covariance of the state (sigma points) or of the innovation has no Cholesky factor.
    pub fn apply<const N: usize>(
        &self,
        belief: &Gaussian<N>,
        observation: &Observation,
    ) -> Result<(Gaussian<N>, Innovation), FilterError> {
        match self {
            Self::Extended => extended(belief, observation),
            Self::SigmaPoints(spread) => {
                let expectation = spread.expectation(belief, observation)?;
                let (gain, innovation) = expectation.gain()?;
                let less = gain * expectation.covariance * gain.transpose();
                let after = Gaussian {
                    mean: belief.mean + gain * expectation.innovation,
                    covariance: symmetric(&(belief.covariance - less)),
                };
                Ok((after, innovation))
            }
        }
    }
}

/// EKF correction with the covariance in Joseph form.
fn extended<const N: usize>(
    belief: &Gaussian<N>,
    observation: &Observation,
) -> Result<(Gaussian<N>, Innovation), FilterError> {
    let (p, v) = (belief.position_m(), belief.velocity_mps());
    let mut h = SMatrix::<f64, 4, N>::zeros();
    h.fixed_view_mut::<4, 6>(0, 0)
        .copy_from(&sensor::jacobian(&p, &v));
    let cross = belief.covariance * h.transpose();
    let noise = observation.noise();
    let expectation = Expectation {
        innovation: sensor::residual(&observation.z, &sensor::expected(&p, &v)),
        covariance: symmetric(&(h * cross + noise)),
        cross,
    };
    let (gain, innovation) = expectation.gain()?;
    let keep = SMatrix::<f64, N, N>::identity() - gain * h;
    let covariance = keep * belief.covariance * keep.transpose() + gain * noise * gain.transpose();
    let after = Gaussian {
        mean: belief.mean + gain * expectation.innovation,
        covariance: symmetric(&covariance),
    };
    Ok((after, innovation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, Vector6};

    /// Far from the radar and well known: the measurement function is linear over the belief, so
    /// both ways must agree.
    #[test]
    fn linearised_and_sigma_points_agree_where_the_sensor_is_linear() {
        let belief = Gaussian::<6> {
            mean: Vector6::new(2000.0, -1500.0, 700.0, 3.0, -2.0, 1.0),
            covariance: Matrix6::from_diagonal(&Vector6::new(0.4, 0.5, 0.6, 0.04, 0.05, 0.06)),
        };
        let at = sensor::expected(&belief.position_m(), &belief.velocity_mps());
        let observation = Observation {
            z: at + Vector4::new(2e-4, -3e-4, 0.5, 0.1),
            sigma: Vector4::new(1e-4, 2e-4, 0.7, 0.2),
        };
        let (a, ia) = Correction::Extended.apply(&belief, &observation).unwrap();
        for spread in [Spread::UNIT, Spread::CUBATURE] {
            let (b, ib) = Correction::SigmaPoints(spread)
                .apply(&belief, &observation)
                .unwrap();
            // The transform sees the range's curvature, sigma^2 / 2r = 3e-4 m.
            assert!((a.mean - b.mean).norm() < 1e-3);
            assert!((a.covariance - b.covariance).norm() < 1e-3);
            assert!((ia.nis.value - ib.nis.value).abs() < 1e-3);
            assert!((ia.log_likelihood - ib.log_likelihood).abs() < 1e-3);
        }
    }

    /// One scalar direction seen alone has the textbook posterior.
    #[test]
    fn range_alone_gives_the_scalar_posterior() {
        let belief = Gaussian::<6> {
            mean: Vector6::new(30.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            covariance: Matrix6::identity() * 4.0,
        };
        let observation = Observation {
            z: Vector4::new(0.0, 0.0, 33.0, 0.0),
            sigma: Vector4::new(1e6, 1e6, 1.0, 1e6),
        };
        let (after, innovation) = Correction::Extended.apply(&belief, &observation).unwrap();
        assert!((after.mean.x - (30.0 + 3.0 * 4.0 / 5.0)).abs() < 1e-9);
        assert!((after.covariance[(0, 0)] - 4.0 / 5.0).abs() < 1e-9);
        assert!((innovation.nis.value - 9.0 / 5.0).abs() < 1e-9);
    }
}
