use super::*;
use crate::blob::draft::Draft;
use crate::measurement::Sensed;
use crate::recursive::Belief;
use crate::sensor::Sensor;
use crate::tracker::Tracker;

/// Tracks of a swarm on one model.
const SWARM: usize = 20;

/// A target that circles slowly, each of its own distance.
fn seen(target: usize, step: u64) -> Measurement {
    let sensed = |value, sigma| Some(Sensed { value, sigma });
    let time_s = 0.1 * step as f32;
    Measurement {
        time_us: 1_000_000 + 100_000 * step,
        range: sensed(25.0 + target as f32 + 0.3 * libm::sinf(7.0 * time_s), 0.3),
        elevation: sensed(0.4, 0.005),
        azimuth: sensed(0.5 + 0.03 * time_s, 0.005),
        range_rate: sensed(0.0, 0.5),
        sensor: Sensor::ORIGIN,
    }
}

/// Many tracks that share a model and a workspace answer as trackers of their own.
#[test]
fn tracks_do_not_know_of_each_other() {
    for draft in [Draft::recursive(3), Draft::memoryless(&[12, 3], 3)] {
        let bytes = draft.bytes();
        let model = Model::new(&bytes).expect("a blob");
        let mut workspace = Workspace::new();
        let of = |target: usize| Settings {
            inference: Inference::of_passes(1 + target as u16 % 5).expect("in range"),
            seed: target as u64,
            ..Settings::of(model.blob())
        };
        let mut tracks: [Track; SWARM] =
            core::array::from_fn(|target| Track::new(&model, of(target)).expect("its own"));
        let mut alone: std::vec::Vec<_> = (0..SWARM)
            .map(|target| Tracker::new(model, of(target)).expect("its own"))
            .collect();
        for step in 0..12 {
            for (target, track) in tracks.iter_mut().enumerate() {
                let (seen, alone) = (seen(target, step), &mut alone[target]);
                let got = track.likelihood(&model, &mut workspace, &seen);
                assert_eq!(got, alone.likelihood(&seen));
                if (step + target as u64).is_multiple_of(4) {
                    let got = track.coast(&model, &mut workspace, seen.time_us);
                    assert_eq!(got, alone.coast(seen.time_us));
                } else {
                    let got = track.step(&model, &mut workspace, &seen);
                    assert_eq!(got, alone.step(&seen));
                }
                let ahead = [seen.time_us + 500_000];
                let got = track.forecasts(&model, &mut workspace, &ahead);
                assert_eq!(got, alone.forecasts(&ahead));
            }
        }
    }
}

/// What earlier forecasts taught bends later ones, position, velocity and acceleration by the same part, and moves
/// nothing else.
#[test]
fn forecasts_bend_by_what_earlier_ones_taught() {
    let bytes = Draft::recursive(3).bytes();
    let model = Model::new(&bytes).expect("a blob");
    let mut workspace = Workspace::new();
    let mut plain = Track::new(&model, Settings::of(model.blob())).expect("its own");
    let mut now = None;
    for step in 0..8 {
        now = plain.step(&model, &mut workspace, &seen(3, step)).ok();
    }
    let now = now.expect("an estimate");
    let mut taught = plain.clone();
    let State::Recursive(Belief { target, .. }) = &mut taught.state else {
        panic!("recursive");
    };
    let foresight = &mut target.as_mut().expect("a target").foresight;
    (foresight.followed, foresight.bent) = (1.5, 4.0);
    let horizons_s = [0.5, 1.0, 2.0_f32];
    let times_us = horizons_s.map(|ahead_s| now.time_us + (1e6 * ahead_s) as u64);
    let full = plain.forecasts(&model, &mut workspace, &times_us);
    let half = taught.forecasts(&model, &mut workspace, &times_us);
    let pairs = full
        .expect("forecasts")
        .into_iter()
        .zip(half.expect("forecasts"));
    let velocity_mps = now.motion.expect("recursive").velocity_mps;
    let mut bent_m = 0.0_f32;
    for (ahead_s, (full, half)) in horizons_s.into_iter().zip(pairs) {
        let (fully, halfway) = (full.motion.expect("it"), half.motion.expect("it"));
        for axis in 0..3 {
            let straight_m = now.position_m[axis] + velocity_mps[axis] * ahead_s;
            bent_m = bent_m.max((full.position_m[axis] - straight_m).abs());
            for (straight, full, half) in [
                (straight_m, full.position_m[axis], half.position_m[axis]),
                (
                    velocity_mps[axis],
                    fully.velocity_mps[axis],
                    halfway.velocity_mps[axis],
                ),
                (
                    0.0,
                    fully.acceleration_mps2[axis],
                    halfway.acceleration_mps2[axis],
                ),
            ] {
                let expected = 0.5 * (straight + full);
                assert!((half - expected).abs() < 1e-4, "{half} {expected}");
            }
        }
    }
    assert!(bent_m > 0.05, "{bent_m}");
    let next = seen(3, 8);
    assert_eq!(
        plain.step(&model, &mut workspace, &next),
        taught.step(&model, &mut workspace, &next)
    );
}

/// Twenty tracks on one model fit where one tracker of each would not.
#[test]
fn a_swarm_takes_36_kilobytes() {
    let swarm = SWARM * TRACK_BYTES_MAX + crate::WORKSPACE_BYTES_MAX + crate::MODEL_BYTES_MAX;
    assert!(swarm <= 36 * 1024, "{swarm}");
    const { assert!(TRACK_BYTES_MAX <= 1_536) };
}

