//! Interacting multiple models (Blom and Bar-Shalom 1988) over level turns.

use bnkf_model_export::radar::reading::Reading;

use super::ahead::{Ahead, parts_s, try_forecasts};
use super::clock::Clock;
use super::correction::{Correction, Innovation};
use super::discrete::Discrete;
use super::gaussian::Gaussian;
use super::mixture::{Component, moments, nis, reweigh};
use super::origin::Origin;
use super::turn::Turn;
use crate::filter::{Filter, FilterError, Forecasts, HORIZONS_US, PositionEstimate, Start};

/// M extended Kalman filters that exchange their beliefs before every step.
#[derive(Clone, Debug)]
pub struct Imm<const M: usize> {
    models: [Turn; M],
    /// Mean time a target stays with one model, s.
    sojourn_s: f64,
    origin: Origin,
    belief: Option<(Clock, [Component<6>; M])>,
    steps: [Option<Discrete<6>>; M],
    ahead: [Ahead<6>; M],
}

impl<const M: usize> Imm<M> {
    /// A filter that has not been started. All models are equally likely at the start, and a
    /// target that leaves one (on average after `sojourn_s`) goes to any other.
    pub fn new(models: [Turn; M], sojourn_s: f64, origin: Origin) -> Self {
        Self {
            models,
            sojourn_s,
            origin,
            belief: None,
            steps: [None; M],
            ahead: [Ahead::default(); M],
        }
    }

    /// The models' beliefs at the last step, in the order of the models.
    pub fn modes(&self) -> Option<&[Component<6>; M]> {
        self.belief.as_ref().map(|(_, modes)| modes)
    }

    /// The mixture of the models' beliefs at the last step.
    pub fn belief(&self) -> Option<Gaussian<6>> {
        self.modes()
            .map(|modes| moments(modes, |i| modes[i].probability))
    }

    /// The beliefs that enter the next step: mixed by the probability of having come from each
    /// model, with the models' predicted probabilities.
    fn mixed(&self, modes: &[Component<6>; M], dt_s: f64) -> [Component<6>; M] {
        // The exact chain in continuous time: a long gap evens the models out.
        let m = M as f64;
        let kept = if M > 1 {
            (-dt_s / self.sojourn_s * m / (m - 1.0)).exp()
        } else {
            1.0
        };
        // Above zero even for no time at all: a probability that underflowed must not stay zero.
        let leave = ((1.0 - kept) / m).max(f64::EPSILON);
        let stay = kept + leave;
        core::array::from_fn(|to| {
            let weight =
                |from: usize| modes[from].probability * if from == to { stay } else { leave };
            let probability: f64 = (0..M).map(weight).sum();
            let state = moments(modes, |from| weight(from) / probability);
            Component { probability, state }
        })
    }
}

impl<const M: usize> Filter for Imm<M> {
    fn start(&mut self, start: &Start<'_>) -> Result<PositionEstimate, FilterError> {
        let state = self.origin.belief(start)?;
        let mode = Component {
            state,
            probability: 1.0 / M as f64,
        };
        self.belief = Some((Clock::new(start.reading.time_us), [mode; M]));
        state.position_estimate(None)
    }

    fn step(
        &mut self,
        time_us: u64,
        reading: Option<&Reading>,
    ) -> Result<PositionEstimate, FilterError> {
        let (mut clock, modes) = self.belief.ok_or(FilterError::NotStarted)?;
        let dt_s = clock.advance_s(time_us)?;
        let mut modes = self.mixed(&modes, dt_s);
        for ((mode, model), last) in modes.iter_mut().zip(&self.models).zip(&mut self.steps) {
            mode.state = mode.state.predicted(Discrete::kept(last, model, dt_s));
        }
        let mut consistency = None;
        if let Some(reading) = reading {
            let observation = self.origin.observation(reading);
            let mut innovations = [Innovation::default(); M];
            for (mode, innovation) in modes.iter_mut().zip(&mut innovations) {
                (mode.state, *innovation) =
                    Correction::Extended.apply(&mode.state, &observation)?;
            }
            consistency = Some(nis(&modes, &innovations)?);
            reweigh(&mut modes, &innovations)?;
        }
        self.belief = Some((clock, modes));
        moments(&modes, |i| modes[i].probability).position_estimate(consistency)
    }

