//! Extrapolation through a gap from the last two measured estimates.
//!
//! The paper leaves gaps undefined. The rule here: the velocity is the difference of the last two
//! estimates, shrunk towards zero per axis by how uncertain that difference is beside the
//! population's velocities: with `d^2 = (P0 + P1) / age^2` and the population's `s^2`, the gain is
//! `s^2 / (s^2 + d^2)` and the variance left is `s^2 d^2 / (s^2 + d^2)`. After a time tau the
//! covariance is `P1 + tau^2 * variance left + (a tau^2 / 2)^2` with the population's acceleration
//! a. That the latest estimate's error is part of the velocity's, which would add `2 tau gain P1 / age`, is left
//! out. With one estimate only, the velocity is zero with the population's variance.

use nalgebra::{Matrix3, Vector3};

use crate::clock::seconds_between;

/// A measured estimate to extrapolate from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fix {
    pub time_us: u64,
    /// m
    pub position: Vector3<f32>,
    /// m^2
    pub covariance: Matrix3<f32>,
}

impl Fix {
    /// None: room for one.
    pub const NONE: Self = Self {
        time_us: 0,
        position: Vector3::new(0.0, 0.0, 0.0),
        covariance: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };
}

/// How targets of this kind move.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Population {
    /// Standard deviation of a velocity component, m/s.
    pub speed_sigma: f32,
    /// Standard deviation of an acceleration component, m/s^2.
    pub acceleration_sigma: f32,
}

/// The position at `time_us` from the latest fix and, if there is one, the fix before it.
pub(crate) fn extrapolate(
    latest: &Fix,
    before: Option<&Fix>,
    population: Population,
    time_us: u64,
) -> Fix {
    let tau = seconds_between(latest.time_us, time_us);
    let speed_variance = population.speed_sigma * population.speed_sigma;
    let mut velocity = Vector3::zeros();
    let mut variance = Vector3::repeat(speed_variance);
    if let Some(before) = before {
        let age = seconds_between(before.time_us, latest.time_us);
        if age > 0.0 {
            for axis in 0..3 {
                let difference = (latest.position[axis] - before.position[axis]) / age;
                let spread = latest.covariance[(axis, axis)] + before.covariance[(axis, axis)];
                let difference_variance = spread / (age * age);
                let gain = speed_variance / (speed_variance + difference_variance);
                velocity[axis] = gain * difference;
                variance[axis] = gain * difference_variance;
            }
        }
    }
    let drift = 0.5 * population.acceleration_sigma * tau * tau;
    let growth = variance * (tau * tau) + Vector3::repeat(drift * drift);
    Fix {
        time_us,
        position: latest.position + velocity * tau,
        covariance: latest.covariance + Matrix3::from_diagonal(&growth),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POPULATION: Population = Population {
        speed_sigma: 2.0,
        acceleration_sigma: 3.0,
    };

    fn fix(time_us: u64, x: f32, variance: f32) -> Fix {
        Fix {
            time_us,
            position: Vector3::new(x, 0.0, 10.0),
            covariance: Matrix3::identity() * variance,
        }
    }

    #[test]
    fn certain_fixes_give_their_velocity() {
        let out = extrapolate(
            &fix(100_000, 1.1, 1e-8),
            Some(&fix(0, 1.0, 1e-8)),
            POPULATION,
            300_000,
        );
        assert!((out.position.x - 1.3).abs() < 1e-4);
        assert!((out.position.z - 10.0).abs() < 1e-4);
    }

    /// The formulas by hand: 0.5 s between fixes of different doubt, 0.4 s ahead.
    #[test]
    fn a_coast_is_what_its_formulas_say() {
        let (latest, before) = (fix(600_000, 3.0, 0.5), fix(100_000, 1.0, 0.25));
        let out = extrapolate(&latest, Some(&before), POPULATION, 1_000_000);
        // Difference 4 m/s with a variance of 0.75 / 0.25 = 3; prior variance 4.
        let gain = 4.0 / 7.0;
        assert!((out.position.x - (3.0 + 0.4 * gain * 4.0)).abs() < 1e-5);
        let drift = 0.5 * 3.0 * 0.16;
        let expected = 0.5 + 0.16 * gain * 3.0 + drift * drift;
        assert!((out.covariance[(0, 0)] - expected).abs() < 1e-5);
        assert_eq!(out.covariance[(0, 1)], 0.0);
        // Two fixes of one time say nothing of the velocity.
        let same = extrapolate(
            &latest,
            Some(&fix(600_000, 1.0, 0.25)),
            POPULATION,
            1_000_000,
        );
        assert_eq!(same.position.x, 3.0);
        let alone = 0.5 + 0.16 * 4.0 + drift * drift;
        assert!((same.covariance[(0, 0)] - alone).abs() < 1e-5);
    }

    /// With one fix the velocity is nothing, and as unsure as the population's: 3 m/s.
    #[test]
    fn one_fix_stands_still_and_doubts() {
        let population = Population {
            speed_sigma: 3.0,
            acceleration_sigma: 5.0,
        };
        let out = extrapolate(&fix(0, 1.0, 0.5), None, population, 2_000_000);
        assert_eq!(out.position.x, 1.0);
        let expected = 0.5 + 9.0 * 4.0 + 10.0 * 10.0;
        assert!((out.covariance[(0, 0)] - expected).abs() < 1e-3);
    }

    #[test]
    fn uncertain_fixes_stand_still() {
        let out = extrapolate(
            &fix(100_000, 20.0, 100.0),
            Some(&fix(0, 1.0, 100.0)),
            POPULATION,
            300_000,
        );
        assert!((out.position.x - 20.0).abs() < 0.2);
    }

    #[test]
    fn covariance_grows_with_time() {
        let (latest, before) = (fix(100_000, 1.1, 0.04), fix(0, 1.0, 0.04));
        let mut last = 0.04;
        for time_us in (200_000..2_000_000).step_by(100_000) {
            let out = extrapolate(&latest, Some(&before), POPULATION, time_us);
            assert!(out.covariance[(0, 0)] > last);
            last = out.covariance[(0, 0)];
        }
        // 1.8 s: velocity variance below 4 (m/s)^2, drift (3 * 1.8^2 / 2)^2 = 23.6 m^2.
        assert!(last < 0.04 + 4.0 * 3.24 + 23.7);
    }
}
