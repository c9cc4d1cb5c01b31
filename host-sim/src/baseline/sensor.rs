//! The firmware's measurement function in f64: reading vector, its Jacobian and its noise.

use bnkf::measurement::Channel;
use bnkf::radar;
use bnkf::scalar::Scalar;
use bnkf_model_export::radar::reading::Reading;
use nalgebra::{Matrix3, Matrix4, SMatrix, Vector3, Vector4};

use crate::filter::FilterError;

/// Readings within this angle of the zenith, or pointing beyond it, count as overhead, rad. Three
/// and a half standard deviations at the paper's high noise.
const OVERHEAD_RAD: f64 = 0.35;

/// A reading as a vector with its noise covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Elevation, azimuth, range, range-rate [rad, rad, m, m/s].
    pub z: Vector4<f64>,
    /// Standard deviations in the same order.
    pub sigma: Vector4<f64>,
    /// Which of them were measured.
    pub present: [bool; 4],
    /// Rotation from the radar's axes to those in which the angles are meant.
    pub frame: Matrix3<f64>,
    /// Position of the radar, m.
    pub position_m: Vector3<f64>,
    /// Velocity of the radar, m/s.
    pub velocity_mps: Vector3<f64>,
}

impl From<&Reading> for Observation {
    fn from(r: &Reading) -> Self {
        let vectors = r.vectors();
        Self {
            present: vectors.present.map(|present| present > 0.0),
            position_m: r.sensor.position_m.into(),
            velocity_mps: r.sensor.velocity_mps.into(),
            ..Self::new(vectors.measured.into(), vectors.sigmas.into())
        }
    }
}

impl Observation {
    /// Refuses a reading without all of `channels`.
    ///
    /// # Errors
    /// The first that is missing.
    pub fn requires(&self, channels: &[Channel]) -> Result<(), FilterError> {
        let measured = Channel::ALL.iter().zip(self.present);
        let mut missing =
            measured.filter(|(channel, present)| !present && channels.contains(channel));
        match missing.next() {
            Some((channel, _)) => Err(FilterError::Missing(*channel)),
            None => Ok(()),
        }
    }

    /// A whole reading in the radar's own axes, of a radar at rest in the origin.
    pub fn new(z: Vector4<f64>, sigma: Vector4<f64>) -> Self {
        Self {
            z,
            sigma,
            present: [true; 4],
            frame: Matrix3::identity(),
            position_m: Vector3::zeros(),
            velocity_mps: Vector3::zeros(),
        }
    }

    /// The reading as it is, or `head_on` if it points near the zenith.
    ///
    /// Azimuth turns without bound as a target passes overhead, and no Gaussian over position
    /// gives a Gaussian over it; one such pass cost the tuned UKF its track. Elsewhere the angles
    /// as they come are the better choice: their noise is Gaussian in them and nowhere else.
    #[must_use]
    pub fn clear_of_the_zenith(&self) -> Self {
        if self.present[0] && self.present[1] && self.z[0].cos() < OVERHEAD_RAD.sin() {
            self.head_on()
        } else {
            *self
        }
    }

    /// The same reading in axes whose x points where the reading does: both angles are zero there
    /// and smooth around. The azimuth's error becomes that times the cosine of the true elevation,
    /// of which the reading tells a mean square.
    fn head_on(&self) -> Self {
        let [radial, upward, lateral] = radar::axes(self.z[0], self.z[1]);
        let frame = Matrix3::from([radial, lateral, upward]).transpose();
        let square = 0.5 * (1.0 + (2.0 * self.z[0]).cos() * (-2.0 * self.sigma[0].powi(2)).exp());
        let mut sigma = self.sigma;
        sigma[1] *= square.sqrt();
        Self {
            z: Vector4::new(0.0, 0.0, self.z[2], self.z[3]),
            sigma,
            frame: frame * self.frame,
            ..*self
        }
    }

    /// Noise-free reading of a target at `p` (m) moving with `v` (m/s), radar's axes.
    pub fn expected(&self, p: &Vector3<f64>, v: &Vector3<f64>) -> Vector4<f64> {
        let (p, v) = self.seen(p, v);
        expected(&p, &v)
    }

