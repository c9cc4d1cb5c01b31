use super::*;
use crate::blob::draft::Draft;
use crate::inference::Inference;
use crate::model::Model;
use crate::step_error::StepError;
use crate::workspace::Workspace;
use proptest::prelude::*;

type Bytes = [u8; TRACK_SNAPSHOT_BYTES];

fn seen(step: u64) -> Measurement {
    let sensed = |value, sigma| Some(Sensed { value, sigma });
    let time_s = 0.1 * step as f32;
    // Now and then something else is seen, so that there is a candidate.
    let ghost = if step % 9 > 5 { 20.0 } else { 0.0 };
    Measurement {
        time_us: 1_000_000 + 100_000 * step,
        range: sensed(33.0 + 0.5 * libm::sinf(7.0 * time_s) + ghost, 0.3),
        elevation: sensed(0.4, 0.005),
        azimuth: sensed(0.5 + 0.03 * time_s, 0.005),
        range_rate: sensed(0.0, 0.5),
        sensor: Sensor::ORIGIN,
    }
}

fn drafts() -> [Draft; 3] {
    [
        Draft::recursive(3),
        Draft::memoryless(&[12, 3], 3),
        Draft::ensemble(3),
    ]
}

/// A track after so many steps, a coast last if there were any.
fn track(model: &Model<'_>, steps: u64) -> Track {
    let settings = Settings {
        inference: Inference::of_passes(3).expect("in range"),
        ..Settings::of(model.blob())
    };
    let mut track = Track::new(model, settings).expect("its own settings");
    let mut workspace = Workspace::new();
    for step in 0..steps {
        track
            .step(model, &mut workspace, &seen(step))
            .expect("a step");
    }
    if steps > 0 {
        let time_us = seen(steps).time_us;
        track
            .coast(model, &mut workspace, time_us)
            .expect("a coast");
    }
    track
}

fn written(track: &Track) -> Bytes {
    let mut bytes = [0xff; TRACK_SNAPSHOT_BYTES];
    track.to_bytes(&mut bytes);
    bytes
}

/// The bytes with a checksum that is right.
fn sealed(mut bytes: Bytes) -> Bytes {
    let end = TRACK_SNAPSHOT_BYTES - CRC_BYTES;
    let crc = CRC32.checksum(&bytes[..end]);
    bytes[end..].copy_from_slice(&crc.to_le_bytes());
    bytes
}

/// What a track answers from then on: estimates as they are, refusals.
fn answers(model: &Model<'_>, mut track: Track) -> std::vec::Vec<std::string::String> {
    let mut workspace = Workspace::new();
    let from_us = track.latest_us().unwrap_or_default().min(1 << 60);
    let mut list = std::vec::Vec::new();
    for step in 1..12 {
        let time_us = from_us + 100_000 * step;
        let measurement = Measurement {
            time_us,
            ..seen(step)
        };
        let fit = track.likelihood(model, &mut workspace, &measurement);
        let ahead = track.forecasts(model, &mut workspace, &[time_us + 500_000]);
        let estimate = if step % 4 == 3 {
            track.coast(model, &mut workspace, time_us)
        } else {
            track.step(model, &mut workspace, &measurement)
        };
        if let Ok(fit) = fit {
            assert!(fit.nis.is_finite() && fit.ln_likelihood.is_finite());
        }
        let ahead = ahead.map(|[ahead]| ahead);
        for estimate in [&ahead, &estimate].into_iter().flatten() {
            assert!(estimate.position_m.iter().all(|x| x.is_finite()));
            assert!(crate::cholesky::is_definite(&estimate.covariance_m2));
            assert!(estimate.nis.is_finite() && estimate.doubt.manoeuvre.is_finite());
            assert!(estimate.doubt.outlier.is_finite());
            if let Some(motion) = &estimate.motion {
                assert!(crate::cholesky::is_definite(&motion.covariance));
                let moving = motion.velocity_mps.iter().chain(&motion.acceleration_mps2);
                assert!(moving.into_iter().all(|x| x.is_finite()));
            }
        }
        // What it has become is a track as well.
        assert_eq!(Track::from_bytes(&written(&track)).map(|_| ()), Ok(()));
        list.push(std::format!("{fit:?} {ahead:?} {estimate:?}"));
    }
    list
}

