use super::super::*;
use super::bench::{Bench, constant, measurement, now, settings, started};
use crate::blob::Blob;
use crate::blob::draft::Draft;
use crate::estimate::Estimate;
use crate::inference::Inference;
use crate::measurement::Sensed;
use crate::recursive::schedule::OUTPUTS;
use crate::rng::seeded;

/// Ten seconds of silence end a track, coasted or not.
#[test]
fn a_long_silence_starts_anew() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    for (coast_us, after_us, mode) in [
        (0, 10_000_000, Mode::Tracking),
        (0, 10_100_000, Mode::Started),
        (6_000_000, 3_900_000, Mode::Tracking),
        (6_000_000, 4_100_000, Mode::Started),
    ] {
        let mut tracker = started(&bytes);
        if coast_us > 0 {
            tracker.coast(coast_us).expect("a coast");
        }
        let seen = measurement(coast_us + after_us, 33.0, 0.5);
        let estimate = tracker.step(&seen, false).expect("an estimate");
        assert_eq!(estimate.mode, mode, "{coast_us} {after_us}");
    }
    let mut tracker = started(&bytes);
    let anew = tracker.step(&measurement(100_000, 33.0, 0.5), true);
    assert_eq!(anew.expect("an estimate").mode, Mode::Started);
}

/// A track two metres from the sensor's axis, 20 m up, unsure by ten metres along every axis, and what is seen 5 m
/// from the axis a tenth of a second later.
fn blind(bytes: &[u8]) -> (Bench<'_>, Measurement) {
    let mut tracker = started(bytes);
    let target = tracker.belief.target.as_mut().expect("a target");
    target.state[..3].copy_from_slice(&[2.0, 0.0, 20.0]);
    for axis in 0..3 {
        target.covariance[axis][axis] = 100.0;
    }
    let mut seen = measurement(100_000, 20.0, -2.0);
    seen.elevation = Some(Sensed {
        value: 1.3,
        sigma: 0.001,
    });
    (tracker, seen)
}

fn assert_overhead(estimate: &Estimate) {
    let place = crate::radar::position(20.0_f32, 1.3, -2.0);
    for (axis, (there, seen)) in estimate.position_m.iter().zip(place).enumerate() {
        assert!((there - seen).abs() < 1.0, "{axis}");
    }
}

/// Measurements would count for less, the more it is unsure. It is found at the next one, goes on as the same
/// track, and says how sure it is.
#[test]
fn a_track_that_is_blind_overhead_finds_back() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    let (mut tracker, seen) = blind(&bytes);
    let used = now(&tracker).used;
    let estimate = tracker.step(&seen, false).expect("an estimate");
    assert_eq!(
        (estimate.mode, now(&tracker).used),
        (Mode::Tracking, used + 1)
    );
    assert_overhead(&estimate);
    // A variance of 0.09 along the beam, which one look leaves and two would halve.
    let variance_m2 = now(&tracker).position_variance();
    assert!((0.08..0.12).contains(&variance_m2), "{variance_m2}");
    assert!(estimate.nis < 64.0);
}

/// A range from a first radar was a guess, on the wrong side of a second one, which finds the target; the first one
/// itself would have seen an outlier.
#[test]
fn a_second_radar_finds_a_track_on_its_other_side() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    let step = |second: [f32; 3]| {
        let mut tracker = started(&bytes);
        let target = tracker.belief.target.as_mut().expect("a target");
        for axis in 0..3 {
            target.state[axis] = [-10.0, 0.0, 15.0][axis] + second[axis];
            target.covariance[axis][axis] = 36.0;
        }
        let mut seen = measurement(100_000, 30.0, -0.3);
        seen.elevation = Some(Sensed {
            value: 0.9,
            sigma: 0.1,
        });
        seen.azimuth = Some(Sensed {
            value: -0.3,
            sigma: 0.1,
        });
        seen.range = Some(Sensed {
            value: 30.0,
            sigma: 100.0,
        });
        seen.sensor.position_m = second;
        tracker.step(&seen, false).expect("an estimate")
    };
    let away = step([40.0, 0.0, 0.0]);
    assert_eq!(away.mode, Mode::Tracking);
    assert!(away.position_m[0] > 40.0, "{:?}", away.position_m);
    let same = step([0.0; 3]);
    assert!(same.position_m[0] < 0.0, "{:?}", same.position_m);
}

/// Its place is the measurement's, so it cannot say that the measurement was rejected.
#[test]
fn a_blind_track_of_another_velocity_starts_anew() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    let (mut tracker, mut seen) = blind(&bytes);
    seen.range_rate = Some(Sensed {
        value: 300.0,
        sigma: 0.1,
    });
    let estimate = tracker.step(&seen, false).expect("an estimate");
    assert_eq!((estimate.mode, now(&tracker).used), (Mode::Restarted, 1));
    assert_overhead(&estimate);
}

/// The wide gate alone is asked after a place was taken: the tighter one would throw the track away.
#[test]
fn a_blind_track_with_a_suspect_range_rate_goes_on() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    let goes_on = |range_rate: f32| {
        let (mut tracker, mut seen) = blind(&bytes);
        seen.range_rate = Some(Sensed {
            value: range_rate,
            sigma: 0.1,
        });
        let estimate = tracker.step(&seen, false).expect("an estimate");
        estimate.mode == Mode::Tracking
            && estimate.doubt.outlier >= SUSPECT
            && (20.0..64.0).contains(&estimate.nis)
    };
    assert!((0..300).any(|range_rate| goes_on(range_rate as f32)));
}

/// Coasting ends where nothing is known any more, and a reset forgets the track and the numbers.
#[test]
fn a_lost_track_and_a_reset_one_are_gone() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    let mut tracker = started(&bytes);
    let mut track = now(&tracker);
    // Far too fast for the model: nothing but its motion is known of it.
    (track.state[3], track.covariance[3][3]) = (60.0, 1e8);
    tracker.belief.target = Some(track);
    assert!(tracker.coast(1_000_000).is_ok());
    // Ten kilometres a second leave more than a hundred kilometres.
    assert_eq!(tracker.coast(61_000_000), Err(StepError::Lost));
    assert_eq!(tracker.coast(0), Err(StepError::NotStarted));

    let bytes = Draft::recursive(3).bytes();
    let blob = Blob::parse(&bytes).expect("a blob");
    let mut tracker = Bench::new(
        blob,
        Settings {
            inference: Inference::of_passes(4).unwrap(),
            ..settings()
        },
    );
    let flight = |tracker: &mut Bench<'_>| {
        [0, 100_000, 200_000].map(|time_us| tracker.step(&measurement(time_us, 33.0, 0.5), false))
    };
    let first = flight(&mut tracker);
    tracker.belief.rejections = 2;
    tracker.rng = seeded(5);
    tracker.belief.forget();
    assert!(tracker.belief.target.is_none() && tracker.belief.candidate.is_none());
    assert_eq!(tracker.belief.rejections, 0);
    assert_eq!(flight(&mut tracker), first);
}
