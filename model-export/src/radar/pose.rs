//! Where a radar is and how it moves, in f64, and what it would read of a target.

use crate::radar::polar::Polar;
use bnkf::Sensor;

/// Position and velocity of a radar; x east, y north, z up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Metres.
    pub position_m: [f64; 3],
    /// Metres per second.
    pub velocity_mps: [f64; 3],
}

impl Pose {
    /// At rest in the origin.
    pub const ORIGIN: Self = Self::at([0.0; 3]);

    /// At rest.
    #[must_use]
    pub const fn at(position_m: [f64; 3]) -> Self {
        Self {
            position_m,
            velocity_mps: [0.0; 3],
        }
    }

    /// Exact polar coordinates of a target from here: its range-rate is relative.
    #[must_use]
    pub fn polar(&self, position_m: [f64; 3], velocity_mps: [f64; 3]) -> Polar {
        Polar::of(
            less(position_m, self.position_m),
            less(velocity_mps, self.velocity_mps),
        )
    }
}

impl From<Pose> for Sensor {
    /// Rounds every number to the nearest f32.
    fn from(pose: Pose) -> Self {
        Self {
            position_m: pose.position_m.map(|x| x as f32),
            velocity_mps: pose.velocity_mps.map(|v| v as f32),
        }
    }
}

fn less(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    core::array::from_fn(|axis| a[axis] - b[axis])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The derivative of the distance between two points that both move.
    #[test]
    fn the_range_rate_is_that_of_the_distance() {
        let pose = Pose {
            position_m: [12.0, -7.0, 1.5],
            velocity_mps: [9.0, 11.0, -0.5],
        };
        let (p, v) = ([30.0, 20.0, 14.0], [-2.0, 3.0, 1.0]);
        let distance = |t: f64| {
            (0..3)
                .map(|i| {
                    let target = p[i] + t * v[i];
                    (target - pose.position_m[i] - t * pose.velocity_mps[i]).powi(2)
                })
                .sum::<f64>()
                .sqrt()
        };
        let seen = pose.polar(p, v);
        assert!((seen.range_m - distance(0.0)).abs() < 1e-12);
        let slope = (distance(1e-4) - distance(-1e-4)) / 2e-4;
        assert!((seen.range_rate_mps - slope).abs() < 1e-7);
        assert!((seen.azimuth_rad - 27.0_f64.atan2(18.0)).abs() < 1e-12);
        let horizontal = 18.0_f64.hypot(27.0);
        assert!((seen.elevation_rad - 12.5_f64.atan2(horizontal)).abs() < 1e-12);
    }
}