/// Every bit comes back, and so does all that follows.
#[test]
fn a_track_that_was_written_goes_on_as_it_would_have() {
    for draft in drafts() {
        let blob = draft.bytes();
        let model = Model::new(&blob).expect("a blob");
        for steps in [0, 1, 2, 7, 8, 9, 10, 40] {
            let track = track(&model, steps);
            let bytes = written(&track);
            let back = Track::from_bytes(&bytes).expect("a track");
            assert_eq!(written(&back), bytes);
            assert_eq!(std::format!("{back:?}"), std::format!("{track:?}"));
            assert_eq!(answers(&model, back), answers(&model, track));
        }
    }
}

/// However the networks are asked; a mean pass has nothing that is frozen.
#[test]
fn how_the_networks_are_asked_is_written() {
    let blob = Draft::recursive(3).bytes();
    let model = Model::new(&blob).expect("a blob");
    let passes = Inference::of_passes(300).expect("in range");
    let mut bytes = [0; TRACK_SNAPSHOT_BYTES];
    for inference in [passes, passes.frozen(), Inference::Moments, Inference::Mean] {
        let settings = Settings {
            inference,
            ..Settings::of(model.blob())
        };
        let track = Track::new(&model, settings).expect("its own settings");
        track.to_bytes(&mut bytes);
        let back = Track::from_bytes(&bytes).expect("a track");
        assert_eq!(back.settings(), settings);
    }
    bytes[14] = 1;
    let refusal = Track::from_bytes(&sealed(bytes)).map(|_| ());
    assert_eq!(refusal, Err(TrackBytesError::Invalid(TrackField::Padding)));
}

/// The second track is among what comes back.
#[test]
fn a_candidate_is_written() {
    let blob = Draft::recursive(3).bytes();
    let model = Model::new(&blob).expect("a blob");
    let track = track(&model, 8);
    let State::Recursive(belief) = &track.state else {
        panic!("recursive");
    };
    assert!(belief.candidate.is_some());
}

#[test]
fn each_reason_to_refuse_has_its_name() {
    let blob = Draft::recursive(3).bytes();
    let model = Model::new(&blob).expect("a blob");
    let bytes = written(&track(&model, 8));
    let refused = |at: usize, value: u8| {
        let mut bytes = bytes;
        bytes[at] = value;
        Track::from_bytes(&sealed(bytes)).map(|_| ())
    };
    let mut torn = bytes;
    torn[100] ^= 1;
    let refusal = Track::from_bytes(&torn).map(|_| ());
    assert_eq!(refusal, Err(TrackBytesError::WrongChecksum));
    assert_eq!(refused(0, b'X'), Err(TrackBytesError::NotATrack));
    assert_eq!(refused(4, 9), Err(TrackBytesError::UnknownVersion(9)));
    assert_eq!(refused(6, 7), Err(TrackBytesError::UnknownKind(7)));
    let invalid = |field| Err(TrackBytesError::Invalid(field));
    // Correction, passes, whether they are frozen, the flag of the latest time, the last byte before the checksum.
    assert_eq!(refused(11, 0), invalid(TrackField::Settings));
    assert_eq!(refused(11, 3), invalid(TrackField::Padding));
    assert_eq!(refused(13, 0xff), invalid(TrackField::Padding));
    assert_eq!(refused(14, 2), invalid(TrackField::Padding));
    assert_eq!(refused(23, 2), invalid(TrackField::Padding));
    assert_eq!(
        refused(TRACK_SNAPSHOT_BYTES - 5, 1),
        invalid(TrackField::Padding)
    );
}

