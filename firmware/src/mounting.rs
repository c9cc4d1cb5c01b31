//! Directions that a sensor measures in axes of its own, turned into the track's.

use crate::measurement::{ANGLE_SIGMA_RAD, Channel, Sensed};
use crate::radar::axes;
use crate::scalar::Scalar;

/// How a sensor's axes (x along its boresight, y to its left, z up) lie in the track's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Mounting {
    /// Rows: east, north, up; columns: the sensor's x, y, z.
    rotation: [[f32; 3]; 3],
}

/// A direction in the track's axes, for a [`Measurement`](crate::Measurement).
///
/// ```
/// use bnkf::{Direction, Mounting, Sensed};
///
/// let ahead = Sensed { value: 0.0, sigma: 0.01 };
/// let Direction { elevation, azimuth } = Mounting::new(0.5, 0.0, 0.0).direction(ahead, ahead);
/// assert_eq!(elevation.value, 0.0);
/// assert!(azimuth.is_some_and(|azimuth| (azimuth.value - 0.5).abs() < 1e-6));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Direction {
    /// Elevation, rad.
    pub elevation: Sensed,
    /// Azimuth, rad; `None` so near to the vertical that its standard deviation would pass a radian,
    /// which is no direction.
    pub azimuth: Option<Sensed>,
}

impl Mounting {
    /// A sensor that is turned by `yaw_rad` from +x (east) towards +y (north), whose boresight then
    /// is raised by `pitch_rad`, and whose left side then is raised by `roll_rad` about the
    /// boresight. Radians.
    ///
    /// How well these three are known is not asked: what a vehicle's attitude is unsure by belongs
    /// into the sigmas of the angles.
    pub fn new(yaw_rad: f32, pitch_rad: f32, roll_rad: f32) -> Self {
        let [(sy, cy), (sp, cp), (sr, cr)] = [yaw_rad, pitch_rad, roll_rad].map(Scalar::sin_cos);
        Self {
            rotation: [
                [cy * cp, -sy * cr - cy * sp * sr, sy * sr - cy * sp * cr],
                [sy * cp, cy * cr - sy * sp * sr, -cy * sr - sy * sp * cr],
                [sp, cp * sr, cp * cr],
            ],
        }
    }

    /// A direction (rad) in the sensor's axes as one in the track's.
    ///
    /// Turning mixes the two errors, and they come out correlated, while a measurement's channels
    /// are independent. Both variances are therefore widened by one plus the size of the
    /// correlation: the least factor common to both with which no combination of the two angles is
    /// said to be better known than it is. Where the sensor errs alike along both axes it is one,
    /// and never more than two. To first order in the sigmas. Where a sigma is none that a measurement may have,
    /// both stay as they are, and the step refuses them.
    pub fn direction(&self, elevation: Sensed, azimuth: Sensed) -> Direction {
        let turned = |v: [f32; 3]| self.rotation.map(|row| dot(&row, &v));
        let [along, upward, lateral] = axes(elevation.value, azimuth.value).map(turned);
        let squared = along[0] * along[0] + along[1] * along[1];
        let horizontal = crate::kernel::sqrt(squared);
        let (elevation_rad, azimuth_rad) = (
            Scalar::atan2(along[2], horizontal),
            Scalar::atan2(along[1], along[0]),
        );
        let given = [(Channel::Elevation, elevation), (Channel::Azimuth, azimuth)];
        if !given
            .iter()
            .all(|(channel, angle)| channel.takes_sigma(angle.sigma))
        {
            let at = |value: f32, angle: Sensed| Sensed { value, ..angle };
            return Direction {
                elevation: at(elevation_rad, elevation),
                azimuth: Some(at(azimuth_rad, azimuth)),
            };
        }
        let [_, up, side] = axes(elevation_rad, azimuth_rad);
        // The error's two parts on the sphere, along the track's axes.
        let by_azimuth = Scalar::cos(elevation.value) * azimuth.sigma;
        let tall = [
            dot(&up, &upward) * elevation.sigma,
            dot(&up, &lateral) * by_azimuth,
        ];
        let wide = [
            dot(&side, &upward) * elevation.sigma,
            dot(&side, &lateral) * by_azimuth,
        ];
        let square = |v: &[f32; 2]| v[0] * v[0] + v[1] * v[1];
        let root = |variance: f32| crate::kernel::sqrt(variance);
        let (tall_sigma, wide_sigma) = (root(square(&tall)), root(square(&wide)));
        let product = tall_sigma * wide_sigma;
        let correlation = if product > 0.0 {
            ((tall[0] * wide[0] + tall[1] * wide[1]) / product).abs()
        } else {
            0.0
        };
        let widening = root(1.0 + correlation.min(1.0));
        let [least, most] = ANGLE_SIGMA_RAD;
        let azimuth_sigma = widening * wide_sigma / horizontal;
        Direction {
            elevation: Sensed {
                value: elevation_rad,
                sigma: (widening * tall_sigma).max(least),
            },
            azimuth: (azimuth_sigma <= most).then_some(Sensed {
                value: azimuth_rad,
                sigma: azimuth_sigma.max(least),
            }),
        }
    }
}

