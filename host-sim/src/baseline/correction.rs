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
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Innovation {
    /// Reading minus its predicted mean, angles wrapped.
    pub residual: Vector4<f64>,
    /// Covariance of the residual.
    pub covariance: Matrix4<f64>,
    /// Normalised innovation squared, a degree of freedom for every channel that was measured.
    pub nis: Nis,
    /// Log of the predicted density at the reading, natural units.
    pub log_likelihood: f64,
}

/// What is known of the reading before it is seen.
pub(super) struct Expectation<const N: usize> {
    /// Reading minus its predicted mean, angles wrapped.
    pub residual: Vector4<f64>,
    /// Covariance of the residual.
    pub covariance: Matrix4<f64>,
    /// Covariance of state and reading.
    pub cross: SMatrix<f64, N, 4>,
}

impl<const N: usize> Expectation<N> {
    /// The belief after the reading.
    ///
    /// Without the channels that were not measured: each is as good as one that is independent of
    /// the state and was expected to the point.
    fn of_measured(mut self, present: &[bool; 4]) -> Self {
        for i in (0..4).filter(|i| !present[*i]) {
            self.residual[i] = 0.0;
            self.covariance.row_mut(i).fill(0.0);
            self.covariance.column_mut(i).fill(0.0);
            self.covariance[(i, i)] = 1.0;
            self.cross.column_mut(i).fill(0.0);
        }
        self
    }

    /// With S = L L' and W = cross L'^-1 the covariance becomes P - W W': symmetric to the bit. In
    /// f64 its loss of digits, the ratio of R to H P H', is harmless at 1e-8 and better.
    fn correct(
        &self,
        belief: &Gaussian<N>,
        present: &[bool; 4],
    ) -> Result<(Gaussian<N>, Innovation), FilterError> {
        let refused = FilterError::NotPositiveDefinite;
        let factor = self.covariance.cholesky().ok_or(refused)?;
        let l = factor.l_dirty();
        let white = l.solve_lower_triangular(&self.residual).ok_or(refused)?;
        let gain = l
            .solve_lower_triangular(&self.cross.transpose())
            .ok_or(refused)?;
        let after = Gaussian {
            mean: belief.mean + gain.tr_mul(&white),
            covariance: belief.covariance - gain.tr_mul(&gain),
        };
        let nis = white.norm_squared();
        let degrees = present.iter().filter(|present| **present).count();
        let half_log_det: f64 = l.diagonal().iter().map(|d| d.ln()).sum();
        let innovation = Innovation {
            residual: self.residual,
            covariance: self.covariance,
            nis: Nis {
                value: nis,
                degrees,
            },
            log_likelihood: -0.5 * (nis + degrees as f64 * core::f64::consts::TAU.ln())
                - half_log_det,
        };
        Ok((after, innovation))
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
        let expectation = match self {
            Self::Extended => linearised(belief, observation),
            Self::SigmaPoints(spread) => spread.expectation(belief, observation)?,
        };
        let present = &observation.present;
        expectation.of_measured(present).correct(belief, present)
    }
}

fn linearised<const N: usize>(belief: &Gaussian<N>, observation: &Observation) -> Expectation<N> {
    let (p, v) = (belief.position_m(), belief.velocity_mps());
    let h = observation.jacobian(&p, &v);
    // The reading depends on position and velocity only.
    let cross = belief.covariance.fixed_columns::<6>(0) * h.transpose();
    let covariance = h * cross.fixed_rows::<6>(0) + observation.noise();
    Expectation {
        residual: sensor::residual(&observation.z, &observation.expected(&p, &v)),
        covariance: symmetric(&covariance),
        cross,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, Vector6};

    /// What was not measured must not count: the corrections of the two parts of a reading in turn
    /// are the correction with all of it, where the sensor is linear.
    #[test]
    fn parts_of_a_reading_in_turn_are_the_whole() {
        let belief = Gaussian::<6> {
            mean: Vector6::new(2000.0, -1500.0, 700.0, 3.0, -2.0, 1.0),
            covariance: Matrix6::from_diagonal(&Vector6::new(0.4, 0.5, 0.6, 0.04, 0.05, 0.06)),
        };
        let at = sensor::expected(&belief.position_m(), &belief.velocity_mps());
        let whole = Observation::new(
            at + Vector4::new(2e-4, -3e-4, 0.5, 0.1),
            Vector4::new(1e-4, 2e-4, 0.7, 0.2),
        );
        let (expected, innovation) = Correction::Extended.apply(&belief, &whole).unwrap();
        for correction in [Correction::Extended, Correction::SigmaPoints(Spread::UNIT)] {
            let (mut got, mut nis) = (belief, 0.0);
            for present in [[true, false, true, false], [false, true, false, true]] {
                let mut part = Observation { present, ..whole };
                for i in (0..4).filter(|i| !present[*i]) {
                    part.z[i] = f64::NAN;
                }
                let (after, learnt) = correction.apply(&got, &part).unwrap();
                assert_eq!(learnt.nis.degrees, 2);
                (got, nis) = (after, nis + learnt.nis.value);
            }
            assert!((got.mean - expected.mean).norm() < 2e-3);
            assert!((got.covariance - expected.covariance).norm() < 2e-3);
            assert!((nis - innovation.nis.value).abs() < 2e-2, "{nis}");
        }
    }

    /// Far from the radar and well known: the measurement function is linear over the belief, so
    /// both ways must agree.
    #[test]
    fn linearised_and_sigma_points_agree_where_the_sensor_is_linear() {
        let belief = Gaussian::<6> {
            mean: Vector6::new(2000.0, -1500.0, 700.0, 3.0, -2.0, 1.0),
            covariance: Matrix6::from_diagonal(&Vector6::new(0.4, 0.5, 0.6, 0.04, 0.05, 0.06)),
        };
        let at = sensor::expected(&belief.position_m(), &belief.velocity_mps());
        let observation = Observation::new(
            at + Vector4::new(2e-4, -3e-4, 0.5, 0.1),
            Vector4::new(1e-4, 2e-4, 0.7, 0.2),
        );
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
        let observation = Observation::new(
            Vector4::new(0.0, 0.0, 33.0, 0.0),
            Vector4::new(1e6, 1e6, 1.0, 1e6),
        );
        let (after, innovation) = Correction::Extended.apply(&belief, &observation).unwrap();
        assert!((after.mean.x - (30.0 + 3.0 * 4.0 / 5.0)).abs() < 1e-9);
        assert!((after.covariance[(0, 0)] - 4.0 / 5.0).abs() < 1e-9);
        assert!((innovation.nis.value - 9.0 / 5.0).abs() < 1e-9);
    }
}
