//! Where and how fast targets are that the model was trained for, and how far beyond that it is asked.

use super::population::Population;
use super::state::{Covariance, State, position_variance};
use crate::scalar::Scalar;

/// After a longer silence the network is not asked any more, and the next measurement starts the
/// filter anew, s. So the network's work in one call is bounded.
pub const SILENCE_MAX_S: f32 = 10.0;
/// Deviations of the population's range and elevation within which most of its targets are.
const HOME_SIGMAS: f32 = 3.5;
/// Deviations of the population's range that a position may be unsure by for the network to be asked
/// about targets that are not at home: what it knows of places it knows of home, and where the
/// measurements say little it would speak of that.
const UNSURE_MAX: f32 = 0.7;
/// The same for targets that seem faster than any it was trained for: where measurements say little such
/// a speed is more often wrong than true, and the wide base model finds back.
const UNSURE_FAST_MAX: f32 = 1.0;
/// How many times the largest speed and acceleration of the training the network is asked for. Its features are kept within
/// a few deviations, so what is faster still looks to it like the fastest that it knows.
const REACH: f32 = 3.0;
/// How long after its last measurement the network is asked about what moves as nothing in its training, s: in a longer silence
/// it would slow it down to what it knows.
const UNSEEN_MAX_S: f32 = 1.0;
/// How many times the largest range.
const REACH_RANGE: f32 = 10.0;

/// What a model was trained for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds<S> {
    /// Largest speed, m/s.
    pub speed_max_mps: S,
    /// Largest acceleration, m/s^2.
    pub acceleration_max_mps2: S,
    /// Least and largest range, m.
    pub range_m: [S; 2],
    /// Least and largest elevation, rad.
    pub elevation_rad: [S; 2],
}

impl Bounds<f64> {
    /// Small drones within 100 m, nearly anywhere.
    pub const PAPER: Self = Self {
        speed_max_mps: 16.0,
        acceleration_max_mps2: 25.0,
        range_m: [3.0, 100.0],
        elevation_rad: [-1.45, 1.571],
    };

    /// Drones of up to 25 m/s at 0.3 to 3 km, with room.
    pub const COUNTER_UAS: Self = Self {
        speed_max_mps: 45.0,
        acceleration_max_mps2: 40.0,
        range_m: [100.0, 4000.0],
        elevation_rad: [-0.2, 1.2],
    };

    /// In single precision, as a blob holds them.
    pub fn single(&self) -> Bounds<f32> {
        Bounds {
            speed_max_mps: self.speed_max_mps as f32,
            acceleration_max_mps2: self.acceleration_max_mps2 as f32,
            range_m: self.range_m.map(|x| x as f32),
            elevation_rad: self.elevation_rad.map(|x| x as f32),
        }
    }
}

/// The bounds of a model, as they are asked for at every step.
#[derive(Clone, Copy, Debug)]
pub struct Envelope {
    /// Largest speed of the training, m/s.
    pub speed_max_mps: f32,
    /// Largest acceleration of the training, m/s^2.
    pub acceleration_max_mps2: f32,
    bounds: Place,
    home: Place,
    /// Variance of the population's range, m^2.
    range_m2: f32,
}

/// What predicts a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Predictor {
    /// The network.
    Network,
    /// The base model that it schedules: nothing is known of such a place, or any more.
    Base,
    /// A wide one: nothing is known of such a motion.
    Wide,
}

/// A range of ranges and one of elevations.
#[derive(Clone, Copy, Debug)]
struct Place {
    range_m: [f32; 2],
    /// Least and largest sine of the elevation.
    elevation_sine: [f32; 2],
}

impl Place {
    fn new(range_m: [f32; 2], elevation_rad: [f32; 2]) -> Self {
        let right_angle = core::f32::consts::FRAC_PI_2;
        Self {
            range_m,
            elevation_sine: elevation_rad
                .map(|angle| Scalar::sin(angle.clamp(-right_angle, right_angle))),
        }
    }

    fn holds(&self, range_m: f32, height_m: f32) -> bool {
        let [least, most] = self.range_m;
        let [low, high] = self.elevation_sine;
        (least..=most).contains(&range_m) && (low * range_m..=high * range_m).contains(&height_m)
    }
}

impl Envelope {
    /// The envelope that a blob's bounds and population make.
    pub fn of(bounds: &Bounds<f32>, population: &Population<f32>) -> Self {
        let p = population;
        let about =
            |mean: f32, sigma: f32| [mean - HOME_SIGMAS * sigma, mean + HOME_SIGMAS * sigma];
        Self {
            speed_max_mps: bounds.speed_max_mps,
            acceleration_max_mps2: bounds.acceleration_max_mps2,
            bounds: Place::new(bounds.range_m, bounds.elevation_rad),
            home: Place::new(
                about(p.range_m, p.range_sigma_m),
                about(p.elevation_rad, p.elevation_sigma_rad),
            ),
            range_m2: p.range_sigma_m * p.range_sigma_m,
        }
    }

