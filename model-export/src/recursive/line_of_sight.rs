//! The level frame that looks along the line of sight: radial-horizontal, lateral, vertical.

use super::scalar::Scalar;

/// Squared horizontal distance below which the azimuth of the line of sight is not followed,
/// square metres. Keeps every division finite when a flight passes through the zenith.
pub const HORIZONTAL_FLOOR_M2: f64 = 1e-4;

/// Turn about the vertical that takes east-north-up to radial-lateral-vertical.
#[derive(Clone, Copy, Debug)]
pub struct LineOfSight<S> {
    /// Cosine of the azimuth.
    pub cosine: S,
    /// Sine of the azimuth.
    pub sine: S,
    /// Horizontal distance, metres, squared and kept above [`HORIZONTAL_FLOOR_M2`].
    pub horizontal_m2: S,
    /// Horizontal distance, metres.
    pub horizontal_m: S,
    /// Range, metres.
    pub range_m: S,
}

impl<S: Scalar> LineOfSight<S> {
    /// The line of sight from the origin to `position` (east, north, up), metres.
    pub fn to(position: [S; 3]) -> Self {
        let [x, y, z] = position;
        let horizontal_m2 = (x * x + y * y).max(S::constant(HORIZONTAL_FLOOR_M2));
        let horizontal_m = horizontal_m2.sqrt();
        Self {
            cosine: x / horizontal_m,
            sine: y / horizontal_m,
            horizontal_m2,
            horizontal_m,
            range_m: (horizontal_m2 + z * z).sqrt(),
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

    /// Variances along the three level axes of a 3 x 3 covariance in the world frame.
    pub fn level_variances(&self, covariance: &[[S; 3]; 3]) -> [S; 3] {
        let (c, s) = (self.cosine, self.sine);
        let (cc, ss) = (c * c, s * s);
        let cross = S::constant(2.0) * c * s * covariance[0][1];
        [
            cc * covariance[0][0] + ss * covariance[1][1] + cross,
            ss * covariance[0][0] + cc * covariance[1][1] - cross,
            covariance[2][2],
        ]
    }

    /// The world covariance of three independent variances along the level axes.
    pub fn world_covariance(&self, variances: [S; 3]) -> [[S; 3]; 3] {
        let (c, s) = (self.cosine, self.sine);
        let (cc, ss) = (c * c, s * s);
        let zero = S::constant(0.0);
        let cross = c * s * (variances[0] - variances[1]);
        [
            [cc * variances[0] + ss * variances[1], cross, zero],
            [cross, ss * variances[0] + cc * variances[1], zero],
            [zero, zero, variances[2]],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let variances = sight.level_variances(&sight.world_covariance([4.0, 1.0, 9.0]));
        for (got, expected) in variances.into_iter().zip([4.0, 1.0, 9.0]) {
            assert!((got - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn the_zenith_is_finite() {
        let sight = LineOfSight::<f64>::to([0.0, 0.0, 10.0]);
        assert!(sight.cosine.is_finite() && sight.horizontal_m > 0.0);
    }
}