    /// The models exchange their beliefs before every horizon, as before a step.
    fn forecast(&mut self, times_us: &[u64; HORIZONS_US.len()]) -> Result<Forecasts, FilterError> {
        let (clock, mut modes) = self.belief.ok_or(FilterError::NotStarted)?;
        let parts_s = parts_s(clock, times_us)?;
        try_forecasts(|horizon| {
            let part_s = parts_s[horizon];
            modes = self.mixed(&modes, part_s);
            for ((mode, model), ahead) in modes.iter_mut().zip(&self.models).zip(&mut self.ahead) {
                mode.state = mode.state.predicted(ahead.step(horizon, model, part_s));
            }
            moments(&modes, |i| modes[i].probability).position_estimate(None)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baseline::bank::{FiveTurns, SOJOURN_S};
    use crate::baseline::prior::tests::PRIOR;
    use crate::baseline::sensor::expected;
    use bnkf_model_export::radar::pose::Pose;
    use nalgebra::{Vector3, Vector6};

    const ORIGIN: Origin = Origin::Population(PRIOR);

    fn reading(time_us: u64, state: &Vector6<f64>) -> Reading {
        let z = expected(
            &state.fixed_rows::<3>(0).into(),
            &state.fixed_rows::<3>(3).into(),
        );
        Reading {
            time_us,
            elevation_rad: z[0],
            azimuth_rad: z[1],
            range_m: z[2],
            range_rate_mps: z[3],
            sigma_range_m: 1.0,
            sigma_elevation_rad: 0.001,
            sigma_azimuth_rad: 0.001,
            sigma_range_rate_mps: 0.01,
            sensor: Pose::ORIGIN,
            late_us: 0,
        }
    }

    fn started<const M: usize>(mut filter: Imm<M>, state: &Vector6<f64>) -> Imm<M> {
        let reading = reading(0, state);
        let (p, v) = (Vector3::zeros(), Vector3::zeros());
        let start = Start {
            reading: &reading,
            true_position_m: p,
            true_velocity_mps: v,
        };
        assert!(filter.start(&start).is_ok());
        filter
    }

    #[test]
    fn the_turn_that_is_flown_becomes_the_likeliest() {
        let turns = FiveTurns {
            turn_rate_radps: 0.8,
            damping_per_s: 0.0,
            q_m2_s3: 0.05,
        };
        for (part, expected_mode) in [(-0.5, 1), (1.0, 4)] {
            let flown = Turn {
                turn_rate_radps: part * turns.turn_rate_radps,
                damping_per_s: 0.0,
                q_m2_s3: 0.0,
            };
            let step = Discrete::new(&flown, 0.1);
            let mut state = Vector6::new(20.0, 15.0, 10.0, 2.0, 1.0, 0.0);
            let mut filter = started(Imm::five(&turns, ORIGIN), &state);
            for k in 1..=60 {
                state = step.transition * state;
                let reading = reading(k * 100_000, &state);
                assert!(filter.step(reading.time_us, Some(&reading)).is_ok());
            }
            let modes = filter.modes().unwrap();
            let sum: f64 = modes.iter().map(|mode| mode.probability).sum();
            assert!((sum - 1.0).abs() < 1e-12);
            assert!(modes[expected_mode].probability > 0.5, "{modes:?}");
        }
    }

    /// In a gap the models forget towards equal shares, at the rate of the switching.
    #[test]
    fn a_long_gap_evens_the_models_out() {
        let state = Vector6::new(20.0, 15.0, 10.0, 2.0, 1.0, 0.0);
        let mut filter = started(Imm::wide(ORIGIN), &state);
        for k in 1..=20 {
            let reading = reading(k * 100_000, &state);
            assert!(filter.step(reading.time_us, Some(&reading)).is_ok());
        }
        let spread = |filter: &Imm<10>| {
            let modes = filter.modes().unwrap();
            modes
                .iter()
                .map(|mode| (mode.probability - 0.1).abs())
                .fold(0.0, f64::max)
        };
        let before = spread(&filter);
        let estimate = filter.step(102_000_000, None).unwrap();
        assert!(before > 0.05 && spread(&filter) < 1e-9);
        assert!(estimate.covariance_m2.cholesky().is_some());
    }

    /// A bank of equal models is one Kalman filter.
    #[test]
    fn equal_models_are_one_filter() {
        let model = Turn {
            turn_rate_radps: 0.3,
            damping_per_s: 0.1,
            q_m2_s3: 0.5,
        };
        let state = Vector6::new(20.0, 15.0, 10.0, 2.0, 1.0, 0.0);
        let mut bank = started(Imm::new([model; 3], SOJOURN_S, ORIGIN), &state);
        let mut one = started(Imm::new([model], SOJOURN_S, ORIGIN), &state);
        for k in 1..=30 {
            let reading = (k % 3 != 0).then(|| reading(k * 100_000, &state));
            let a = bank.step(k * 100_000, reading.as_ref()).unwrap();
            let b = one.step(k * 100_000, reading.as_ref()).unwrap();
            assert!((a.position_m - b.position_m).norm() < 1e-9);
            assert!((a.covariance_m2 - b.covariance_m2).norm() < 1e-9);
            assert_eq!(a.nis.is_some(), reading.is_some());
        }
    }
}
