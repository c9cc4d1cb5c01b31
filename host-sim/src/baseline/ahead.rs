//! What baselines need to forecast: times as parts, and their models' steps over these.

use super::clock::Clock;
use super::discrete::Discrete;
use super::motion::Motion;
use crate::filter::{FilterError, Forecasts, HORIZONS_US, PositionEstimate};

/// Steps of one motion model from each horizon to the next, kept while they do not change.
#[derive(Clone, Copy, Debug)]
pub struct Ahead<const N: usize> {
    steps: [Option<Discrete<N>>; HORIZONS_US.len()],
}

impl<const N: usize> Default for Ahead<N> {
    fn default() -> Self {
        Self {
            steps: [None; HORIZONS_US.len()],
        }
    }
}

impl<const N: usize> Ahead<N> {
    /// The step of `part_s` seconds to horizon `number`.
    pub fn step(&mut self, number: usize, motion: &impl Motion<N>, part_s: f64) -> &Discrete<N> {
        Discrete::kept(&mut self.steps[number], motion, part_s)
    }
}

/// Seconds from `clock` to the first of `times_us` and from each of them to the next.
///
/// # Errors
/// [`FilterError::TimeWentBack`]
pub fn parts_s(
    mut clock: Clock,
    times_us: &[u64; HORIZONS_US.len()],
) -> Result<[f64; HORIZONS_US.len()], FilterError> {
    let mut parts_s = [0.0; HORIZONS_US.len()];
    for (part_s, time_us) in parts_s.iter_mut().zip(times_us) {
        *part_s = clock.advance_s(*time_us)?;
    }
    Ok(parts_s)
}

/// The forecasts at every horizon's number, in order.
///
/// # Errors
/// The first of `forecast`.
pub fn try_forecasts(
    mut forecast: impl FnMut(usize) -> Result<PositionEstimate, FilterError>,
) -> Result<Forecasts, FilterError> {
    Ok([forecast(0)?, forecast(1)?, forecast(2)?])
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use crate::baseline::correction::Correction;
    use crate::baseline::gated::Gated;
    use crate::baseline::gated::tests::reading;
    use crate::baseline::imm::Imm;
    use crate::baseline::kalman::Kalman;
    use crate::baseline::memoryless::{Memoryless, Rule};
    use crate::baseline::origin::Origin;
    use crate::baseline::prior::tests::PRIOR;
    use crate::baseline::rao_blackwell::RaoBlackwell;
    use crate::baseline::singer::Singer;
    use crate::filter::{Filter, FilterError, HORIZONS_US, Start};

    const SINGER: Singer = Singer {
        acceleration_sigma_mps2: 1.7,
        correlation_time_s: 0.8,
        damping_per_s: 0.5,
        q_m2_s3: 0.3,
    };
    const TIMES_US: [u64; HORIZONS_US.len()] = [2_500_000, 3_000_000, 4_000_000];

    /// A forecast is what a copy says in a gap from horizon to horizon, and leaves no trace.
    fn assert_like_a_gap<F: Filter + Clone>(mut filter: F) {
        let first = reading(0, 0.0);
        let start = Start {
            reading: &first,
            true_position_m: Vector3::new(28.0, 0.0, 9.0),
            true_velocity_mps: Vector3::new(0.5, 0.2, 0.1),
        };
        assert_eq!(filter.forecast(&TIMES_US), Err(FilterError::NotStarted));
        assert!(filter.start(&start).is_ok());
        for step in 1..=20 {
            let azimuth_rad = 0.003 * step as f64;
            let seen = reading(step * 100_000, azimuth_rad);
            assert!(filter.step(seen.time_us, Some(&seen)).is_ok());
        }
        let (mut gap, mut quiet) = (filter.clone(), filter.clone());
        let forecasts = filter.forecast(&TIMES_US).unwrap();
        for (own, time_us) in forecasts.iter().zip(TIMES_US) {
            let expected = gap.step(time_us, None).unwrap();
            assert!((own.position_m - expected.position_m).norm() < 1e-9);
            let away = (own.covariance_m2 - expected.covariance_m2).norm();
            assert!(away < 1e-9 * expected.covariance_m2.norm(), "{away}");
        }
        let next = reading(2_100_000, 0.06);
        assert_eq!(
            filter.step(next.time_us, Some(&next)),
            quiet.step(next.time_us, Some(&next))
        );
        let past = [0, 3_000_000, 4_000_000];
        assert_eq!(filter.forecast(&past), Err(FilterError::TimeWentBack));
    }

    #[test]
    fn every_baseline_forecasts_as_in_a_gap() {
        let origin = Origin::Population(PRIOR);
        assert_like_a_gap(Kalman::new(SINGER, Correction::Extended, origin));
        assert_like_a_gap(Imm::wide(origin));
        assert_like_a_gap(RaoBlackwell::new(SINGER, PRIOR, 1));
        for rule in Rule::ALL {
            assert_like_a_gap(Memoryless::new(rule, PRIOR));
        }
        assert_like_a_gap(Gated::new(Imm::wide(origin), PRIOR.range_m.sigma));
    }

    #[test]
    fn a_constant_velocity_is_forecast_exactly() {
        let mut filter = Kalman::paper_ekf();
        let first = reading(0, 0.0);
        let start = Start {
            reading: &first,
            true_position_m: Vector3::new(28.0, 3.0, 9.0),
            true_velocity_mps: Vector3::new(1.5, -2.0, 0.5),
        };
        assert!(filter.start(&start).is_ok());
        let forecasts = filter.forecast(&HORIZONS_US).unwrap();
        for (own, time_s) in forecasts.iter().zip([0.5, 1.0, 2.0]) {
            let truth_m = start.true_position_m + start.true_velocity_mps * time_s;
            assert!((own.position_m - truth_m).norm() < 1e-12);
            // P_pp + t^2 P_vv + q t^3 / 3 with P_pp = 1, P_vv = 0.01, q = 0.1.
            let variance = 1.0 + 0.01 * time_s * time_s + 0.1 * time_s.powi(3) / 3.0;
            assert!((own.covariance_m2[(1, 1)] - variance).abs() < 1e-12);
        }
    }
}