    /// Whether the model was trained for such a place and motion.
    pub fn holds(&self, state: &State<f32>) -> bool {
        self.bounds.holds(length(state, 0), state[2])
            && length(state, 3) < self.speed_max_mps
            && length(state, 6) < self.acceleration_max_mps2
    }

    /// What predicts a target that was measured last `coast_s` ago.
    // Apart: where it is laid into its caller, what follows there lies in flash twice.
    #[inline(never)]
    pub fn predictor(
        &self,
        state: &State<f32>,
        covariance: &Covariance<f32>,
        coast_s: f32,
    ) -> Predictor {
        if !self.reaches_motion(state, covariance, coast_s) {
            Predictor::Wide
        } else if coast_s > SILENCE_MAX_S || !self.reaches_place(state, covariance) {
            Predictor::Base
        } else {
            Predictor::Network
        }
    }

    /// Whether the network is asked about such a motion.
    fn reaches_motion(
        &self,
        state: &State<f32>,
        covariance: &Covariance<f32>,
        coast_s: f32,
    ) -> bool {
        let (speed, acceleration) = (length(state, 3), length(state, 6));
        let slow = speed < self.speed_max_mps;
        let trained = slow && acceleration < self.acceleration_max_mps2;
        let beyond = (slow || self.is_known(covariance, UNSURE_FAST_MAX))
            && coast_s < UNSEEN_MAX_S
            && speed < REACH * self.speed_max_mps
            && acceleration < REACH * self.acceleration_max_mps2;
        trained || beyond
    }

    /// Whether the network is asked about such a place: at home, or where it is known well enough, at any elevation, nearer
    /// than ten times the largest range.
    fn reaches_place(&self, state: &State<f32>, covariance: &Covariance<f32>) -> bool {
        let range = length(state, 0);
        let at_home = self.home.holds(range, state[2]);
        (at_home || self.is_known(covariance, UNSURE_MAX))
            && range < REACH_RANGE * self.bounds.range_m[1]
    }

    /// Whether the position is known to so many deviations of the population's range.
    fn is_known(&self, covariance: &Covariance<f32>, deviations: f32) -> bool {
        position_variance(covariance) < deviations * deviations * self.range_m2
    }
}