/// What no step leaves, one by one.
#[test]
fn a_track_that_cannot_be_is_refused() {
    type Damage = fn(&mut Track);
    fn belief(track: &mut Track) -> &mut Belief {
        match &mut track.state {
            State::Recursive(belief) => belief,
            State::Memoryless(_) => panic!("recursive"),
        }
    }
    fn target(track: &mut Track) -> &mut Target {
        belief(track).target.as_mut().expect("a target")
    }
    fn past(track: &mut Track) -> &mut Past {
        match &mut track.state {
            State::Memoryless(past) => past,
            State::Recursive(_) => panic!("memoryless"),
        }
    }
    let recursive: [(Damage, TrackField); 23] = [
        (|t| t.clock.latest_us = None, TrackField::Measurement),
        (|t| t.clock.latest_us = Some(1 << 40), TrackField::Clock),
        (
            |t| t.latest.as_mut().expect("seen").sensor.position_m[1] = 2e6,
            TrackField::Measurement,
        ),
        (
            |t| {
                t.latest
                    .as_mut()
                    .expect("seen")
                    .azimuth
                    .as_mut()
                    .expect("seen")
                    .value = 4.0
            },
            TrackField::Measurement,
        ),
        (|t| target(t).state[4] = f32::NAN, TrackField::Target),
        (|t| target(t).covariance[3][3] = -1.0, TrackField::Target),
        (
            |t| target(t).sensor_m[0] = f32::INFINITY,
            TrackField::Target,
        ),
        (|t| target(t).memory.counts[1] = -1.0, TrackField::Memory),
        (|t| target(t).memory.notes[8] = 1.5, TrackField::Memory),
        (|t| target(t).memory.age_s = f32::NAN, TrackField::Memory),
        (|t| target(t).memory.innovation[2] = 2e3, TrackField::Memory),
        (
            |t| target(t).foresight.due_us = t.clock.latest_us.expect("a time") + 1_000_001,
            TrackField::Memory,
        ),
        (
            |t| target(t).foresight.position_m[2] = f32::NAN,
            TrackField::Memory,
        ),
        (
            |t| target(t).foresight.variance_m2 = -1.0,
            TrackField::Memory,
        ),
        // Not below nothing, yet what is divided by it overflows below.
        (
            |t| target(t).foresight.variance_m2 = -0.0,
            TrackField::Memory,
        ),
        (
            |t| target(t).foresight.bend_m[0] = f32::INFINITY,
            TrackField::Memory,
        ),
        // Its square is none.
        (|t| target(t).foresight.bend_m[0] = 3e38, TrackField::Memory),
        (
            |t| target(t).foresight.position_m[1] = -3e38,
            TrackField::Memory,
        ),
        (|t| target(t).foresight.found = 1e3, TrackField::Memory),
        (|t| target(t).foresight.bent = 1e3, TrackField::Memory),
        (|t| target(t).foresight.followed = 1e3, TrackField::Memory),
        (
            |t| belief(t).candidate.as_mut().expect("one").misses = 2,
            TrackField::Candidate,
        ),
        (
            |t| belief(t).candidate.as_mut().expect("one").target.time_us = 1 << 50,
            TrackField::Clock,
        ),
    ];
    let memoryless: [(Damage, TrackField); 5] = [
        (
            |t| past(t).latest.as_mut().expect("a fix").position[1] = f32::NAN,
            TrackField::Fix,
        ),
        (
            |t| past(t).latest.as_mut().expect("a fix").covariance[(0, 2)] += 1.0,
            TrackField::Fix,
        ),
        (
            |t| past(t).before.as_mut().expect("a fix").covariance[(2, 2)] = 0.0,
            TrackField::Fix,
        ),
        (
            |t| past(t).before.as_mut().expect("a fix").time_us = 1 << 40,
            TrackField::Clock,
        ),
        (|t| past(t).latest = None, TrackField::Clock),
    ];
    let [draft, other, _] = drafts();
    for (draft, damages) in [(draft, &recursive[..]), (other, &memoryless[..])] {
        let blob = draft.bytes();
        let model = Model::new(&blob).expect("a blob");
        let sound = track(&model, 8);
        assert!(Track::from_bytes(&written(&sound)).is_ok());
        for (at, (damage, field)) in damages.iter().enumerate() {
            let mut damaged = sound.clone();
            damage(&mut damaged);
            let refusal = Track::from_bytes(&written(&damaged)).map(|_| ());
            assert_eq!(refusal, Err(TrackBytesError::Invalid(*field)), "{at}");
        }
    }
    let mut stuck = written(&track(
        &Model::new(&drafts()[1].bytes()).expect("a blob"),
        0,
    ));
    // Magic, version, kind, model, settings, two times and a measurement that are not there.
    let rng = 4 + 2 + 1 + 4 + 12 + 18 + 69;
    stuck[rng..rng + 16].fill(0);
    let refusal = Track::from_bytes(&sealed(stuck)).map(|_| ());
    assert_eq!(
        refusal,
        Err(TrackBytesError::Invalid(TrackField::Generator))
    );
}