fn dot(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaussian::standard_normal;
    use crate::rng::seeded;
    use core::f32::consts::{FRAC_PI_2, PI};

    fn sensed(value: f32, sigma: f32) -> Sensed {
        Sensed { value, sigma }
    }

    fn angles(mounting: &Mounting, elevation: f32, azimuth: f32) -> (f32, f32) {
        let seen = mounting.direction(sensed(elevation, 1e-3), sensed(azimuth, 1e-3));
        (
            seen.elevation.value,
            seen.azimuth.expect("a direction").value,
        )
    }

    fn near((elevation, azimuth): (f32, f32), expected: (f32, f32)) {
        assert!((elevation - expected.0).abs() < 1e-6, "{elevation}");
        let turn: f32 = Scalar::wrap(azimuth - expected.1);
        assert!(turn.abs() < 1e-6, "{azimuth}");
    }

    /// Each angle by itself, with what it does in plain words.
    #[test]
    fn every_angle_turns_the_way_it_is_said_to() {
        // A quarter turn to the left: the boresight looks north.
        near(
            angles(&Mounting::new(FRAC_PI_2, 0.0, 0.0), 0.0, 0.0),
            (0.0, FRAC_PI_2),
        );
        // Raised by 0.3: so is what lies ahead; what lies behind is lowered.
        let raised = Mounting::new(0.0, 0.3, 0.0);
        near(angles(&raised, 0.0, 0.0), (0.3, 0.0));
        near(angles(&raised, 0.0, PI), (-0.3, PI));
        near(angles(&raised, 0.0, FRAC_PI_2), (0.0, FRAC_PI_2));
        // The left side raised by 0.2: what lies to the left is higher, ahead nothing changes.
        let rolled = Mounting::new(0.0, 0.0, 0.2);
        near(angles(&rolled, 0.0, 0.0), (0.0, 0.0));
        near(angles(&rolled, 0.0, FRAC_PI_2), (0.2, FRAC_PI_2));
        near(angles(&rolled, 0.0, -FRAC_PI_2), (-0.2, -FRAC_PI_2));
        // Yaw after pitch: a raised boresight that looks north-west.
        near(angles(&Mounting::new(2.3, 0.3, 0.0), 0.0, 0.0), (0.3, 2.3));
    }

    /// Three turns in a row as matrices in f64: the definition.
    #[test]
    fn the_rotation_is_yaw_after_pitch_after_roll() {
        let (yaw, pitch, roll) = (0.7_f64, -0.4, 1.1);
        let turn = |axis: usize, angle: f64| {
            let (s, c) = (libm::sin(angle), libm::cos(angle));
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut m = nalgebra::Matrix3::<f64>::identity();
            (m[(i, i)], m[(i, j)], m[(j, i)], m[(j, j)]) = (c, -s, s, c);
            m
        };
        // A positive pitch raises x, which is a negative turn about y.
        let expected = turn(2, yaw) * turn(1, -pitch) * turn(0, roll);
        let got = Mounting::new(yaw as f32, pitch as f32, roll as f32).rotation;
        for i in 0..3 {
            for j in 0..3 {
                assert!((f64::from(got[i][j]) - expected[(i, j)]).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn a_level_mounting_changes_no_sigma() {
        let seen = Mounting::new(1.0, 0.0, 0.0).direction(sensed(0.5, 0.01), sensed(2.0, 0.03));
        let azimuth = seen.azimuth.expect("a direction");
        assert!((seen.elevation.sigma - 0.01).abs() < 1e-6);
        assert!((azimuth.sigma - 0.03).abs() < 1e-6);
    }

    /// Monte Carlo: no combination of the two angles errs more than is said of it, and not much less.
    #[test]
    fn what_is_said_of_the_errors_is_never_too_little() {
        let mut rng = seeded(11);
        let mut draw = || standard_normal(&mut rng);
        const DRAWS: usize = 20_000;
        for case in 0..24 {
            let mut uniform = |most: f32| {
                let x: f32 = draw();
                Scalar::tanh(x) * most
            };
            let mounting = Mounting::new(uniform(PI), uniform(0.7), uniform(1.5));
            let elevation = sensed(uniform(0.9), 0.004 * (1 + case % 5) as f32);
            let azimuth = sensed(uniform(PI), 0.004 * (1 + case % 3) as f32);
            let said = mounting.direction(elevation, azimuth);
            let said_azimuth = said.azimuth.expect("a direction");
            if said.elevation.value.abs() > 1.2 {
                // So near to the vertical the first order is none.
                continue;
            }
            let (mut ee, mut ea, mut aa) = (0.0_f64, 0.0_f64, 0.0_f64);
            for _ in 0..DRAWS {
                let (e, a) = angles(
                    &mounting,
                    elevation.value + elevation.sigma * draw(),
                    azimuth.value + azimuth.sigma * draw(),
                );
                let turn: f32 = Scalar::wrap(a - said_azimuth.value);
                let (e, a) = (f64::from(e - said.elevation.value), f64::from(turn));
                ee += e * e / DRAWS as f64;
                ea += e * a / DRAWS as f64;
                aa += a * a / DRAWS as f64;
            }
            let (se, sa) = (
                f64::from(said.elevation.sigma),
                f64::from(said_azimuth.sigma),
            );
            // In units of what is said: the largest eigenvalue is at most one, and one variance at
            // least half. Five standard errors of a variance over the draws are 5 %.
            let (ee, ea, aa) = (ee / (se * se), ea / (se * sa), aa / (sa * sa));
            let middle = 0.5 * (ee + aa);
            let apart = (0.25 * (ee - aa) * (ee - aa) + ea * ea).sqrt();
            assert!(middle + apart < 1.06, "{case}: {ee} {ea} {aa}");
            assert!(middle + apart > 0.94, "{case}: {ee} {ea} {aa}");
            assert!(ee > 0.47 && aa > 0.47, "{case}: {ee} {ea} {aa}");
        }
    }

    /// What no measurement may have it does not become by being turned.
    #[test]
    fn a_sigma_that_is_none_stays_none() {
        let level = Mounting::new(0.3, 0.1, 0.2);
        for wrong in [-0.005, 0.0, 5.0, f32::NAN, f32::INFINITY] {
            let seen = level.direction(sensed(0.1, wrong), sensed(0.2, 0.01));
            assert_eq!(seen.elevation.sigma.to_bits(), wrong.to_bits());
            let seen = level.direction(sensed(0.1, 0.01), sensed(0.2, wrong));
            let azimuth = seen.azimuth.expect("an azimuth to refuse");
            assert_eq!(azimuth.sigma.to_bits(), wrong.to_bits());
        }
        // Widened beyond what may be, it is not said to be less.
        let blunt = Mounting::new(0.0, 0.0, 0.1).direction(sensed(0.0, 1.0), sensed(0.0, 0.1));
        assert!(blunt.elevation.sigma > 1.2, "{}", blunt.elevation.sigma);
    }

    /// Straight up there is no azimuth, and no sigma pretends one.
    #[test]
    fn the_vertical_has_no_azimuth() {
        let up = Mounting::new(0.4, FRAC_PI_2, 0.0);
        let seen = up.direction(sensed(0.0, 0.01), sensed(0.0, 0.01));
        assert_eq!(seen.azimuth, None);
        assert!((seen.elevation.value - FRAC_PI_2).abs() < 1e-3);
        let beside = up.direction(sensed(0.02, 0.01), sensed(0.0, 0.01));
        assert!(beside.azimuth.is_some_and(|azimuth| azimuth.sigma > 0.4));
    }
}
