//! A level figure of eight (lemniscate of Gerono).

use super::reference::Reference;
use super::vehicle::Vehicle;
use crate::random_source::RandomSource;
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// `x = a cos(w t + p)`, `y = b sin(2 (w t + p))`.
#[derive(Clone, Copy, Debug)]
pub struct Lemniscate {
    pub semi_axes_m: [f64; 2],
    pub rate_rad_per_s: f64,
    pub phase_rad: f64,
}

impl Lemniscate {
    /// Half length 2.5 to 8 m, half width 30% to 70% of it; the root mean square speed is
    /// `speed_mps`, slower where the vehicle could not turn tightly enough.
    pub fn draw(random: &mut RandomSource, vehicle: &Vehicle, speed_mps: f64) -> Self {
        let a_m = random.uniform(2.5, 8.0);
        let b_m = a_m * random.uniform(0.3, 0.7);
        let wanted = speed_mps / (0.5 * a_m * a_m + 2.0 * b_m * b_m).sqrt();
        // |acceleration| <= w^2 sqrt(a^2 + (4 b)^2).
        let flyable = (0.7 * vehicle.acceleration_mps2_max / a_m.hypot(4.0 * b_m)).sqrt();
        Self {
            semi_axes_m: [a_m, b_m],
            rate_rad_per_s: random.sign() * wanted.min(flyable),
            phase_rad: random.uniform(0.0, TAU),
        }
    }

    pub fn at(&self, t_s: f64) -> Reference {
        let [a_m, b_m] = self.semi_axes_m;
        let w = self.rate_rad_per_s;
        let angle = w * t_s + self.phase_rad;
        let (sine, cosine) = libm::sincos(angle);
        let (sine2, cosine2) = libm::sincos(2.0 * angle);
        Reference {
            position_m: Vector3::new(a_m * cosine, b_m * sine2, 0.0),
            velocity_mps: Vector3::new(-a_m * sine, 2.0 * b_m * cosine2, 0.0) * w,
            acceleration_mps2: Vector3::new(a_m * cosine, 4.0 * b_m * sine2, 0.0) * (-w * w),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Lemniscate, Reference, Vehicle};
    use crate::random_source::RandomSource;
    use proptest::prelude::*;

    #[test]
    fn the_root_mean_square_speed_is_the_wanted_one_where_it_can_be_flown() {
        let mut random = RandomSource::new(1, &[]);
        let vehicle = Vehicle::draw(&mut random);
        let eight = Lemniscate::draw(&mut random, &vehicle, 1.0);
        let period_s = std::f64::consts::TAU / eight.rate_rad_per_s.abs();
        let squares = (0..1000)
            .map(|i| eight.at(period_s * f64::from(i) / 1000.0).velocity_mps)
            .map(|v| v.norm_squared());
        assert!((squares.sum::<f64>() / 1000.0 - 1.0).abs() < 1e-9);
    }

    proptest! {
        #[test]
        fn the_derivatives_agree_and_the_turn_is_flyable(
            seed in any::<u64>(), t_s in 0.0..30.0_f64, speed_mps in 0.5..4.0_f64
        ) {
            let mut random = RandomSource::new(seed, &[]);
            let vehicle = Vehicle::draw(&mut random);
            let eight = Lemniscate::draw(&mut random, &vehicle, speed_mps);
            Reference::assert_consistent(|t| eight.at(t), t_s);
            let here = eight.at(t_s);
            prop_assert!(here.acceleration_mps2.norm() <= vehicle.acceleration_mps2_max);
        }
    }
}
