//! The memoryless tracker's contract: what it estimates, refuses, and does in gaps.

use bnkf::blob::Blob;
use bnkf::{
    Correction, Estimate, Measurement, MeasurementError, MeasurementField, Mode, Settings, Sigmas,
    StepError, Tracker, TrackerError,
};

const BNKF: &[u8] = include_bytes!("golden/tiny_bnkf.bnkf");
const BNKFE: &[u8] = include_bytes!("golden/tiny_bnkfe.bnkf");

fn tracker(bytes: &[u8], correction: Correction) -> Tracker<'_> {
    let blob = Blob::parse(bytes).expect("golden blob");
    let settings = Settings {
        correction,
        ..Settings::of(&blob)
    };
    Tracker::new(blob, settings).expect("valid settings")
}

fn measurement(time_us: u64) -> Measurement {
    let angle = time_us as f32 * 1e-7;
    Measurement {
        time_us,
        range_m: 30.0 + angle,
        elevation_rad: 0.4,
        azimuth_rad: -2.0 + angle,
        range_rate_mps: 0.1,
        sigmas: Sigmas {
            range_m: 1.0,
            elevation_rad: 0.001,
            azimuth_rad: 0.001,
            range_rate_mps: 0.01,
        },
    }
}

fn trace(estimate: &Estimate) -> f32 {
    (0..3).map(|axis| estimate.covariance_m2[axis][axis]).sum()
}

#[test]
fn the_first_measurement_gives_an_estimate() {
    let mut tracker = tracker(BNKF, Correction::None);
    let first = tracker.step(&measurement(0)).expect("accepted");
    assert_eq!((first.mode, first.nis), (Mode::Started, 0.0));
    assert_eq!(
        tracker.step(&measurement(100_000)).unwrap().mode,
        Mode::Tracking
    );
    // After more than two seconds of silence the previous measurement is forgotten.
    assert_eq!(
        tracker.step(&measurement(2_200_001)).unwrap().mode,
        Mode::Started
    );
}

#[test]
fn correction_moves_the_estimate_to_the_measurement_and_shrinks_the_covariance() {
    let measured = bnkf::radar::converted(&measurement(0)).position;
    let distance = |e: &Estimate| {
        (0..3)
            .map(|i| (e.position_m[i] - measured[i]).powi(2))
            .sum::<f32>()
            .sqrt()
    };
    for bytes in [BNKF, BNKFE] {
        let alone = tracker(bytes, Correction::None)
            .step(&measurement(0))
            .unwrap();
        for correction in [Correction::Converted, Correction::Polar] {
            let corrected = tracker(bytes, correction).step(&measurement(0)).unwrap();
            assert!(trace(&corrected) < trace(&alone));
            assert!(corrected.nis > 0.0);
            if correction == Correction::Converted {
                assert!(distance(&corrected) < distance(&alone));
            }
        }
    }
}

#[test]
fn an_ensemble_has_a_diagonal_covariance_of_its_own() {
    let joint = tracker(BNKF, Correction::None)
        .step(&measurement(0))
        .unwrap();
    let ensemble = tracker(BNKFE, Correction::None)
        .step(&measurement(0))
        .unwrap();
    for i in 0..3 {
        for j in 0..3 {
            assert_eq!(ensemble.covariance_m2[i][j] == 0.0, i != j);
            assert_ne!(joint.covariance_m2[i][j], 0.0);
        }
    }
}

#[test]
fn gaps_are_coasted_with_a_growing_covariance() {
    let mut tracker = tracker(BNKF, Correction::Converted);
    assert_eq!(tracker.coast(0).unwrap_err(), StepError::NotStarted);
    tracker.step(&measurement(0)).unwrap();
    let mut last = trace(&tracker.step(&measurement(100_000)).unwrap());
    for time_us in (200_000..900_000).step_by(100_000) {
        let estimate = tracker.coast(time_us).unwrap();
        assert_eq!((estimate.mode, estimate.time_us), (Mode::Coasting, time_us));
        assert!(trace(&estimate) > last);
        last = trace(&estimate);
    }
    assert_eq!(
        tracker.step(&measurement(900_000)).unwrap().mode,
        Mode::Tracking
    );
}