    /// A target's position and velocity over ground in the radar's axes, relative to it.
    fn seen(&self, p: &Vector3<f64>, v: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        (
            self.frame * (p - self.position_m),
            self.frame * (v - self.velocity_mps),
        )
    }

    /// Derivative of [`Self::expected`] by position and velocity, 4 x 6.
    pub fn jacobian(&self, p: &Vector3<f64>, v: &Vector3<f64>) -> SMatrix<f64, 4, 6> {
        let (p, v) = self.seen(p, v);
        let h = jacobian(&p, &v);
        let mut turned = SMatrix::<f64, 4, 6>::zeros();
        for half in [0, 3] {
            let part = h.fixed_columns::<3>(half) * self.frame;
            turned.fixed_columns_mut::<3>(half).copy_from(&part);
        }
        turned
    }

    /// Noise covariance R, diagonal.
    pub fn noise(&self) -> Matrix4<f64> {
        Matrix4::from_diagonal(&self.sigma.component_mul(&self.sigma))
    }
}

/// `z - expected` with both angles wrapped. Not the firmware's innovation, which renames a
/// direction beyond the zenith: the textbook filters have none of it, nor has the reference that
/// they are tested against.
pub fn residual(z: &Vector4<f64>, expected: &Vector4<f64>) -> Vector4<f64> {
    let d = z - expected;
    Vector4::new(Scalar::wrap(d[0]), Scalar::wrap(d[1]), d[2], d[3])
}

/// Noise-free reading of a target at `p` (m) moving with `v` (m/s).
pub fn expected(p: &Vector3<f64>, v: &Vector3<f64>) -> Vector4<f64> {
    radar::predict((*p).into(), (*v).into()).measurement.into()
}

/// Derivative of [`expected`] by position and velocity, 4 x 6.
pub fn jacobian(p: &Vector3<f64>, v: &Vector3<f64>) -> SMatrix<f64, 4, 6> {
    let prediction = radar::predict((*p).into(), (*v).into());
    SMatrix::from_fn(|row, column| match (row, column) {
        (_, 0..3) => prediction.by_position[row][column],
        (3, _) => prediction.by_velocity[column - 3],
        _ => 0.0,
    })
}

/// Position of elevation, azimuth (rad) and range (m); a negative range lands on the far side.
pub fn cartesian(elevation_rad: f64, azimuth_rad: f64, range_m: f64) -> Vector3<f64> {
    radar::position(range_m, elevation_rad, azimuth_rad).into()
}

