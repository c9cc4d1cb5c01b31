//! The inputs of the memoryless network from two measurements.

use libm::logf;

use super::plot::Plot;
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
    previous: &Plot,
    current: &Plot,
    age_s: f32,
) -> [f32; FEATURES_MAX] {
    let sigmas = [
        current.range.sigma,
        current.elevation.sigma,
        current.azimuth.sigma,
        current.range_rate.sigma,
    ];
    let (previous_azimuth, sigmas) = match layout {
        FeatureLayout::Polar12 => (previous.azimuth.value, sigmas),
        FeatureLayout::Polar13 | FeatureLayout::Recursive64 => {
            let difference = Scalar::wrap(previous.azimuth.value - current.azimuth.value);
            (current.azimuth.value + difference, sigmas.map(logf))
        }
    };
    [
        previous.range.value,
        previous.elevation.value,
        previous_azimuth,
        previous.range_rate.value,
        current.range.value,
        current.elevation.value,
        current.azimuth.value,
        current.range_rate.value,
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
    use crate::measurement::Sensed;

    #[test]
    fn previous_azimuth_stays_within_half_a_turn() {
        let sensed = |value, sigma| Sensed { value, sigma };
        let current = Plot {
            time_us: 0,
            range: sensed(30.0, 1.0),
            elevation: sensed(0.3, 0.1),
            azimuth: sensed(3.1, 0.2),
            range_rate: sensed(-1.5, 0.01),
        };
        let previous = Plot {
            range: sensed(31.0, 1.0),
            elevation: sensed(0.25, 0.1),
            azimuth: sensed(-3.1, 0.2),
            range_rate: sensed(-1.25, 0.01),
            ..current
        };
        let unwrapped = features(FeatureLayout::Polar13, &previous, &current, 0.1);
        assert!((unwrapped[2] - 3.183_185_3).abs() < 1e-5);
        assert_eq!(unwrapped[8], 0.0);
        assert_eq!(unwrapped[12], 0.1);
        let printed = features(FeatureLayout::Polar12, &previous, &current, 0.1);
        assert_eq!(printed[2], -3.1);
        let first = [
            31.0, 0.25, -3.1, -1.25, 30.0, 0.3, 3.1, -1.5, 1.0, 0.1, 0.2, 0.01,
        ];
        assert_eq!(printed[..12], first);
    }
}
