//! The memoryless tracker's contract: what it estimates, refuses, and does in gaps.

use bnkf::blob::Blob;
use bnkf::{
    Channel, Correction, Estimate, Measurement, MeasurementError, Mode, Sensed, Sensor, Settings,
    StepError, Tracker,
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
    let sensed = |value, sigma| Some(Sensed { value, sigma });
    Measurement {
        time_us,
        range: sensed(30.0 + angle, 1.0),
        elevation: sensed(0.4, 0.001),
        azimuth: sensed(-2.0 + angle, 0.001),
        range_rate: sensed(0.1, 0.01),
        sensor: Sensor::ORIGIN,
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
    let measured = bnkf::radar::position(30.0, 0.4, -2.0);
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
fn a_memoryless_blob_says_which_channel_it_needs() {
    let mut tracker = tracker(BNKF, Correction::Converted);
    type Damage = fn(&mut Measurement);
    let channels: [(Channel, Damage); 4] = [
        (Channel::Range, |m| m.range = None),
        (Channel::Elevation, |m| m.elevation = None),
        (Channel::Azimuth, |m| m.azimuth = None),
        (Channel::RangeRate, |m| m.range_rate = None),
    ];
    for (channel, damage) in channels {
        let mut partial = measurement(0);
        damage(&mut partial);
        assert_eq!(
            tracker.step(&partial).unwrap_err(),
            StepError::Missing(channel)
        );
    }
    let mut bad = measurement(0);
    bad.range = Some(Sensed {
        value: f32::NAN,
        sigma: 1.0,
    });
    let expected = StepError::Measurement(MeasurementError::NotFinite(Channel::Range));
    assert_eq!(tracker.step(&bad).unwrap_err(), expected);
    assert_eq!(tracker.coast(1).unwrap_err(), StepError::NotStarted);
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
