use super::super::*;
use super::bench::{constant, measurement, near, now, parameters, started};
use crate::recursive::hypotheses::{HYPOTHESES, OUTLIER};
use crate::recursive::mixture::SUSPECT_GATE_NIS;
use crate::recursive::schedule::OUTPUTS;

/// What a rejected measurement says is remembered, within a thousand deviations, unless readings
/// are often wrong.
#[test]
fn a_rejected_innovation_is_remembered_unless_often_wrong() {
    for (wrong, remembered) in [(0.0, true), (4.0, true), (6.0, false)] {
        let bytes = constant([0.0; OUTPUTS]).bytes();
        let mut tracker = started(&bytes);
        let mut track = now(&tracker);
        track.memory.counts = [0.0; HYPOTHESES];
        track.memory.counts[OUTLIER] = wrong;
        track.memory.innovation = [0.5; 4];
        tracker.belief.target = Some(track);
        let seen = measurement(100_000, 9e5, 0.5);
        let estimate = tracker.step(&seen, false).expect("an estimate");
        assert_eq!(estimate.mode, Mode::Rejected);
        let innovation = now(&tracker).memory.innovation;
        if remembered {
            assert_eq!(innovation[2], WHITENED_MAX);
        } else {
            assert!(near(innovation[2], 0.4, 1.0), "{innovation:?}");
        }
    }
}

/// What is likelier wrong than not, and fits that badly as well, is not used; from a NIS of 64 on nothing is.
#[test]
fn a_suspect_is_rejected_sooner() {
    let mut sooner = 0;
    for offset in 1..200 {
        let bytes = constant([0.0; OUTPUTS]).bytes();
        let mut tracker = started(&bytes);
        let seen = measurement(100_000, 33.0 + 0.5 * offset as f32, 0.5);
        let estimate = tracker.step(&seen, false).expect("an estimate");
        let (nis, doubt) = (estimate.nis, estimate.doubt);
        if estimate.mode == Mode::Rejected {
            assert!(nis >= SUSPECT_GATE_NIS, "{nis}");
            sooner += usize::from(nis < GATE_NIS as f32);
        } else {
            assert!(nis < SUSPECT_GATE_NIS || doubt.outlier < SUSPECT, "{nis}");
            assert!(nis < GATE_NIS as f32);
        }
    }
    assert!(sooner > 3, "{sooner}");
}

/// A measurement that is used is remembered, however often readings are wrong.
#[test]
fn a_used_innovation_is_remembered() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    let mut tracker = started(&bytes);
    let mut track = now(&tracker);
    track.memory.counts[OUTLIER] = 50.0;
    track.memory.innovation = [100.0; 4];
    tracker.belief.target = Some(track);
    let estimate = tracker.step(&measurement(100_000, 33.1, 0.5), false);
    assert_eq!(estimate.expect("an estimate").mode, Mode::Tracking);
    let innovation = now(&tracker).memory.innovation;
    assert!(innovation.iter().all(|y| y.abs() < 5.0), "{innovation:?}");
}

/// Three rejected measurements that agree with each other are the target; the old track then waits
/// beside it.
#[test]
fn agreeing_rejections_take_over() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    let mut tracker = started(&bytes);
    for step in 1..=5 {
        let seen = measurement(100_000 * step, 33.0, 0.5);
        let estimate = tracker.step(&seen, false).expect("an estimate");
        assert_eq!(estimate.mode, Mode::Tracking);
    }
    let before = now(&tracker);
    for (step, mode) in [Mode::Rejected, Mode::Rejected, Mode::Restarted]
        .into_iter()
        .enumerate()
    {
        let seen = measurement(600_000 + 100_000 * step as u64, 60.0, -2.0);
        let estimate = tracker.step(&seen, false).expect("an estimate");
        assert_eq!(estimate.mode, mode, "{step}");
        assert!(estimate.nis > GATE_NIS as f32);
        let doubt = if mode == Mode::Rejected {
            Doubt::OUTLIER
        } else {
            Doubt::NONE
        };
        assert_eq!(estimate.doubt, doubt);
        if mode == Mode::Rejected {
            let memory = now(&tracker).memory;
            let wrong = memory.counts[OUTLIER] - before.memory.counts[OUTLIER];
            assert!(near(wrong, 1.0 + step as f32, 10.0), "{wrong}");
            assert!(near(memory.coast_s, 0.1 * (1 + step) as f32, 10.0));
            assert_eq!(now(&tracker).used, before.used);
        }
    }
    let taken = now(&tracker);
    assert!((taken.sight().range_m - 60.0).abs() < 1.0 && taken.used == 3);
    let waiting = tracker.belief.candidate.expect("the old track");
    assert!((waiting.target().sight().range_m - 33.0).abs() < 2.0);
    assert_eq!(tracker.belief.rejections, 0);
    // One measurement of its own brings no change of track back.
    let back = tracker.step(&measurement(900_000, 60.0, -2.0), false);
    assert_eq!(back.expect("an estimate").mode, Mode::Tracking);
}

/// A candidate that agrees takes over after three rejections or with the longer record, and only
/// where it is apart.
#[test]
fn a_takeover_needs_rejections_or_a_longer_record_and_a_distance() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    // Measurements used by the candidate in the end and by the track; rejections in the end.
    for (candidate, own, rejections, apart, takes_over) in [
        (6, 5, 1, true, true),
        (5, 5, 1, true, false),
        (4, 5, 1, true, false),
        (4, 5, 3, true, true),
        (4, 5, 2, true, false),
        (4, 5, 3, false, false),
        (6, 5, 1, false, false),
    ] {
        let mut tracker = started(&bytes);
        let mut track = now(&tracker);
        track.used = own;
        tracker.belief.target = Some(track);
        tracker.belief.rejections = rejections - 1;
        let range = if apart { 60.0 } else { 33.0 };
        let seen = |time_us| measurement(time_us, range, 0.5);
        let p = parameters();
        let mut none = Target::NONE;
        let room = &mut none;
        let mut waiting = Candidate::start(&seen(0), &p.population, room).expect("a target");
        (waiting.target.used, waiting.agreeing) = (candidate - 3, 0);
        for time_us in [100_000, 200_000] {
            let met = waiting.meet(&seen(time_us), &p.base, &p.population, room);
            assert_eq!(met, Verdict::Wait);
        }
        tracker.belief.candidate = Some(waiting);
        let taken = tracker.run().is_suspected(&seen(300_000), APART);
        let case = (candidate, own, rejections, apart);
        assert_eq!(taken, takes_over, "{case:?}");
        let used = if takes_over { candidate } else { own };
        assert_eq!(now(&tracker).used, used, "{case:?}");
    }
}

/// A candidate begins anywhere in the population's place, with any motion of the training.
#[test]
fn a_suspect_may_move_as_any_target_of_the_training() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    let p = parameters();
    let expected = Population {
        horizontal_sigma_mps: 16.0,
        vertical_sigma_mps: 16.0,
        acceleration_sigma_mps2: 12.5,
        ..p.population
    };
    assert_eq!(started(&bytes).model.suspected(), expected);
}
