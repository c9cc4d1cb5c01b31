//! Places around a radar that its own volume leaves out.

use crate::random_source::RandomSource;
use serde::{Deserialize, Serialize};

/// Where a flight's centre may be beside the volume.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Elsewhere {
    /// Least and largest range, m; drawn evenly in its logarithm.
    pub range_m: [f64; 2],
    /// Least and largest elevation, degrees; drawn evenly.
    pub elevation_deg: [f64; 2],
}

impl Elsewhere {
    /// One place; east, north, up, m.
    pub fn draw(&self, random: &mut RandomSource) -> [f64; 3] {
        let [nearest, farthest] = self.range_m.map(f64::ln);
        let range_m = random.uniform(nearest, farthest).exp();
        let [low, high] = self.elevation_deg.map(f64::to_radians);
        let azimuth_rad = random.uniform(0.0, core::f64::consts::TAU);
        bnkf::radar::position(range_m, random.uniform(low, high), azimuth_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_fill_what_they_are_said_to() {
        let elsewhere = Elsewhere {
            range_m: [5.0, 80.0],
            elevation_deg: [-60.0, 85.0],
        };
        let mut random = RandomSource::new(1, &[]);
        let (mut near, mut low) = (0, 0);
        for _ in 0..2000 {
            let [x, y, z] = elsewhere.draw(&mut random);
            let range = x.hypot(y).hypot(z);
            let elevation_deg = (z / range).asin().to_degrees();
            assert!((5.0 - 1e-9..80.0 + 1e-9).contains(&range));
            assert!((-60.0 - 1e-9..85.0 + 1e-9).contains(&elevation_deg));
            near += usize::from(range < 20.0);
            low += usize::from(elevation_deg < 0.0);
        }
        // Halves of the logarithm of the range; 60 of 145 degrees.
        assert!((900..1100).contains(&near), "{near}");
        assert!((720..930).contains(&low), "{low}");
    }
}