/// Derivative of [`cartesian`] by (elevation, azimuth, range).
pub fn cartesian_jacobian(elevation_rad: f64, azimuth_rad: f64, range_m: f64) -> Matrix3<f64> {
    let [radial, upward, lateral] = radar::axes(elevation_rad, azimuth_rad).map(Vector3::from);
    let horizontal_m = range_m * elevation_rad.cos();
    Matrix3::from_columns(&[upward * range_m, lateral * horizontal_m, radial])
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;
    use nalgebra::Vector6;

    const STATES: [[f64; 6]; 4] = [
        [20.0, -13.0, 11.0, 1.5, -2.0, 0.5],
        [-30.0, 0.01, 5.0, 0.0, 3.0, 0.0],
        [1.0, 1.0, 25.0, -4.0, 1.0, 2.0],
        [-5.0, -40.0, -3.0, 0.3, 0.2, -0.1],
    ];

    fn at(s: &Vector6<f64>) -> Vector4<f64> {
        expected(&s.fixed_rows::<3>(0).into(), &s.fixed_rows::<3>(3).into())
    }

    /// An observation from a vehicle: h written again in plain words, its Jacobian by differences, and
    /// both untouched by axes that point where the reading does.
    #[test]
    fn a_radar_elsewhere_that_moves_sees_what_is_relative_to_it() {
        let (place, own) = (Vector3::new(12.0, -9.0, 2.0), Vector3::new(-8.0, 12.0, 1.0));
        for state in STATES {
            let state = Vector6::from(state);
            let at = |s: &Vector6<f64>| {
                let d = s.fixed_rows::<3>(0) - place;
                let v = s.fixed_rows::<3>(3) - own;
                let r = d.norm();
                Vector4::new((d.z / r).asin(), d.y.atan2(d.x), r, d.dot(&v) / r)
            };
            let observation = Observation {
                position_m: place,
                velocity_mps: own,
                ..Observation::new(at(&state), Vector4::repeat(0.1))
            };
            let (p, v) = (
                state.fixed_rows::<3>(0).into(),
                state.fixed_rows::<3>(3).into(),
            );
            assert!((observation.expected(&p, &v) - at(&state)).norm() < 1e-9);
            let h = observation.jacobian(&p, &v);
            for column in 0..6 {
                let mut step = Vector6::zeros();
                step[column] = 1e-6;
                let slope = (at(&(state + step)) - at(&(state - step))) / 2e-6;
                assert!((h.column(column) - slope).norm() < 1e-6);
            }
            let ahead = observation.head_on().expected(&p, &v);
            assert!(ahead[0].abs() < 1e-9 && ahead[1].abs() < 1e-9);
            assert!((ahead[2] - at(&state)[2]).abs() < 1e-9);
            assert!((ahead[3] - at(&state)[3]).abs() < 1e-9);
        }
    }

    #[test]
    fn jacobian_is_the_central_difference() {
        for s in STATES.map(Vector6::from) {
            let h = jacobian(&s.fixed_rows::<3>(0).into(), &s.fixed_rows::<3>(3).into());
            for i in 0..6 {
                let mut step = Vector6::zeros();
                step[i] = 1e-5;
                let numeric = residual(&at(&(s + step)), &at(&(s - step))) / 2e-5;
                assert!((numeric - h.column(i)).norm() < 1e-8, "column {i}");
            }
        }
    }

    #[test]
    fn cartesian_inverts_expected() {
        for s in STATES.map(Vector6::from) {
            let z = at(&s);
            let p = cartesian(z[0], z[1], z[2]);
            assert!((p - s.fixed_rows::<3>(0)).norm() < 1e-12);
            let h = jacobian(&p, &Vector3::zeros());
            let both = h.fixed_view::<3, 3>(0, 0) * cartesian_jacobian(z[0], z[1], z[2]);
            assert!((both - Matrix3::identity()).norm() < 1e-12);
        }
    }

    #[test]
    fn azimuth_residual_crosses_the_cut() {
        let d = residual(
            &Vector4::new(0.1, 3.1, 5.0, 0.0),
            &Vector4::new(0.2, -3.1, 4.0, 1.0),
        );
        assert!((d - Vector4::new(-0.1, 6.2 - TAU, 1.0, -1.0)).norm() < 1e-14);
    }

    /// Away from the zenith it is the same reading: the position that it names, its covariance
    /// and the derivative's kernel; at the zenith the expected angles stay small.
    #[test]
    fn head_on_is_the_same_reading_in_turned_axes() {
        let (z, sigma) = (
            Vector4::new(0.7, 2.1, 30.0, 1.5),
            Vector4::new(1e-3, 2e-3, 0.5, 0.1),
        );
        let observation = Observation::new(z, sigma);
        let turned = observation.head_on();
        let p = cartesian(0.7, 2.1, 30.0);
        let v = p * (1.5 / 30.0) + Vector3::new(0.0, 0.0, 1.0).cross(&p) * 0.02;
        assert!((turned.expected(&p, &v) - turned.z).norm() < 1e-12);
        let information = |o: &Observation| {
            let h = o.jacobian(&p, &v);
            h.transpose() * o.noise().try_inverse().unwrap() * h
        };
        let (a, b) = (information(&observation), information(&turned));
        assert!((a - b).norm() < 1e-5 * a.norm(), "{a} {b}");

        let overhead = Observation {
            z: Vector4::new(1.56, 0.0, 20.0, 0.0),
            ..observation
        };
        let across = overhead
            .head_on()
            .expected(&Vector3::new(-0.2, 0.1, 20.0), &v);
        assert!(across[0].hypot(across[1]) < 0.03, "{across}");
    }

    #[test]
    fn the_origin_and_the_zenith_stay_finite() {
        for p in [Vector3::zeros(), Vector3::new(0.0, 0.0, 10.0)] {
            let v = Vector3::new(1.0, 2.0, 3.0);
            assert!(jacobian(&p, &v).iter().all(|x| x.is_finite()));
            assert!(expected(&p, &v).iter().all(|x| x.is_finite()));
        }
    }
}
