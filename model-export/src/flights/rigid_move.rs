//! A move of a whole flight that keeps its shape, its speeds and the direction of gravity.

use crate::flights::flight::Flight;

/// Mirror, then turn, then shift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidMove {
    /// Whether y changes sign first.
    pub mirror: bool,
    /// Turn about the vertical, radians, from +x towards +y.
    pub yaw_rad: f64,
    /// Shift [x, y, z], metres.
    pub shift_m: [f64; 3],
}

impl RigidMove {
    /// Moves a point, metres.
    #[must_use]
    pub fn point(&self, position_m: [f64; 3]) -> [f64; 3] {
        let turned = self.direction(position_m);
        std::array::from_fn(|axis| turned[axis] + self.shift_m[axis])
    }

    /// Turns a direction or a velocity, which no shift changes.
    #[must_use]
    pub fn direction(&self, vector: [f64; 3]) -> [f64; 3] {
        let (sine, cosine) = libm::sincos(self.yaw_rad);
        let [x, y, z] = vector;
        let y = if self.mirror { -y } else { y };
        [cosine * x - sine * y, sine * x + cosine * y, z]
    }

    /// Moves every sample, velocity included; names and times stay.
    #[must_use]
    pub fn flight(&self, flight: &Flight) -> Flight {
        let mut moved = flight.clone();
        for sample in &mut moved.samples {
            sample.position_m = self.point(sample.position_m);
            sample.velocity_mps = self.direction(sample.velocity_mps);
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::RigidMove;
    use crate::flights::flight::Flight;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
        (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
    }

    #[test]
    fn mirror_turn_and_shift_come_in_this_order() {
        let quarter = RigidMove {
            mirror: true,
            yaw_rad: FRAC_PI_2,
            shift_m: [10.0, 20.0, 30.0],
        };
        // (1, 2, 3) -> mirrored (1, -2, 3) -> turned (2, 1, 3) -> shifted.
        assert!(distance(quarter.point([1.0, 2.0, 3.0]), [12.0, 21.0, 33.0]) < 1e-12);
        assert!(distance(quarter.direction([1.0, 2.0, 3.0]), [2.0, 1.0, 3.0]) < 1e-12);
    }

    proptest! {
        #[test]
        fn shape_height_and_velocity_survive(
            points in prop::collection::vec(prop::array::uniform3(-20.0..20.0_f64), 3..10),
            mirror in any::<bool>(),
            yaw_rad in -7.0..7.0_f64,
            shift_m in prop::array::uniform3(-50.0..50.0_f64)
        ) {
            let rows: Vec<[f64; 4]> = points
                .iter()
                .enumerate()
                .map(|(i, [x, y, z])| [i as f64 * 0.1, *x, *y, *z])
                .collect();
            let before = Flight::from_track("f", "f", &rows).unwrap();
            let after = RigidMove { mirror, yaw_rad, shift_m }.flight(&before);
            for (i, (a, b)) in before.samples.iter().zip(&after.samples).enumerate() {
                for (c, d) in before.samples[..i].iter().zip(&after.samples[..i]) {
                    let (was, is) = (
                        distance(a.position_m, c.position_m),
                        distance(b.position_m, d.position_m),
                    );
                    prop_assert!((was - is).abs() < 1e-10);
                }
                prop_assert!((b.position_m[2] - a.position_m[2] - shift_m[2]).abs() < 1e-12);
            }
            // Moving and then differentiating is the same as differentiating and then moving.
            let rows: Vec<[f64; 4]> = after
                .samples
                .iter()
                .map(|s| [s.time_s, s.position_m[0], s.position_m[1], s.position_m[2]])
                .collect();
            let again = Flight::from_track("f", "f", &rows).unwrap();
            for (a, b) in after.samples.iter().zip(&again.samples) {
                prop_assert!(distance(a.velocity_mps, b.velocity_mps) < 1e-9);
            }
        }
    }
}
