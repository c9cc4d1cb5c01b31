//! The Kalman filter over a linear motion model: EKF, UKF or CKF by its correction.

use bnkf_model_export::radar::reading::Reading;

use super::ahead::{Ahead, parts_s, try_forecasts};
use super::clock::Clock;
use super::correction::Correction;
use super::discrete::Discrete;
use super::gaussian::Gaussian;
use super::motion::{Motion, WhiteAcceleration};
use super::origin::Origin;
use super::sigma_points::Spread;
use crate::filter::{Filter, FilterError, Forecasts, HORIZONS_US, PositionEstimate, Start};

/// Process noise of the paper's EKF and UKF at every noise level, m^2/s^3.
pub const PAPER_Q_M2_S3: f64 = 0.1;

/// A Gaussian belief moved by `motion` and corrected by `correction`.
#[derive(Clone, Debug)]
pub struct Kalman<M, const N: usize> {
    motion: M,
    correction: Correction,
    origin: Origin,
    belief: Option<(Clock, Gaussian<N>)>,
    step: Option<Discrete<N>>,
    ahead: Ahead<N>,
}

impl<M: Motion<N>, const N: usize> Kalman<M, N> {
    /// A filter that has not been started.
    pub fn new(motion: M, correction: Correction, origin: Origin) -> Self {
        Self {
            motion,
            correction,
            origin,
            belief: None,
            step: None,
            ahead: Ahead::default(),
        }
    }

    /// The belief at the last step.
    pub fn belief(&self) -> Option<&Gaussian<N>> {
        self.belief.as_ref().map(|(_, state)| state)
    }
}

impl Kalman<WhiteAcceleration, 6> {
    /// The paper's EKF: truth start, q = 0.1 m^2/s^3.
    pub fn paper_ekf() -> Self {
        let motion = WhiteAcceleration {
            q_m2_s3: PAPER_Q_M2_S3,
        };
        Self::new(motion, Correction::Extended, Origin::Truth)
    }

    /// The paper's UKF with a spread that stays finite, see [`Spread::UNIT`].
    pub fn paper_ukf() -> Self {
        let motion = WhiteAcceleration {
            q_m2_s3: PAPER_Q_M2_S3,
        };
        Self::new(motion, Correction::SigmaPoints(Spread::UNIT), Origin::Truth)
    }
}

impl<M: Motion<N>, const N: usize> Filter for Kalman<M, N> {
    fn start(&mut self, start: &Start<'_>) -> Result<PositionEstimate, FilterError> {
        let state = self.motion.initial(&self.origin.belief(start)?);
        self.belief = Some((Clock::new(start.reading.time_us), state));
        state.position_estimate(None)
    }

    fn step(
        &mut self,
        time_us: u64,
        reading: Option<&Reading>,
    ) -> Result<PositionEstimate, FilterError> {
        let (clock, state) = self.belief.as_mut().ok_or(FilterError::NotStarted)?;
        let dt_s = clock.advance_s(time_us)?;
        *state = state.predicted(Discrete::kept(&mut self.step, &self.motion, dt_s));
        let Some(reading) = reading else {
            return state.position_estimate(None);
        };
        let (after, innovation) = self
            .correction
            .apply(state, &self.origin.observation(reading))?;
        *state = after;
        state.position_estimate(Some(innovation.nis))
    }

    fn forecast(&mut self, times_us: &[u64; HORIZONS_US.len()]) -> Result<Forecasts, FilterError> {
        let (clock, mut state) = self.belief.ok_or(FilterError::NotStarted)?;
        let parts_s = parts_s(clock, times_us)?;
        try_forecasts(|horizon| {
            state = state.predicted(self.ahead.step(horizon, &self.motion, parts_s[horizon]));
            state.position_estimate(None)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bnkf_model_export::radar::pose::Pose;
    use nalgebra::Vector3;

    fn reading(time_us: u64) -> Reading {
        Reading {
            time_us,
            range_m: 30.0,
            elevation_rad: 0.3,
            azimuth_rad: 1.0,
            range_rate_mps: 1.0,
            sigma_range_m: 1.0,
            sigma_elevation_rad: 0.01,
            sigma_azimuth_rad: 0.01,
            sigma_range_rate_mps: 0.1,
            sensor: Pose::ORIGIN,
            late_us: 0,
        }
    }

    fn started() -> Kalman<WhiteAcceleration, 6> {
        let mut filter = Kalman::paper_ekf();
        let start = Start {
            reading: &reading(1000),
            true_position_m: Vector3::new(15.0, 24.0, 8.9),
            true_velocity_mps: Vector3::new(1.0, 0.0, 0.0),
        };
        assert!(filter.start(&start).is_ok());
        filter
    }

    #[test]
    fn misuse_is_named() {
        assert_eq!(
            Kalman::paper_ekf().step(0, None),
            Err(FilterError::NotStarted)
        );
        assert_eq!(started().step(999, None), Err(FilterError::TimeWentBack));
        let broken = Reading {
            range_m: f64::NAN,
            ..reading(2000)
        };
        assert_eq!(
            started().step(2000, Some(&broken)),
            Err(FilterError::NotFinite)
        );
    }

    #[test]
    fn a_gap_moves_the_mean_and_widens_the_covariance() {
        let mut filter = started();
        let after = filter.step(2_001_000, None).unwrap();
        assert!((after.position_m - Vector3::new(17.0, 24.0, 8.9)).norm() < 1e-12);
        // P_pp + dt^2 P_vv + q dt^3 / 3 with P_pp = 1, P_vv = 0.01, dt = 2, q = 0.1.
        let variance = 1.0 + 4.0 * 0.01 + 0.1 * 8.0 / 3.0;
        assert!((after.covariance_m2[(1, 1)] - variance).abs() < 1e-12);
        assert_eq!(after.nis, None);
    }
}
