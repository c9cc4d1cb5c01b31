//! A level circle or ellipse.

use super::reference::Reference;
use super::vehicle::Vehicle;
use crate::random_source::RandomSource;
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// `x = a cos(w t + p)`, `y = b sin(w t + p)`.
#[derive(Clone, Copy, Debug)]
pub struct Circle {
    pub semi_axes_m: [f64; 2],
    /// Signed: positive turns left.
    pub rate_rad_per_s: f64,
    pub phase_rad: f64,
}

impl Circle {
    /// Radius 1.5 to 6 m, no tighter than the vehicle can turn; the second axis 70% to 100% of it.
    pub fn draw(random: &mut RandomSource, vehicle: &Vehicle, speed_mps: f64) -> Self {
        let tightest_m = speed_mps * speed_mps / (0.7 * vehicle.acceleration_mps2_max);
        let radius_m = random.uniform(1.5, 6.0).max(tightest_m);
        Self {
            semi_axes_m: [radius_m, radius_m * random.uniform(0.7, 1.0)],
            rate_rad_per_s: random.sign() * speed_mps / radius_m,
            phase_rad: random.uniform(0.0, TAU),
        }
    }

    pub fn at(&self, t_s: f64) -> Reference {
        let [a_m, b_m] = self.semi_axes_m;
        let w = self.rate_rad_per_s;
        let (sine, cosine) = libm::sincos(w * t_s + self.phase_rad);
        let position_m = Vector3::new(a_m * cosine, b_m * sine, 0.0);
        Reference {
            position_m,
            velocity_mps: Vector3::new(-a_m * sine, b_m * cosine, 0.0) * w,
            acceleration_mps2: position_m * (-w * w),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Circle, Reference, Vehicle};
    use crate::random_source::RandomSource;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_derivatives_agree_and_the_turn_is_flyable(
            seed in any::<u64>(), t_s in 0.0..30.0_f64, speed_mps in 0.5..4.0_f64
        ) {
            let mut random = RandomSource::new(seed, &[]);
            let vehicle = Vehicle::draw(&mut random);
            let circle = Circle::draw(&mut random, &vehicle, speed_mps);
            Reference::assert_consistent(|t| circle.at(t), t_s);
            let here = circle.at(t_s);
            prop_assert!(here.velocity_mps.norm() <= speed_mps * (1.0 + 1e-9));
            prop_assert!(here.velocity_mps.norm() >= 0.7 * speed_mps * (1.0 - 1e-9));
            prop_assert!(here.acceleration_mps2.norm() <= vehicle.acceleration_mps2_max);
        }
    }
}
