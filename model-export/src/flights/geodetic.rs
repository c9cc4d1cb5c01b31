//! Latitude, longitude and height as places in a local frame.

/// WGS 84: equatorial radius, metres.
const EQUATOR_M: f64 = 6_378_137.0;
/// WGS 84: flattening.
const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// First eccentricity squared.
const ECCENTRICITY_2: f64 = FLATTENING * (2.0 - FLATTENING);

/// A place on or above the ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geodetic {
    /// Degrees, north positive.
    pub latitude_deg: f64,
    /// Degrees, east positive.
    pub longitude_deg: f64,
    /// Metres above the ellipsoid, or above anything else that all places count from.
    pub height_m: f64,
}

impl Geodetic {
    /// Whether latitude and longitude are ones.
    #[must_use]
    pub fn is_a_place(&self) -> bool {
        self.latitude_deg.abs() <= 90.0 && self.longitude_deg.abs() <= 360.0
    }

    /// East, north, up of `origin`, metres, along its own axes (not the curved ones of a map).
    #[must_use]
    pub fn east_north_up(&self, origin: &Self) -> [f64; 3] {
        let [a, b] = [self, origin].map(Self::earth_centred);
        let [dx, dy, dz] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
        let (sin_lat, cos_lat) = sine_cosine(origin.latitude_deg);
        let (sin_lon, cos_lon) = sine_cosine(origin.longitude_deg);
        let outward = cos_lon * dx + sin_lon * dy;
        [
            cos_lon * dy - sin_lon * dx,
            cos_lat * dz - sin_lat * outward,
            cos_lat * outward + sin_lat * dz,
        ]
    }

    /// Earth-centred, earth-fixed, metres.
    fn earth_centred(&self) -> [f64; 3] {
        let (sin_lat, cos_lat) = sine_cosine(self.latitude_deg);
        let (sin_lon, cos_lon) = sine_cosine(self.longitude_deg);
        let normal_m = EQUATOR_M / (1.0 - ECCENTRICITY_2 * sin_lat * sin_lat).sqrt();
        let across_m = (normal_m + self.height_m) * cos_lat;
        [
            across_m * cos_lon,
            across_m * sin_lon,
            (normal_m * (1.0 - ECCENTRICITY_2) + self.height_m) * sin_lat,
        ]
    }
}

fn sine_cosine(degrees: f64) -> (f64, f64) {
    let radians = degrees.to_radians();
    (libm::sin(radians), libm::cos(radians))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ORIGIN: Geodetic = Geodetic {
        latitude_deg: 47.397_742,
        longitude_deg: 8.545_594,
        height_m: 488.0,
    };

    /// Radii of curvature of the ellipsoid: a small step north, east, up.
    #[test]
    fn small_steps_have_the_length_of_the_radii_of_curvature() {
        let step_deg = 1e-5_f64;
        let sin_lat = ORIGIN.latitude_deg.to_radians().sin();
        let w = 1.0 - ECCENTRICITY_2 * sin_lat * sin_lat;
        let meridian_m = EQUATOR_M * (1.0 - ECCENTRICITY_2) / w.powf(1.5) + ORIGIN.height_m;
        let parallel_m =
            (EQUATOR_M / w.sqrt() + ORIGIN.height_m) * ORIGIN.latitude_deg.to_radians().cos();
        let north = Geodetic {
            latitude_deg: ORIGIN.latitude_deg + step_deg,
            ..ORIGIN
        };
        let east = Geodetic {
            longitude_deg: ORIGIN.longitude_deg + step_deg,
            ..ORIGIN
        };
        let up = Geodetic {
            height_m: ORIGIN.height_m + 2.0,
            ..ORIGIN
        };
        let near =
            |got: [f64; 3], expected: [f64; 3]| (0..3).all(|i| (got[i] - expected[i]).abs() < 2e-6);
        let radians = step_deg.to_radians();
        assert!(near(
            north.east_north_up(&ORIGIN),
            [0.0, radians * meridian_m, 0.0]
        ));
        assert!(near(
            east.east_north_up(&ORIGIN),
            [radians * parallel_m, 0.0, 0.0]
        ));
        assert!(near(up.east_north_up(&ORIGIN), [0.0, 0.0, 2.0]));
    }

    #[test]
    fn a_latitude_has_its_limits() {
        assert!(ORIGIN.is_a_place());
        assert!(
            !Geodetic {
                latitude_deg: 473_977_420.0,
                ..ORIGIN
            }
            .is_a_place()
        );
        assert!(
            !Geodetic {
                longitude_deg: f64::NAN,
                ..ORIGIN
            }
            .is_a_place()
        );
    }
}
