//! The level frame that looks along the line of sight: radial-horizontal, lateral, vertical.

use crate::radar::HORIZONTAL_FLOOR_M2;
use crate::scalar::Scalar;

/// Turn about the vertical that takes east-north-up to radial-lateral-vertical.
#[derive(Clone, Copy, Debug)]
pub struct LineOfSight<S> {
    /// Cosine of the azimuth.
    pub cosine: S,
    /// Sine of the azimuth.
    pub sine: S,
    /// Range, m.
    pub range_m: S,
}

impl<S: Scalar> LineOfSight<S> {
    /// The line of sight from the origin to `position` (east, north, up), m.
    pub fn to(position: [S; 3]) -> Self {
        let [x, y, z] = position;
        let squared = (x * x + y * y).max(S::constant(HORIZONTAL_FLOOR_M2));
        let horizontal = squared.sqrt();
        Self {
            cosine: x / horizontal,
            sine: y / horizontal,
            range_m: (squared + z * z).sqrt(),
        }
    }

    /// East-north-up to radial-lateral-vertical.
    pub fn level(&self, v: [S; 3]) -> [S; 3] {
        let (c, s) = (self.cosine, self.sine);
        [c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]]
    }

    /// Radial-lateral-vertical to east-north-up.
    pub fn world(&self, v: [S; 3]) -> [S; 3] {
        let (c, s) = (self.cosine, self.sine);
        [c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]]
    }

    /// Variances along the level axes of a world covariance, of which `xx`, `xy`, `yy`, `zz` are
    /// the entries that count.
    pub fn level_variances(&self, xx: S, xy: S, yy: S, zz: S) -> [S; 3] {
        let (cc, ss) = (self.cosine * self.cosine, self.sine * self.sine);
        let cross = S::constant(2.0) * self.cosine * self.sine * xy;
        [cc * xx + ss * yy + cross, ss * xx + cc * yy - cross, zz]
    }

    /// Entries `xx`, `xy`, `yy`, `zz` of the world covariance of independent variances along the
    /// level axes; the others are zero.
    pub fn world_covariance(&self, variances: [S; 3]) -> [S; 4] {
        let (c, s) = (self.cosine, self.sine);
        let (cc, ss) = (c * c, s * s);
        [
            cc * variances[0] + ss * variances[1],
            c * s * (variances[0] - variances[1]),
            ss * variances[0] + cc * variances[1],
            variances[2],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Vector3};

    #[test]
    fn the_position_lies_on_the_radial_axis() {
        let sight = LineOfSight::<f64>::to([-3.0, 4.0, 12.0]);
        let level = sight.level([-3.0, 4.0, 12.0]);
        assert!((level[0] - 5.0).abs() < 1e-12 && level[1].abs() < 1e-12);
        assert_eq!(sight.range_m, 13.0);
        let back = sight.world(level);
        assert!((back[0] + 3.0).abs() < 1e-12 && (back[1] - 4.0).abs() < 1e-12);
    }

    #[test]
    fn variances_survive_the_round_trip() {
        let sight = LineOfSight::<f64>::to([2.0, 1.0, 3.0]);
        let [xx, xy, yy, zz] = sight.world_covariance([4.0, 1.0, 9.0]);
        let variances = sight.level_variances(xx, xy, yy, zz);
        for (got, expected) in variances.into_iter().zip([4.0, 1.0, 9.0]) {
            assert!((got - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn the_zenith_is_finite() {
        let sight = LineOfSight::<f64>::to([0.0, 0.0, 10.0]);
        assert!(sight.cosine.is_finite() && sight.sine.is_finite());
    }

    /// Both turns as one matrix, of a covariance that is full.
    #[test]
    fn the_level_frame_is_a_turn_about_the_vertical() {
        let sight = LineOfSight::<f64>::to([-3.0, 4.0, 12.0]);
        let (c, s) = (-0.6, 0.8);
        let turn = Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
        let vector = [0.7, -1.1, 2.3];
        let (level, world) = (
            turn * Vector3::from(vector),
            turn.transpose() * Vector3::from(vector),
        );
        let full = Matrix3::new(4.0, 1.2, 0.3, 1.2, 2.5, -0.4, 0.3, -0.4, 9.0);
        let variances = (turn * full * turn.transpose()).diagonal();
        let got = sight.level_variances(4.0, 1.2, 2.5, 9.0);
        let diagonal = Matrix3::from_diagonal(&[4.0, 2.5, 9.0].into());
        let spread = turn.transpose() * diagonal * turn;
        for axis in 0..3 {
            assert!((sight.level(vector)[axis] - level[axis]).abs() < 1e-12);
            assert!((sight.world(vector)[axis] - world[axis]).abs() < 1e-12);
            assert!((got[axis] - variances[axis]).abs() < 1e-12);
        }
        let entries = sight.world_covariance([4.0, 2.5, 9.0]);
        let places = [(0, 0), (0, 1), (1, 1), (2, 2)];
        for (entry, place) in entries.into_iter().zip(places) {
            assert!((entry - spread[place]).abs() < 1e-12, "{place:?}");
        }
    }

    /// Within a centimetre of the vertical the frame shrinks instead of spinning.
    #[test]
    fn near_the_zenith_the_horizontal_distance_is_a_centimetre() {
        let sight = LineOfSight::<f64>::to([3e-3, -4e-3, 10.0]);
        assert!((sight.cosine - 0.3).abs() < 1e-12 && (sight.sine + 0.4).abs() < 1e-12);
        assert!((sight.range_m - (1e-4_f64 + 100.0).sqrt()).abs() < 1e-12);
    }
}