/// Another model of the kind takes a track over, and no other does.
#[test]
fn a_track_is_handed_over_within_its_kind() {
    let blobs = [
        Draft::recursive(3),
        Draft::recursive(4),
        Draft::memoryless(&[12, 3], 3),
    ];
    let blobs = blobs.map(|draft| draft.bytes());
    let [own, newer, other] = [0, 1, 2].map(|i: usize| Model::new(&blobs[i]).expect("a blob"));
    let mut workspace = Workspace::new();
    let mut track = track(&own, 8);
    let now = Measurement {
        time_us: 2_000_000,
        ..seen(1)
    };
    let unasked = written(&track);
    for wrong in [&newer, &other] {
        let refusal = track.step(wrong, &mut workspace, &now);
        assert_eq!(refusal, Err(StepError::OtherModel));
    }
    let refusal = track.hand_over(&other).expect_err("another kind");
    assert_eq!(
        (refusal.track, refusal.model),
        (Kind::Recursive, Kind::Memoryless)
    );
    assert_eq!(written(&track), unasked);
    // At once: where a network that learned nothing takes a target is its own affair.
    let now_at = |track: &mut Track, model, workspace: &mut Workspace| {
        let estimate = track.coast(model, workspace, 1_800_000).expect("a coast");
        let motion = estimate.motion.expect("recursive");
        (
            estimate.position_m,
            motion.velocity_mps,
            motion.acceleration_mps2,
        )
    };
    track.hand_over(&own).expect("its own");
    assert_eq!(written(&track), unasked);
    let expected = now_at(&mut track.clone(), &own, &mut workspace);
    if let State::Recursive(belief) = &mut track.state {
        let foresight = &mut belief.target.as_mut().expect("a target").foresight;
        (foresight.found, foresight.followed, foresight.bent) = (3.0, 1.0, 4.0);
    }
    track.hand_over(&newer).expect("of its kind");
    let State::Recursive(belief) = &track.state else {
        panic!("recursive");
    };
    let targets = [
        belief.target.as_ref(),
        belief.candidate.as_ref().map(|c| &c.target),
    ];
    for target in targets.into_iter().flatten() {
        assert_eq!(target.memory.notes, [0.0; 9]);
        let foresight = &target.foresight;
        assert!(foresight.is_idle());
        assert_eq!((foresight.scale(), foresight.bend(1.0)), (1.0, 1.0));
    }
    let moved = now_at(&mut track, &newer, &mut workspace);
    assert_eq!(moved, expected);
    assert!(track.step(&newer, &mut workspace, &now).is_ok());
}

/// Zeros, ones and the bounds of floats at each place: refused, or a track whose numbers are numbers.
#[test]
fn no_float_at_the_edge_answers_with_nonsense() {
    let blob = Draft::recursive(3).bytes();
    let model = Model::new(&blob).expect("a blob");
    let edges = [0.0, f32::MIN_POSITIVE, 1e-44, 1.0, 1e18, f32::MAX];
    for steps in [7, 9] {
        let whole = written(&track(&model, steps));
        for at in 0..TRACK_SNAPSHOT_BYTES - CRC_BYTES - 4 {
            for edge in edges.iter().flat_map(|&edge| [edge, -edge]) {
                let mut bytes = whole;
                bytes[at..at + 4].copy_from_slice(&edge.to_le_bytes());
                if let Ok(track) = Track::from_bytes(&sealed(bytes)) {
                    answers(&model, track);
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, ..ProptestConfig::default() })]

    /// Any damage under a checksum that is right: refused, or a track whose numbers are numbers.
    #[test]
    fn damaged_bytes_never_answer_with_nonsense(
        kind in 0..3_usize,
        steps in 0..12_u64,
        damage in proptest::collection::vec((0..TRACK_SNAPSHOT_BYTES - CRC_BYTES, any::<u8>()), 1..6),
    ) {
        let blob = drafts()[kind].bytes();
        let model = Model::new(&blob).expect("a blob");
        let mut bytes = written(&track(&model, steps));
        for (at, value) in damage {
            bytes[at] = value;
        }
        if let Ok(mut track) = Track::from_bytes(&sealed(bytes)) {
            prop_assert_eq!(written(&track), sealed(bytes));
            if track.hand_over(&model).is_ok() {
                answers(&model, track);
            }
        }
    }

    /// Floats of any bits where floats are.
    #[test]
    fn wild_numbers_never_answer_with_nonsense(
        at in 110..TRACK_SNAPSHOT_BYTES - CRC_BYTES - 4,
        value in any::<f32>(),
        steps in 1..12_u64,
    ) {
        let blob = Draft::recursive(3).bytes();
        let model = Model::new(&blob).expect("a blob");
        let mut bytes = written(&track(&model, steps));
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        if let Ok(track) = Track::from_bytes(&sealed(bytes)) {
            answers(&model, track);
        }
    }

    #[test]
    fn any_bytes_are_refused(bytes in proptest::collection::vec(any::<u8>(), TRACK_SNAPSHOT_BYTES)) {
        let bytes: Bytes = bytes.try_into().expect("its length");
        prop_assert!(Track::from_bytes(&bytes).is_err());
        let mut named = bytes;
        named[..7].copy_from_slice(&[b'B', b'N', b'K', b'T', VERSION as u8, 0, 2]);
        prop_assert!(Track::from_bytes(&sealed(named)).is_err());
    }
}
