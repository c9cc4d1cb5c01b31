//! Exact polar coordinates of a moving point, in f64.
//!
//! Frame: x east, y north, z up, radar at the origin. Azimuth from +x towards +y, elevation from
//! the horizontal, range-rate positive outbound. Nothing here panics.

use bnkf::radar::predict_beyond;
use bnkf::scalar::Scalar;

/// Range, direction and range-rate of a moving point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polar {
    /// Range, metres.
    pub range_m: f64,
    /// Elevation, radians.
    pub elevation_rad: f64,
    /// Azimuth, radians, in (-pi, pi].
    pub azimuth_rad: f64,
    /// Range-rate, metres per second.
    pub range_rate_mps: f64,
}

impl Polar {
    /// Polar coordinates of `position_m` moving at `velocity_mps`. At the radar itself, where
    /// direction has no meaning, angles and range-rate are 0.
    #[must_use]
    pub fn of(position_m: [f64; 3], velocity_mps: [f64; 3]) -> Self {
        // A truth overhead has an exact range; the filters' floor would lengthen it.
        let exact = predict_beyond(f64::MIN_POSITIVE, position_m, velocity_mps);
        let [elevation_rad, azimuth_rad, range_m, range_rate_mps] = exact.measurement;
        Self {
            range_m,
            elevation_rad,
            azimuth_rad: wrap_azimuth(azimuth_rad),
            range_rate_mps,
        }
    }
}

/// The same direction in (-pi, pi], radians.
#[must_use]
pub fn wrap_azimuth(azimuth_rad: f64) -> f64 {
    // `Scalar::wrap` keeps the other end of the interval.
    -Scalar::wrap(-azimuth_rad)
}

#[cfg(test)]
mod tests {
    use super::{Polar, wrap_azimuth};
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn axes_follow_the_stated_frame() {
        let east = Polar::of([10.0, 0.0, 0.0], [2.0, 5.0, 7.0]);
        assert_eq!(
            (
                east.range_m,
                east.elevation_rad,
                east.azimuth_rad,
                east.range_rate_mps
            ),
            (10.0, 0.0, 0.0, 2.0)
        );
        let north = Polar::of([0.0, 10.0, 0.0], [0.0, -3.0, 0.0]);
        assert_eq!((north.azimuth_rad, north.range_rate_mps), (FRAC_PI_2, -3.0));
        let up = Polar::of([0.0, 0.0, 4.0], [1.0, 1.0, 1.5]);
        assert_eq!((up.elevation_rad, up.range_rate_mps), (FRAC_PI_2, 1.5));
        // Due west, whichever sign y's zero has.
        assert_eq!(Polar::of([-1.0, -0.0, 0.0], [0.0; 3]).azimuth_rad, PI);
        let here = Polar::of([0.0; 3], [1.0; 3]);
        assert_eq!(
            (here.elevation_rad, here.azimuth_rad, here.range_rate_mps),
            (0.0, 0.0, 0.0)
        );
        assert!(here.range_m < 1e-150);
        // A millimetre beside the vertical.
        let beside = Polar::of([1e-3, 0.0, 4.0], [0.0; 3]);
        assert!((beside.range_m - (16.0_f64 + 1e-6).sqrt()).abs() < 1e-14);
        assert_eq!(wrap_azimuth(-PI), PI);
    }

    proptest! {
        #[test]
        fn wrapping_keeps_the_direction_and_the_interval(angle in -1e4..1e4_f64) {
            let wrapped = wrap_azimuth(angle);
            prop_assert!(wrapped > -PI && wrapped <= PI);
            prop_assert!((wrapped.sin() - angle.sin()).abs() < 1e-10);
            prop_assert!((wrapped.cos() - angle.cos()).abs() < 1e-10);
        }

        #[test]
        fn polar_coordinates_lead_back_to_the_point(
            p in prop::array::uniform3(-1e4..1e4_f64), v in prop::array::uniform3(-50.0..50.0_f64)
        ) {
            let polar = Polar::of(p, v);
            let horizontal = polar.range_m * polar.elevation_rad.cos();
            let back = [
                horizontal * polar.azimuth_rad.cos(),
                horizontal * polar.azimuth_rad.sin(),
                polar.range_m * polar.elevation_rad.sin(),
            ];
            for axis in 0..3 {
                prop_assert!((back[axis] - p[axis]).abs() < 1e-10 * polar.range_m.max(1.0));
            }
            // Range-rate is the derivative of range: compare with a central difference.
            prop_assume!(polar.range_m > 1.0);
            let range_at = |dt: f64| {
                let q: [f64; 3] = std::array::from_fn(|k| p[k] + dt * v[k]);
                q.iter().map(|c| c * c).sum::<f64>().sqrt()
            };
            let difference = (range_at(1e-4) - range_at(-1e-4)) / 2e-4;
            prop_assert!((polar.range_rate_mps - difference).abs() < 1e-3);
        }
    }
}
