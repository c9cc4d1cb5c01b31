//! The inputs of the memoryless network from two measurements.

use libm::logf;

use crate::Measurement;
use crate::blob::FeatureLayout;
use crate::scalar::Scalar;

/// Most features of any layout.
pub const FEATURES_MAX: usize = 13;

/// The memoryless network's features, not yet normalised; the layout's number of them count.
///
/// `age_s` is the time from the previous to the current measurement. For a first measurement
/// `previous` is the current one and the age zero.
pub fn features(
    layout: FeatureLayout,
    previous: &Measurement,
    current: &Measurement,
    age_s: f32,
) -> [f32; FEATURES_MAX] {
    let s = &current.sigmas;
    let sigmas = [s.range_m, s.elevation_rad, s.azimuth_rad, s.range_rate_mps];
    let (previous_azimuth, sigmas) = match layout {
        FeatureLayout::Polar12 => (previous.azimuth_rad, sigmas),
        FeatureLayout::Polar13 | FeatureLayout::Recursive64 => {
            let difference = Scalar::wrap(previous.azimuth_rad - current.azimuth_rad);
            (current.azimuth_rad + difference, sigmas.map(logf))
        }
    };
    [
        previous.range_m,
        previous.elevation_rad,
        previous_azimuth,
        previous.range_rate_mps,
        current.range_m,
        current.elevation_rad,
        current.azimuth_rad,
        current.range_rate_mps,
        sigmas[0],
        sigmas[1],
        sigmas[2],
        sigmas[3],
        age_s,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Sigmas;

    #[test]
    fn previous_azimuth_stays_within_half_a_turn() {
        let sigmas = Sigmas {
            range_m: 1.0,
            elevation_rad: 0.1,
            azimuth_rad: 0.1,
            range_rate_mps: 0.01,
        };
        let current = Measurement {
            time_us: 0,
            range_m: 30.0,
            elevation_rad: 0.3,
            azimuth_rad: 3.1,
            range_rate_mps: 0.0,
            sigmas,
        };
        let previous = Measurement {
            azimuth_rad: -3.1,
            ..current
        };
        let unwrapped = features(FeatureLayout::Polar13, &previous, &current, 0.1);
        assert!((unwrapped[2] - 3.183_185_3).abs() < 1e-5);
        assert_eq!(unwrapped[8], 0.0);
        assert_eq!(unwrapped[12], 0.1);
        let printed = features(FeatureLayout::Polar12, &previous, &current, 0.1);
        assert_eq!(printed[2], -3.1);
        assert_eq!(printed[8], 1.0);
    }
}
