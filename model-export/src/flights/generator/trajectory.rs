//! The motion of one flight, known at every instant.

use super::course::Course;
use super::vehicle::{STEP_S, State, Vehicle};
use crate::random_source::RandomSource;
use nalgebra::Vector3;

/// States every [`STEP_S`] seconds with the acceleration held until the next.
#[derive(Clone, Debug)]
pub struct Trajectory {
    steps: Vec<(State, Vector3<f64>)>,
}

impl Trajectory {
    /// Flies `course` for at least `duration_s` seconds.
    pub fn fly(
        mut course: Course,
        mut vehicle: Vehicle,
        duration_s: f64,
        random: &mut RandomSource,
    ) -> Self {
        let count = (duration_s / STEP_S).ceil() as usize + 1;
        let mut state = course.start();
        let steps = (0..count)
            .map(|k| {
                let command_mps2 = course.command(k as f64 * STEP_S, &state, random);
                let acceleration_mps2 = vehicle.respond(command_mps2, random);
                let step = (state, acceleration_mps2);
                state = state.after(STEP_S, acceleration_mps2);
                step
            })
            .collect();
        Self { steps }
    }

    /// The state at `t_s` seconds, exact between steps; times outside continue the nearest step.
    pub fn at(&self, t_s: f64) -> State {
        // Negative times saturate to step 0.
        let k = ((t_s / STEP_S) as usize).min(self.steps.len() - 1);
        let (state, acceleration_mps2) = self.steps[k];
        state.after(t_s - k as f64 * STEP_S, acceleration_mps2)
    }

    /// Highest speed at any step, metres per second.
    pub fn speed_mps_max(&self) -> f64 {
        self.steps
            .iter()
            .map(|(state, _)| state.velocity_mps.norm())
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::{Course, Trajectory, Vehicle};
    use crate::random_source::RandomSource;
    use proptest::prelude::*;

    fn trajectory(seed: u64) -> Trajectory {
        let mut random = RandomSource::new(seed, &[]);
        let vehicle = Vehicle::draw(&mut random);
        let course = Course::draw(&mut random, &vehicle, 20.0);
        Trajectory::fly(course, vehicle, 20.0, &mut random)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn motion_is_continuous_and_velocity_is_its_derivative(
            seed in any::<u64>(), t_s in 0.1..19.9_f64
        ) {
            let flown = trajectory(seed);
            let h_s = 1e-5;
            let (before, here, after) =
                (flown.at(t_s - h_s), flown.at(t_s), flown.at(t_s + h_s));
            let slope_mps = (after.position_m - before.position_m) / (2.0 * h_s);
            // Acceleration stays below 10 m/s^2, so does its change across a step boundary.
            prop_assert!((slope_mps - here.velocity_mps).norm() < 10.0 * h_s);
            prop_assert!((after.velocity_mps - before.velocity_mps).norm() < 20.0 * h_s);
            prop_assert!(here.velocity_mps.norm() <= flown.speed_mps_max() + 0.1);
        }
    }

    #[test]
    fn times_outside_are_answered() {
        let flown = trajectory(1);
        for t_s in [-0.005, 0.0, 20.0, 20.005] {
            let state = flown.at(t_s);
            assert!(state.position_m.norm() < 30.0 && state.velocity_mps.norm() < 10.0);
        }
    }
}
