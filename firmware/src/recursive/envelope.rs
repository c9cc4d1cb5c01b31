//! Where and how fast targets are that the model was trained for.

use super::motion::State;
use super::population::Population;

/// Deviations of the population's speed and acceleration that count as inside: flights are played
/// faster and stretched in training, so their tails are long.
const MOTION_SIGMAS: f32 = 5.5;
/// Deviations of the population's range and elevation that count as its volume.
const PLACE_SIGMAS: f32 = 3.0;

/// The bounds of a model, from its blob's population.
#[derive(Clone, Copy, Debug)]
pub struct Envelope {
    /// Largest speed, m/s.
    pub speed_max_mps: f32,
    /// Largest acceleration, m/s^2.
    pub acceleration_max_mps2: f32,
    /// Least and largest range, m.
    pub range_m: [f32; 2],
    /// Least and largest sine of the elevation.
    elevation_sine: [f32; 2],
}

impl Envelope {
    /// The envelope of a population.
    pub fn of(population: &Population<f32>) -> Self {
        let p = population;
        let horizontal = p.horizontal_sigma_mps * p.horizontal_sigma_mps;
        let vertical = p.vertical_sigma_mps * p.vertical_sigma_mps;
        let speed_sigma = libm::sqrtf(2.0 * horizontal + vertical);
        let between = |mean: f32, sigma: f32| {
            let reach = PLACE_SIGMAS * sigma;
            [mean - reach, mean + reach]
        };
        let right_angle = core::f32::consts::FRAC_PI_2;
        Self {
            speed_max_mps: MOTION_SIGMAS * speed_sigma,
            acceleration_max_mps2: MOTION_SIGMAS * libm::sqrtf(3.0) * p.acceleration_sigma_mps2,
            range_m: between(p.range_m, p.range_sigma_m),
            elevation_sine: between(p.elevation_rad, p.elevation_sigma_rad)
                .map(|angle| libm::sinf(angle.clamp(-right_angle, right_angle))),
        }
    }

    /// Whether the velocity and the acceleration lie inside.
    pub fn holds_motion(&self, state: &State<f32>) -> bool {
        length(state, 3) < self.speed_max_mps && length(state, 6) < self.acceleration_max_mps2
    }

    /// Whether the position lies inside.
    pub fn holds_place(&self, state: &State<f32>) -> bool {
        let range = length(state, 0);
        let [least, most] = self.range_m;
        let [low, high] = self.elevation_sine;
        (least..=most).contains(&range) && (low * range..=high * range).contains(&state[2])
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
        Envelope::of(&Population {
            range_m: 30.0,
            range_sigma_m: 5.0,
            elevation_rad: 0.5,
            elevation_sigma_rad: 0.1,
            horizontal_sigma_mps: 1.0,
            vertical_sigma_mps: 0.5,
            acceleration_sigma_mps2: 2.0,
        })
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
    fn the_volume_ends_at_three_deviations() {
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
            let holds = envelope.holds_place(&placed(range, elevation));
            assert_eq!(holds, inside, "{range} {elevation}");
        }
    }

    #[test]
    fn the_motion_ends_at_five_and_a_half_deviations() {
        let envelope = envelope();
        // sqrt(1 + 1 + 0.25) = 1.5 m/s, sqrt(3) 2 m/s^2.
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
}
