//! Two consecutive kept readings and the features that the networks take from them.

use bnkf_model_export::radar::reading::Reading;
use nalgebra::Vector3;

use super::departure::Departure;
use super::recipe::Recipe;
use crate::baseline::sensor::cartesian;
use crate::contest::track::position_of;

/// Two readings with nothing but a gap between them, and what is estimated from them.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// What the network reads, in the order of `features`.
    pub features: Vec<f64>,
    /// Index of the sample whose state is estimated.
    pub sample: usize,
    /// The later reading: the one that corrects.
    pub later: Reading,
}

/// Every kept reading with the next kept one, across gaps too.
pub fn pairs(readings: &[Option<Reading>], recipe: &Recipe) -> Vec<Pair> {
    let kept: Vec<(usize, &Reading)> = readings
        .iter()
        .enumerate()
        .filter_map(|(sample, reading)| Some((sample, reading.as_ref()?)))
        .collect();
    let pair = |both: &[(usize, &Reading)]| {
        let [(before, earlier), (after, later)] = [both[0], both[1]];
        Pair {
            features: features(earlier, later, recipe),
            sample: if recipe.departs(Departure::LookAhead) {
                before
            } else {
                after
            },
            later: *later,
        }
    };
    kept.windows(2).map(pair).collect()
}

/// The paper's twelve: range [m], elevation, azimuth [rad] and range-rate [m/s] of both readings,
/// then the sigmas of range, elevation, azimuth and range-rate. Or the code's seventeen: position
/// [m] and line-of-sight velocity [m/s] of both readings, the four sigmas, and the time between
/// them [s].
fn features(earlier: &Reading, later: &Reading, recipe: &Recipe) -> Vec<f64> {
    let cartesian_features = recipe.departs(Departure::Cartesian);
    let mut features = Vec::with_capacity(recipe.inputs());
    for reading in [earlier, later] {
        if cartesian_features {
            features.extend(position_of(reading).iter());
            features.extend(line_of_sight_mps(reading).iter());
        } else {
            features.extend([
                reading.range_m,
                reading.elevation_rad,
                reading.azimuth_rad,
                reading.range_rate_mps,
            ]);
        }
    }
    features.extend([
        later.sigma_range_m,
        later.sigma_elevation_rad,
        later.sigma_azimuth_rad,
        later.sigma_range_rate_mps,
    ]);
    if cartesian_features {
        features.push((later.time_us - earlier.time_us) as f64 * 1e-6);
    }
    features
}

/// The part of the velocity that the radar sees: the range-rate along the line of sight, m/s.
pub fn line_of_sight_mps(reading: &Reading) -> Vector3<f64> {
    cartesian(
        reading.elevation_rad,
        reading.azimuth_rad,
        reading.range_rate_mps,
    )
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_6};

    use bnkf_model_export::radar::pose::Pose;
    use bnkf_model_export::radar::reading::Reading;

    use super::pairs;
    use crate::replication::departure::Departure;
    use crate::replication::recipe::Recipe;

    fn reading(time_us: u64, range_m: f64, azimuth_rad: f64) -> Reading {
        Reading {
            time_us,
            range_m,
            elevation_rad: FRAC_PI_6,
            azimuth_rad,
            range_rate_mps: 4.0,
            sigma_range_m: 10.0,
            sigma_elevation_rad: 0.02,
            sigma_azimuth_rad: 0.03,
            sigma_range_rate_mps: 0.1,
            sensor: Pose::ORIGIN,
            late_us: 0,
        }
    }

    /// Samples 0, 1, 4 and 6 of seven are measured.
    fn readings() -> Vec<Option<Reading>> {
        let mut readings = vec![None; 7];
        for sample in [0, 1, 4, 6] {
            readings[sample] = Some(reading(100_000 * sample as u64, 20.0, 0.0));
        }
        readings
    }

    #[test]
    fn pairs_reach_across_gaps_and_belong_to_the_stated_reading() {
        let current = Recipe::PAPER.with(Departure::Cartesian);
        let found = pairs(&readings(), &current);
        let samples = |pairs: &[super::Pair]| pairs.iter().map(|p| p.sample).collect::<Vec<_>>();
        assert_eq!(samples(&found), [1, 4, 6]);
        let ages: Vec<f64> = found.iter().map(|pair| pair.features[16]).collect();
        assert_eq!(ages, [100_000.0 * 1e-6, 300_000.0 * 1e-6, 200_000.0 * 1e-6]);
        assert_eq!(found[1].later.time_us, 400_000);
        let ahead = pairs(&readings(), &current.with(Departure::LookAhead));
        assert_eq!(samples(&ahead), [0, 1, 4]);
        // Only what is estimated changes, not what it is estimated from.
        for (current, ahead) in found.iter().zip(&ahead) {
            assert_eq!(current.features, ahead.features);
            assert_eq!(current.later, ahead.later);
        }
        assert!(pairs(&[Some(reading(0, 1.0, 0.0)), None], &current).is_empty());
    }

    #[test]
    fn features_by_hand() {
        let two = [
            Some(reading(0, 20.0, 0.0)),
            Some(reading(250_000, 40.0, FRAC_PI_2)),
        ];
        let polar = &pairs(&two, &Recipe::PAPER)[0].features;
        let expected = [
            20.0, FRAC_PI_6, 0.0, 4.0, 40.0, FRAC_PI_6, FRAC_PI_2, 4.0, 10.0, 0.02, 0.03, 0.1,
        ];
        assert_eq!(polar.as_slice(), expected);
        let cartesian = &pairs(&two, &Recipe::REFERENCE_CODE)[0].features;
        // At 30 degrees up: cos = sqrt(3) / 2, sin = 1 / 2; first due east, then due north.
        let cos = 3.0_f64.sqrt() / 2.0;
        let expected = [
            20.0 * cos,
            0.0,
            10.0,
            4.0 * cos,
            0.0,
            2.0,
            0.0,
            40.0 * cos,
            20.0,
            0.0,
            4.0 * cos,
            2.0,
            10.0,
            0.02,
            0.03,
            0.1,
            0.25,
        ];
        assert_eq!(cartesian.len(), expected.len());
        for (value, expected) in cartesian.iter().zip(expected) {
            assert!((value - expected).abs() < 1e-12, "{cartesian:?}");
        }
    }
}
