//! The level frame that looks along the line of sight: radial-horizontal, lateral, vertical.

use crate::kernel::sqrt;

/// Squared horizontal distance, m^2, below which the azimuth of the line of sight is not followed.
/// Keeps every division finite when a flight passes through the zenith.
const HORIZONTAL_FLOOR_M2: f32 = 1e-4;

/// Turn about the vertical that takes east-north-up to radial-lateral-vertical.
#[derive(Clone, Copy, Debug)]
pub struct LineOfSight {
    /// Cosine of the azimuth.
    pub cosine: f32,
    /// Sine of the azimuth.
    pub sine: f32,
    /// Range, m.
    pub range_m: f32,
}

impl LineOfSight {
    /// The line of sight from the origin to `position` (east, north, up), m.
    pub fn to(position: [f32; 3]) -> Self {
        let [x, y, z] = position;
        let squared = x * x + y * y;
        let squared = if squared > HORIZONTAL_FLOOR_M2 {
            squared
        } else {
            HORIZONTAL_FLOOR_M2
        };
        let horizontal = sqrt(squared);
        Self {
            cosine: x / horizontal,
            sine: y / horizontal,
            range_m: sqrt(squared + z * z),
        }
    }

    /// East-north-up to radial-lateral-vertical.
    pub fn level(&self, v: [f32; 3]) -> [f32; 3] {
        let (c, s) = (self.cosine, self.sine);
        [c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]]
    }

    /// Radial-lateral-vertical to east-north-up.
    pub fn world(&self, v: [f32; 3]) -> [f32; 3] {
        let (c, s) = (self.cosine, self.sine);
        [c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]]
    }

    /// Variances along the level axes of a world covariance, of which `xx`, `xy`, `yy`, `zz` are
    /// the entries that count.
    pub fn level_variances(&self, xx: f32, xy: f32, yy: f32, zz: f32) -> [f32; 3] {
        let (cc, ss) = (self.cosine * self.cosine, self.sine * self.sine);
        let cross = 2.0 * self.cosine * self.sine * xy;
        [cc * xx + ss * yy + cross, ss * xx + cc * yy - cross, zz]
    }

    /// Entries `xx`, `xy`, `yy`, `zz` of the world covariance of independent variances along the
    /// level axes; the others are zero.
    pub fn world_covariance(&self, variances: [f32; 3]) -> [f32; 4] {
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
