//! The multirotor: it follows an acceleration command late, within limits, and in gusts.

use crate::random_source::RandomSource;
use nalgebra::Vector3;

/// Integration step, seconds.
pub const STEP_S: f64 = 0.01;
/// Correlation time of gusts, seconds.
const GUST_S: f64 = 0.7;

/// Motion at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    pub position_m: Vector3<f64>,
    pub velocity_mps: Vector3<f64>,
}

/// Limits and memory of one vehicle.
#[derive(Clone, Copy, Debug)]
pub struct Vehicle {
    /// Largest acceleration that the rotors give.
    pub acceleration_mps2_max: f64,
    /// Fastest change of that acceleration.
    pub jerk_mps3_max: f64,
    /// Time constant with which it follows a command.
    pub lag_s: f64,
    /// Standard deviation of the acceleration by gusts, per axis.
    pub gust_mps2: f64,
    /// Share of a gust that is left after [`STEP_S`].
    gust_kept: f64,
    thrust_mps2: Vector3<f64>,
    push_mps2: Vector3<f64>,
}

impl Vehicle {
    pub fn draw(random: &mut RandomSource) -> Self {
        Self {
            acceleration_mps2_max: random.uniform(3.0, 7.0),
            jerk_mps3_max: random.uniform(15.0, 40.0),
            lag_s: random.uniform(0.1, 0.35),
            gust_mps2: random.uniform(0.0, 0.5),
            gust_kept: libm::exp(-STEP_S / GUST_S),
            thrust_mps2: Vector3::zeros(),
            push_mps2: Vector3::zeros(),
        }
    }

    /// A vehicle in still air.
    #[cfg(test)]
    pub fn draw_calm(random: &mut RandomSource) -> Self {
        Self {
            gust_mps2: 0.0,
            ..Self::draw(random)
        }
    }

    /// The acceleration for the next [`STEP_S`] seconds under `command_mps2`.
    pub fn respond(
        &mut self,
        command_mps2: Vector3<f64>,
        random: &mut RandomSource,
    ) -> Vector3<f64> {
        let within = shortened(command_mps2, self.acceleration_mps2_max);
        let jerk_mps3 = (within - self.thrust_mps2) / self.lag_s;
        self.thrust_mps2 += shortened(jerk_mps3, self.jerk_mps3_max) * STEP_S;
        // First-order Gauss-Markov process with standard deviation `gust_mps2`.
        let kept = self.gust_kept;
        let fresh = self.gust_mps2 * (1.0 - kept * kept).sqrt();
        let draw = Vector3::new(random.normal(), random.normal(), random.normal());
        self.push_mps2 = self.push_mps2 * kept + draw * fresh;
        self.thrust_mps2 + self.push_mps2
    }
}

impl State {
    /// The state `time_s` later under a constant acceleration: exact.
    pub fn after(&self, time_s: f64, acceleration_mps2: Vector3<f64>) -> Self {
        Self {
            position_m: self.position_m
                + self.velocity_mps * time_s
                + acceleration_mps2 * (0.5 * time_s * time_s),
            velocity_mps: self.velocity_mps + acceleration_mps2 * time_s,
        }
    }
}

/// `vector`, shortened to `length_max` if it is longer.
pub fn shortened(vector: Vector3<f64>, length_max: f64) -> Vector3<f64> {
    let length = vector.norm();
    if length > length_max {
        vector * (length_max / length)
    } else {
        vector
    }
}

#[cfg(test)]
mod tests {
    use super::{STEP_S, Vehicle};
    use crate::random_source::RandomSource;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    #[test]
    fn a_step_command_is_followed_with_the_lag() {
        let mut random = RandomSource::new(1, &[]);
        let mut vehicle = Vehicle {
            gust_mps2: 0.0,
            jerk_mps3_max: 100.0,
            lag_s: 0.2,
            ..Vehicle::draw(&mut random)
        };
        let command = Vector3::new(1.0, 0.0, 0.0);
        let mut answers = (0..200).map(|_| vehicle.respond(command, &mut random).x);
        // 63% after one time constant of 20 steps; explicit Euler is 1% off.
        assert!((answers.nth(19).unwrap() - 0.632).abs() < 0.015);
        assert!((answers.last().unwrap() - 1.0).abs() < 1e-3);
    }

    #[test]
    fn gusts_have_their_standard_deviation() {
        let mut random = RandomSource::new(2, &[]);
        let mut vehicle = Vehicle {
            gust_mps2: 0.4,
            ..Vehicle::draw(&mut random)
        };
        let mut squares = 0.0;
        for _ in 0..200_000 {
            squares += vehicle
                .respond(Vector3::zeros(), &mut random)
                .norm_squared();
        }
        // 2,000 s hold about 1,400 independent gusts of three components.
        let sd = (squares / 600_000.0).sqrt();
        assert!((sd - 0.4).abs() < 0.03, "{sd}");
    }

    proptest! {
        #[test]
        fn acceleration_and_jerk_keep_their_limits(
            seed in any::<u64>(), scale in 0.0..1e6_f64
        ) {
            let mut random = RandomSource::new(seed, &[]);
            let mut vehicle = Vehicle::draw_calm(&mut random);
            let mut before = Vector3::zeros();
            for _ in 0..300 {
                let command =
                    Vector3::new(random.normal(), random.normal(), random.normal()) * scale;
                let now = vehicle.respond(command, &mut random);
                prop_assert!(now.norm() <= vehicle.acceleration_mps2_max * (1.0 + 1e-12));
                prop_assert!(
                    (now - before).norm() <= vehicle.jerk_mps3_max * STEP_S * (1.0 + 1e-9)
                );
                before = now;
            }
        }
    }
}
