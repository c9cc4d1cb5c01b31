//! From point to point in a box, with stops.

use super::vehicle::{STEP_S, State, Vehicle, shortened};
use crate::random_source::RandomSource;
use nalgebra::Vector3;

/// A pilot who flies to random points, brakes in time and sometimes hovers there.
#[derive(Clone, Copy, Debug)]
pub struct Waypoints {
    half_box_m: Vector3<f64>,
    start_m: Vector3<f64>,
    target_m: Vector3<f64>,
    cruise_mps: f64,
    /// Deceleration that the pilot plans with.
    braking_mps2: f64,
    /// How strongly a speed error is corrected, 1/s.
    gain_per_s: f64,
    /// Distance at which a point counts as reached.
    reached_m: f64,
    /// Time left to hover; `None` on the way.
    hover_s: Option<f64>,
}

impl Waypoints {
    /// A box of 4 to 14 m by 4 to 14 m by 0.5 to 5 m.
    pub fn draw(random: &mut RandomSource, vehicle: &Vehicle, speed_mps: f64) -> Self {
        let half_box_m = Vector3::new(
            random.uniform(2.0, 7.0),
            random.uniform(2.0, 7.0),
            random.uniform(0.25, 2.5),
        );
        let start_m = point_in(half_box_m, random);
        Self {
            half_box_m,
            start_m,
            target_m: point_in(half_box_m, random),
            // Stops and turns cost speed.
            cruise_mps: (1.4 * speed_mps).min(4.2),
            braking_mps2: 0.4 * vehicle.acceleration_mps2_max,
            gain_per_s: random.uniform(1.0, 2.5),
            reached_m: random.uniform(0.3, 1.5),
            hover_s: None,
        }
    }

    /// At rest in the first point.
    pub fn start(&self) -> State {
        State {
            position_m: self.start_m,
            velocity_mps: Vector3::zeros(),
        }
    }

    /// The acceleration that the pilot asks for in the next step.
    pub fn command(&mut self, state: &State, random: &mut RandomSource) -> Vector3<f64> {
        let way_m = self.target_m - state.position_m;
        match &mut self.hover_s {
            Some(left_s) if *left_s > 0.0 => *left_s -= STEP_S,
            Some(_) => {
                self.target_m = point_in(self.half_box_m, random);
                self.hover_s = None;
            }
            None if way_m.norm() < self.reached_m => {
                let stays = random.chance(0.5);
                self.hover_s = Some(if stays { random.uniform(0.3, 3.0) } else { 0.0 });
            }
            None => {}
        }
        let way_m = self.target_m - state.position_m;
        let distance_m = way_m.norm();
        // Fast enough to arrive at rest; close by, a gentle approach.
        let speed_mps = self
            .cruise_mps
            .min((2.0 * self.braking_mps2 * distance_m).sqrt())
            .min(self.gain_per_s * distance_m);
        (shortened(way_m * 1e9, speed_mps) - state.velocity_mps) * self.gain_per_s
    }
}

fn point_in(half_box_m: Vector3<f64>, random: &mut RandomSource) -> Vector3<f64> {
    half_box_m.map(|half_m| random.uniform(-half_m, half_m))
}

#[cfg(test)]
mod tests {
    use super::{Vehicle, Waypoints};
    use crate::flights::generator::vehicle::STEP_S;
    use crate::random_source::RandomSource;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn points_are_reached_within_speed_and_near_the_box(
            seed in any::<u64>(), speed_mps in 0.7..4.2_f64
        ) {
            let mut random = RandomSource::new(seed, &[]);
            let mut vehicle = Vehicle::draw_calm(&mut random);
            let mut pilot = Waypoints::draw(&mut random, &vehicle, speed_mps);
            let mut state = pilot.start();
            let mut targets = 0;
            for _ in 0..12_000 {
                let before_m = pilot.target_m;
                let command = pilot.command(&state, &mut random);
                targets += usize::from(pilot.target_m != before_m);
                state = state.after(STEP_S, vehicle.respond(command, &mut random));
                prop_assert!(state.velocity_mps.norm() < 1.3 * pilot.cruise_mps);
                for axis in 0..3 {
                    prop_assert!(state.position_m[axis].abs() < pilot.half_box_m[axis] + 4.0);
                }
            }
            // 120 s: even the slowest pilot in the largest box passes several points.
            prop_assert!(targets >= 3, "{targets} points");
        }
    }

    #[test]
    fn some_points_are_hovered_over() {
        let mut random = RandomSource::new(5, &[]);
        let mut vehicle = Vehicle::draw(&mut random);
        let mut pilot = Waypoints::draw(&mut random, &vehicle, 2.0);
        let mut state = pilot.start();
        let (mut still, mut moving) = (0, 0);
        for _ in 0..12_000 {
            let command = pilot.command(&state, &mut random);
            state = state.after(STEP_S, vehicle.respond(command, &mut random));
            if state.velocity_mps.norm() < 0.4 {
                still += 1;
            } else {
                moving += 1;
            }
        }
        assert!(still > 500, "{still} slow steps");
        assert!(moving > 6000, "{moving} fast steps");
    }
}
