//! Where and how fast targets are that the model was trained for.

use super::population::Population;
use super::state::{Covariance, State};
use crate::scalar::Scalar;

/// Deviations of the population's range and elevation within which most of its targets are.
const HOME_SIGMAS: f32 = 3.5;
/// Deviations of the population's range that a position may be unsure by for the network to be asked
/// about targets that are not at home: what it knows of places it knows of home, and where the
/// measurements say little it would speak of that.
const UNSURE_MAX: f32 = 0.5;

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
    /// Largest speed, m/s.
    pub speed_max_mps: f32,
    /// Largest acceleration, m/s^2.
    pub acceleration_max_mps2: f32,
    bounds: Place,
    home: Place,
    /// Largest variance of a position away from home, m^2.
    unsure_max_m2: f32,
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
        let unsure_max_m = UNSURE_MAX * p.range_sigma_m;
        Self {
            speed_max_mps: bounds.speed_max_mps,
            acceleration_max_mps2: bounds.acceleration_max_mps2,
            bounds: Place::new(bounds.range_m, bounds.elevation_rad),
            home: Place::new(
                about(p.range_m, p.range_sigma_m),
                about(p.elevation_rad, p.elevation_sigma_rad),
            ),
            unsure_max_m2: unsure_max_m * unsure_max_m,
        }
    }

    /// Whether the velocity and the acceleration lie inside.
    pub fn holds_motion(&self, state: &State<f32>) -> bool {
        length(state, 3) < self.speed_max_mps && length(state, 6) < self.acceleration_max_mps2
    }

    /// Whether the position lies inside, and at home or where it is known well enough.
    pub fn holds_place(&self, state: &State<f32>, covariance: &Covariance<f32>) -> bool {
        let range = length(state, 0);
        let variance = covariance[0][0] + covariance[1][1] + covariance[2][2];
        self.bounds.holds(range, state[2])
            && (variance < self.unsure_max_m2 || self.home.holds(range, state[2]))
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
            let holds = envelope.holds_place(&placed(range, elevation), &spread(0.1));
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
    /// be known to three metres.
    #[test]
    fn away_from_home_a_position_must_be_known() {
        let envelope = Envelope::of(&Bounds::PAPER.single(), &Population::PAPER.known());
        for (range, elevation, variance, inside) in [
            (33.5, 0.5, 100.0, true),
            (33.5, 1.23, 100.0, true),
            (33.5, 1.24, 100.0, false),
            (33.5, 1.24, 8.9, true),
            (33.5, 1.24, 9.1, false),
            (33.5, -0.24, 9.1, false),
            (55.0, 0.5, 9.1, false),
            (55.0, 0.5, 8.9, true),
            (101.0, 0.5, 1.0, false),
        ] {
            let holds = envelope.holds_place(&placed(range, elevation), &spread(variance));
            assert_eq!(holds, inside, "{range} {elevation} {variance}");
        }
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
            let mut state = placed(30.0, 0.5);
            (state[3], state[4], state[5]) = (0.6 * speed, 0.0, -0.8 * speed);
            (state[6], state[7], state[8]) = (0.0, -0.8 * acceleration, 0.6 * acceleration);
            assert_eq!(
                envelope.holds_motion(&state),
                inside,
                "{speed} {acceleration}"
            );
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
            envelope.holds_motion(&state)
        };
        assert!(moving([3.0, 0.0, 3.99], [12.0, 4.99, 0.0]));
        assert!(!moving([3.0, 0.0, 4.0], [12.0, 4.99, 0.0]));
        assert!(!moving([0.0, 4.0, -3.0], [0.0; 3]));
        assert!(!moving([0.0; 3], [12.0, -5.0, 0.0]));
        assert!(!moving([0.0; 3], [0.0, 12.0, 5.0]));
        let at = |x: f32, z: f32| [x, 0.0, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let known = spread(0.1);
        // Straight up and down are elevations of a right angle, within two radians.
        for (state, inside) in [
            (at(3.0, 4.0), true),
            (at(30.0, 40.0), true),
            (at(0.0, 20.0), true),
            (at(0.0, -20.0), true),
            (at(30.0, 40.1), false),
            (at(3.0, 3.9), false),
        ] {
            assert_eq!(envelope.holds_place(&state, &known), inside, "{state:?}");
        }
        // A variance of 9 m^2, half of 6 m squared, is unsure.
        let mut unsure = spread(0.0);
        (unsure[0][0], unsure[1][1], unsure[2][2]) = (2.0, 3.0, 4.0);
        assert!(!envelope.holds_place(&at(3.0, 4.0), &unsure));
        unsure[2][2] = 3.9;
        assert!(envelope.holds_place(&at(3.0, 4.0), &unsure));
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