/// Length of three of the state's numbers.
fn length(state: &State<f32>, from: usize) -> f32 {
    let [x, y, z] = [state[from], state[from + 1], state[from + 2]];
    crate::kernel::sqrt(x * x + y * y + z * z)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn envelope() -> Envelope {
        let bounds = Bounds {
            speed_max_mps: 8.25,
            acceleration_max_mps2: 19.05,
            range_m: [15.0, 45.0],
            elevation_rad: [0.2, 0.8],
        };
        Envelope::of(&bounds, &Population::PAPER.known())
    }

    fn placed(range: f32, elevation: f32) -> State<f32> {
        let (s, c) = elevation.sin_cos();
        [
            0.6 * range * c,
            -0.8 * range * c,
            range * s,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
        ]
    }

    #[test]
    fn the_volume_ends_where_it_is_said_to() {
        let envelope = envelope();
        for (range, elevation, inside) in [
            (30.0, 0.5, true),
            (15.1, 0.5, true),
            (14.9, 0.5, false),
            (44.9, 0.5, true),
            (45.1, 0.5, false),
            (30.0, 0.79, true),
            (30.0, 0.81, false),
            (30.0, 0.21, true),
            (30.0, 0.19, false),
            (30.0, -0.5, false),
        ] {
            let holds = envelope.holds(&placed(range, elevation));
            assert_eq!(holds, inside, "{range} {elevation}");
        }
    }

    fn spread(variance: f32) -> Covariance<f32> {
        let mut covariance = [[0.0; 9]; 9];
        for (i, row) in covariance.iter_mut().enumerate() {
            row[i] = variance / 3.0;
        }
        covariance
    }

    /// 33.5 m and 0.5 rad, with deviations of 6 m and 0.21 rad: beyond 3.5 of them a position must
    /// be known to 4.2 m, and beyond 1 km nobody is asked.
    #[test]
    fn away_from_home_a_position_must_be_known() {
        let envelope = Envelope::of(&Bounds::PAPER.single(), &Population::PAPER.known());
        for (range, elevation, variance, asked) in [
            (33.5, 0.5, 100.0, true),
            (33.5, 1.23, 100.0, true),
            (33.5, 1.24, 100.0, false),
            (33.5, 1.24, 17.6, true),
            (33.5, 1.24, 17.7, false),
            (33.5, -0.24, 17.7, false),
            (33.5, -1.55, 17.6, true),
            (1.0, 0.5, 17.6, true),
            (55.0, 0.5, 17.7, false),
            (55.0, 0.5, 17.6, true),
            (999.0, 0.5, 1.0, true),
            (1001.0, 0.5, 1.0, false),
        ] {
            let reaches = envelope.reaches_place(&placed(range, elevation), &spread(variance));
            assert_eq!(reaches, asked, "{range} {elevation} {variance}");
        }
    }

    fn moving(speed: f32, acceleration: f32) -> State<f32> {
        let mut state = placed(30.0, 0.5);
        (state[3], state[4], state[5]) = (0.6 * speed, 0.0, -0.8 * speed);
        (state[6], state[7], state[8]) = (0.0, -0.8 * acceleration, 0.6 * acceleration);
        state
    }

    #[test]
    fn the_motion_ends_where_it_is_said_to() {
        let envelope = envelope();
        for (speed, acceleration, inside) in [
            (0.0, 0.0, true),
            (8.2, 0.0, true),
            (8.3, 0.0, false),
            (0.0, 19.0, true),
            (0.0, 19.1, false),
        ] {
            let state = moving(speed, acceleration);
            assert_eq!(envelope.holds(&state), inside, "{speed} {acceleration}");
        }
    }

    /// Three times the training's motion; faster than any of it only while the position is known to 6 m.
    #[test]
    fn the_network_is_asked_beyond_the_motion_of_the_training() {
        let envelope = envelope();
        for (speed, acceleration, variance, asked) in [
            (8.2, 57.1, 1e4, true),
            (8.2, 57.2, 1.0, false),
            (8.3, 0.0, 35.9, true),
            (8.3, 0.0, 36.1, false),
            (24.7, 57.1, 35.9, true),
            (24.8, 0.0, 1.0, false),
        ] {
            let state = moving(speed, acceleration);
            let reaches = envelope.reaches_motion(&state, &spread(variance), 0.9);
            assert_eq!(reaches, asked, "{speed} {acceleration} {variance}");
            // In a silence it is asked about what it knows.
            let silent = envelope.reaches_motion(&state, &spread(variance), 1.0);
            assert_eq!(silent, speed < 8.25 && acceleration < 19.05);
        }
    }

    /// What equals a bound of motion is outside; a place's bounds belong to it.
    #[test]
    fn bounds_are_exact() {
        let bounds = Bounds {
            speed_max_mps: 5.0,
            acceleration_max_mps2: 13.0,
            range_m: [5.0, 50.0],
            elevation_rad: [-2.0, 2.0],
        };
        let envelope = Envelope::of(&bounds, &Population::PAPER.known());
        let moving = |velocity: [f32; 3], acceleration: [f32; 3]| {
            let mut state = placed(30.0, 0.5);
            state[3..6].copy_from_slice(&velocity);
            state[6..].copy_from_slice(&acceleration);
            state
        };
        for (velocity, acceleration, inside) in [
            ([3.0, 0.0, 3.99], [12.0, 4.99, 0.0], true),
            ([3.0, 0.0, 4.0], [12.0, 4.99, 0.0], false),
            ([0.0, 4.0, -3.0], [0.0; 3], false),
            ([0.0; 3], [12.0, -5.0, 0.0], false),
            ([0.0; 3], [0.0, 12.0, 5.0], false),
        ] {
            let state = moving(velocity, acceleration);
            assert_eq!(
                envelope.holds(&state),
                inside,
                "{velocity:?} {acceleration:?}"
            );
            // Three times as much is where the network is not asked any more.
            let thrice = moving(velocity.map(|v| 3.0 * v), acceleration.map(|a| 3.0 * a));
            assert_eq!(envelope.reaches_motion(&thrice, &spread(0.1), 0.0), inside);
        }
        let at = |x: f32, z: f32| [x, 0.0, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        // Straight up and down are elevations of a right angle, within two radians.
        for (state, inside) in [
            (at(3.0, 4.0), true),
            (at(30.0, 40.0), true),
            (at(0.0, 20.0), true),
            (at(0.0, -20.0), true),
            (at(30.0, 40.1), false),
            (at(3.0, 3.9), false),
        ] {
            assert_eq!(envelope.holds(&state), inside, "{state:?}");
        }
        // Five hundred metres are too far, and a variance of 36 m^2, of the 6 m of the population, is too unsure for
        // what is too fast.
        assert!(envelope.reaches_place(&at(300.0, 399.0), &spread(0.1)));
        assert!(!envelope.reaches_place(&at(300.0, 400.0), &spread(0.1)));
        let mut unsure = spread(0.0);
        (unsure[0][0], unsure[1][1], unsure[2][2]) = (12.0, 12.0, 12.0);
        let fast = moving([5.0, 0.0, 0.0], [0.0; 3]);
        assert!(!envelope.reaches_motion(&fast, &unsure, 0.0));
        unsure[2][2] = 11.9;
        assert!(envelope.reaches_motion(&fast, &unsure, 0.0));
    }

    #[test]
    fn single_bounds_are_the_same_numbers() {
        let single = Bounds::COUNTER_UAS.single();
        assert_eq!(
            (single.speed_max_mps, single.acceleration_max_mps2),
            (45.0, 40.0)
        );
        assert_eq!(single.range_m, [100.0, 4000.0]);
        assert_eq!(single.elevation_rad, [-0.2, 1.2]);
    }
}