/// In place it becomes what a new one is, whatever it was.
#[test]
fn a_track_begins_again_where_it_is() {
    let blobs = [Draft::recursive(3), Draft::memoryless(&[12, 3], 3)].map(|draft| draft.bytes());
    let [first, second] = [0, 1].map(|i: usize| Model::new(&blobs[i]).expect("a blob"));
    let mut workspace = Workspace::new();
    let mut track = Track::idle();
    let refusal = track.step(&first, &mut workspace, &seen(0, 0));
    assert_eq!(refusal, Err(StepError::OtherModel));
    for model in [first, second, first] {
        let settings = Settings {
            seed: 9,
            ..Settings::of(model.blob())
        };
        track.begin(&model, settings).expect("its own");
        let mut fresh = Track::new(&model, settings).expect("its own");
        assert_eq!((track.kind(), track.settings()), (model.kind(), settings));
        assert_eq!(track.latest_us(), None);
        for step in 0..4 {
            let expected = fresh.step(&model, &mut workspace, &seen(3, step));
            let got = track.step(&model, &mut workspace, &seen(3, step));
            assert!(got.is_ok());
            assert_eq!(got, expected);
        }
    }
    let wrong = Settings {
        correction: Correction::None,
        ..Settings::of(first.blob())
    };
    let before = std::format!("{track:?}");
    let refusal = track.begin(&first, wrong);
    assert_eq!(refusal, Err(TrackerError::Correction(Correction::None)));
    assert_eq!(std::format!("{track:?}"), before);
}

/// A reset track answers as a new one, from the start of its random stream.
#[test]
fn a_reset_track_is_a_new_one() {
    for draft in [Draft::recursive(3), Draft::ensemble(3)] {
        let bytes = draft.bytes();
        let model = Model::new(&bytes).expect("a blob");
        let settings = Settings {
            inference: Inference::of_passes(4).expect("in range"),
            ..Settings::of(model.blob())
        };
        let mut track = Track::new(&model, settings).expect("its own");
        let mut workspace = Workspace::new();
        let mut flight = |track: &mut Track| {
            [0, 1, 2].map(|step| track.step(&model, &mut workspace, &seen(5, step)))
        };
        let first = flight(&mut track);
        assert!(first.iter().all(Result::is_ok));
        track.reset();
        assert_eq!(flight(&mut track), first);
    }
}

/// A call that is refused leaves no trace, not in the random stream either: the track is the same to the byte.
#[test]
fn what_is_refused_leaves_no_trace() {
    for (mut draft, outputs) in [
        (Draft::recursive(3), 36),
        (Draft::memoryless(&[12, 3], 3), 3),
    ] {
        let bytes = draft.bytes();
        let model = Model::new(&bytes).expect("a blob");
        // Another model, whose answers are not finite.
        draft.outputs[..outputs].fill([3e38, 3e38]);
        let bytes = draft.bytes();
        let endless = Model::new(&bytes).expect("a blob");
        let mut workspace = Workspace::new();
        let settings = Settings {
            inference: Inference::of_passes(4).expect("in range"),
            ..Settings::of(model.blob())
        };
        let mut track = Track::new(&model, settings).expect("its own");
        for step in 0..5 {
            track
                .step(&model, &mut workspace, &seen(3, step))
                .expect("an estimate");
        }
        track.hand_over(&endless).expect("of its kind");
        let written = |track: &Track| {
            let mut bytes = [0; TRACK_SNAPSHOT_BYTES];
            track.to_bytes(&mut bytes);
            bytes
        };
        let before = written(&track);
        let refused = track.step(&endless, &mut workspace, &seen(3, 6));
        assert_eq!(refused, Err(StepError::NetworkNotFinite));
        assert_eq!(written(&track), before);
        if track.kind() == Kind::Recursive {
            let refused = track.coast(&endless, &mut workspace, seen(3, 6).time_us);
            assert_eq!(refused, Err(StepError::NetworkNotFinite));
            assert_eq!(written(&track), before);
        } else {
            // After a strange time it would start anew, if it were not refused.
            let strange = track.step(&endless, &mut workspace, &seen(3, 10_000));
            assert!(matches!(strange, Err(StepError::TimeTooFarAhead { .. })));
            let refused = track.step(&endless, &mut workspace, &seen(3, 10_001));
            assert_eq!(refused, Err(StepError::NetworkNotFinite));
            let time_us = seen(3, 6).time_us;
            assert!(track.coast(&endless, &mut workspace, time_us).is_ok());
        }
    }
}

/// A track of which nothing is known any more is one that can be written and read.
#[test]
fn a_lost_track_comes_back_from_bytes() {
    let bytes = Draft::memoryless(&[12, 3], 3).bytes();
    let model = Model::new(&bytes).expect("a blob");
    let mut workspace = Workspace::new();
    let mut track = Track::new(&model, Settings::of(model.blob())).expect("its own");
    for step in 0..5 {
        track
            .step(&model, &mut workspace, &seen(3, step))
            .expect("an estimate");
    }
    let mut time_us = seen(3, 5).time_us;
    while track.coast(&model, &mut workspace, time_us).is_ok() {
        time_us += 60_000_000;
    }
    assert_eq!(
        track.coast(&model, &mut workspace, time_us),
        Err(StepError::NotStarted)
    );
    let mut bytes = [0; TRACK_SNAPSHOT_BYTES];
    track.to_bytes(&mut bytes);
    assert_eq!(Track::from_bytes(&bytes).map(|_| ()), Ok(()));
}
