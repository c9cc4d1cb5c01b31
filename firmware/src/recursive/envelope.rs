//! Where and how fast targets are that the model was trained for.

use super::state::State;

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
}

/// The bounds of a model, as they are asked for at every step.
#[derive(Clone, Copy, Debug)]
pub struct Envelope {
    /// Largest speed, m/s.
    pub speed_max_mps: f32,
    /// Largest acceleration, m/s^2.
    pub acceleration_max_mps2: f32,
    range_m: [f32; 2],
    /// Least and largest sine of the elevation.
    elevation_sine: [f32; 2],
}

impl Envelope {
    /// The envelope that a blob's bounds make.
    pub fn of(bounds: &Bounds<f32>) -> Self {
        let right_angle = core::f32::consts::FRAC_PI_2;
        Self {
            speed_max_mps: bounds.speed_max_mps,
            acceleration_max_mps2: bounds.acceleration_max_mps2,
            range_m: bounds.range_m,
            elevation_sine: bounds
                .elevation_rad
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
        Envelope::of(&Bounds {
            speed_max_mps: 8.25,
            acceleration_max_mps2: 19.05,
            range_m: [15.0, 45.0],
            elevation_rad: [0.2, 0.8],
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
            let holds = envelope.holds_place(&placed(range, elevation));
            assert_eq!(holds, inside, "{range} {elevation}");
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
}