#[test]
fn time_that_goes_back_is_refused_and_changes_nothing() {
    let mut tracker = tracker(BNKF, Correction::None);
    tracker.step(&measurement(0)).unwrap();
    tracker.step(&measurement(200_000)).unwrap();
    let refused = StepError::TimeWentBack {
        latest_us: 200_000,
        given_us: 199_999,
    };
    assert_eq!(tracker.step(&measurement(199_999)).unwrap_err(), refused);
    assert_eq!(tracker.coast(199_999).unwrap_err(), refused);
    let mut undisturbed = self::tracker(BNKF, Correction::None);
    undisturbed.step(&measurement(0)).unwrap();
    undisturbed.step(&measurement(200_000)).unwrap();
    let next = measurement(300_000);
    assert_eq!(
        tracker.step(&next).unwrap(),
        undisturbed.step(&next).unwrap()
    );
}

#[test]
fn unusable_measurements_are_refused_by_field() {
    let mut tracker = tracker(BNKF, Correction::Converted);
    let good = measurement(0);
    type Damage = fn(&mut Measurement, f32);
    let fields: [(MeasurementField, Damage); 8] = [
        (MeasurementField::Range, |m, v| m.range_m = v),
        (MeasurementField::Elevation, |m, v| m.elevation_rad = v),
        (MeasurementField::Azimuth, |m, v| m.azimuth_rad = v),
        (MeasurementField::RangeRate, |m, v| m.range_rate_mps = v),
        (MeasurementField::SigmaRange, |m, v| m.sigmas.range_m = v),
        (MeasurementField::SigmaElevation, |m, v| {
            m.sigmas.elevation_rad = v
        }),
        (MeasurementField::SigmaAzimuth, |m, v| {
            m.sigmas.azimuth_rad = v
        }),
        (MeasurementField::SigmaRangeRate, |m, v| {
            m.sigmas.range_rate_mps = v
        }),
    ];
    for (index, (field, damage)) in fields.into_iter().enumerate() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut bad = good;
            damage(&mut bad, value);
            let expected = StepError::Measurement(MeasurementError::NotFinite(field));
            assert_eq!(tracker.step(&bad).unwrap_err(), expected);
        }
        if index >= 4 {
            let mut bad = good;
            damage(&mut bad, 0.0);
            let expected = StepError::Measurement(MeasurementError::NotPositive(field));
            assert_eq!(tracker.step(&bad).unwrap_err(), expected);
        }
    }
    assert_eq!(tracker.coast(1).unwrap_err(), StepError::NotStarted);
}

/// Finite but absurd values end in a typed refusal or a finite estimate, never in NaN.
#[test]
fn extreme_measurements_never_give_nan() {
    for bytes in [BNKF, BNKFE] {
        for correction in [Correction::None, Correction::Converted, Correction::Polar] {
            for value in [0.0, -1e-30, 1e-30, -1e10, 1e30, f32::MAX, f32::MIN] {
                let mut tracker = tracker(bytes, correction);
                let mut extreme = measurement(0);
                extreme.range_m = value;
                extreme.azimuth_rad = value;
                extreme.sigmas.range_m = value.abs().max(f32::MIN_POSITIVE);
                if let Ok(estimate) = tracker.step(&extreme) {
                    assert!(estimate.position_m.iter().all(|p| p.is_finite()));
                    assert!(
                        estimate
                            .covariance_m2
                            .iter()
                            .flatten()
                            .all(|p| p.is_finite())
                    );
                }
            }
        }
    }
}

#[test]
fn the_seed_decides_the_estimates() {
    let run = |seed| {
        let blob = Blob::parse(BNKF).unwrap();
        let settings = Settings {
            seed,
            ..Settings::of(&blob)
        };
        let mut tracker = Tracker::new(blob, settings).unwrap();
        let first = tracker.step(&measurement(0)).unwrap();
        tracker.reset();
        assert_eq!(tracker.step(&measurement(0)).unwrap(), first);
        first
    };
    assert_eq!(run(5), run(5));
    assert_ne!(run(5), run(6));
}

#[test]
fn passes_out_of_range_are_refused() {
    let blob = Blob::parse(BNKF).unwrap();
    for passes in [0, 10_001] {
        let settings = Settings {
            passes,
            ..Settings::of(&blob)
        };
        assert_eq!(
            Tracker::new(blob, settings).err(),
            Some(TrackerError::Passes(passes))
        );
    }
}
