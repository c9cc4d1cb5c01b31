use super::super::*;
use super::bench::{constant, measurement, near, now, outputs, parameters, started};
use super::way::{Way, asked, assert_same, corrected, doubted, predicted, unasked};
use crate::recursive::envelope::Envelope;
use crate::recursive::schedule::{OUTPUTS, Schedule};

/// A gap of 0.6 s is predicted in three parts, 0.25 s in one, each as the network says, and
/// corrected under all hypotheses.
#[test]
fn a_step_is_predictions_and_a_correction() {
    let bytes = constant(outputs()).bytes();
    let mut tracker = started(&bytes);
    let mut expected = now(&tracker);
    let way = asked(&outputs());
    let mut time_us = 0;
    for (after_us, parts, dt_s) in [(600_000, 3, 0.2), (250_000, 1, 0.25), (300_000, 2, 0.15)] {
        time_us += after_us;
        let seen = measurement(time_us, 33.3, 0.505);
        let estimate = tracker.step(&seen, false).expect("an estimate");
        let interval = predicted(&mut expected, &way, parts, dt_s);
        expected.time_us = time_us;
        let nis = corrected(&mut expected, &interval, &way, &seen);
        assert_same(&now(&tracker), &expected);
        assert_eq!((estimate.mode, estimate.outside), (Mode::Tracking, false));
        assert!(near(estimate.nis, nis, 10.0 * nis));
        assert_eq!(estimate.time_us, time_us);
        expected = now(&tracker);
    }
}

/// A coast is a step that ends in doubt; a call at the same time moves nothing.
#[test]
fn a_coast_is_predictions_and_a_doubt() {
    let bytes = constant(outputs()).bytes();
    let mut tracker = started(&bytes);
    let mut expected = now(&tracker);
    let way = asked(&outputs());
    let interval = predicted(&mut expected, &way, 2, 0.2);
    doubted(&mut expected, &interval, &way);
    expected.time_us = 400_000;
    let estimate = tracker.coast(400_000).expect("a coast");
    assert_same(&now(&tracker), &expected);
    assert_eq!((estimate.mode, estimate.nis), (Mode::Coasting, 0.0));
    assert_eq!(estimate.doubt, Doubt::NONE);
    let again = tracker.coast(400_000).expect("a coast");
    assert_eq!(again.position_m, estimate.position_m);
    // Nor at the time of the first measurement, when there is no age to divide by.
    let mut tracker = started(&bytes);
    let before = now(&tracker);
    tracker.coast(0).expect("a coast");
    assert_same(&now(&tracker), &before);
    tracker.coast(400_000).expect("a coast");
    let age_s = now(&tracker).memory.age_s;
    assert!((age_s - 0.4).abs() < 1e-6);
}

/// Far too fast for the model: the wide schedule. Where it knows nothing: its base.
#[test]
fn far_outside_the_envelope_the_network_is_not_asked() {
    let bytes = constant(outputs()).bytes();
    let base = parameters().base;
    type Case = (fn(&mut Target), Way);
    /// Makes each coordinate of the position known to so much, and independent of all others.
    fn known(target: &mut Target, variance_m2: f32) {
        for i in 0..3 {
            for j in 0..9 {
                (target.covariance[i][j], target.covariance[j][i]) = (0.0, 0.0);
            }
            target.covariance[i][i] = variance_m2;
        }
    }
    let unknown = || unasked(Schedule::read(&[0.0; OUTPUTS], &base));
    let cases: [Case; 8] = [
        // Ten seconds are not more than ten.
        (|t| t.memory.coast_s = 10.0, asked(&outputs())),
        (|t| t.memory.coast_s = 10.1, unknown()),
        // Faster than any of the training, 16 m/s, where that is known and where it is not, and three times as fast.
        (
            |t| {
                known(t, 11.9);
                t.state[3] = 17.0;
            },
            asked(&outputs()),
        ),
        (
            |t| {
                known(t, 12.1);
                t.state[3] = 17.0;
            },
            unasked(Schedule::wide(&base)),
        ),
        (
            |t| {
                known(t, 0.1);
                t.state[3] = 48.1;
            },
            unasked(Schedule::wide(&base)),
        ),
        // Further than any of the training, 100 m, where that is known and where it is not, and ten times as far.
        (
            |t| {
                known(t, 5.8);
                t.state[2] = 150.0;
            },
            asked(&outputs()),
        ),
        (
            |t| {
                known(t, 5.9);
                t.state[2] = 150.0;
            },
            unknown(),
        ),
        (
            |t| {
                known(t, 0.1);
                t.state[2] = 1000.0;
            },
            unknown(),
        ),
    ];
    for (change, way) in cases {
        let mut tracker = started(&bytes);
        let mut expected = now(&tracker);
        change(&mut expected);
        tracker.belief.target = Some(expected);
        let interval = predicted(&mut expected, &way, 1, 0.1);
        doubted(&mut expected, &interval, &way);
        expected.time_us = 100_000;
        let estimate = tracker.coast(100_000).expect("a coast");
        assert_same(&now(&tracker), &expected);
        let p = parameters();
        let envelope = Envelope::of(&p.bounds, &p.population);
        assert_eq!(estimate.outside, !envelope.holds(&expected.state));
    }
}

/// Hypotheses look back over a gap, but not over readings that were rejected.
#[test]
fn hypotheses_look_back_over_what_nobody_saw() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    for (rejections, coast_s) in [(0, 0.4), (1, 0.0)] {
        let mut tracker = started(&bytes);
        tracker.coast(400_000).expect("a coast");
        tracker.belief.rejections = rejections;
        let mut run = tracker.run();
        run.set_out().expect("a target");
        let step = run.predict(500_000).expect("a prediction");
        assert!((step.interval.coast_s - coast_s).abs() < 1e-6);
        assert!((step.interval.dt_s - 0.1).abs() < 1e-6);
    }
}

/// A measurement at the very time of a coast, or of another that was rejected, ends the silence.
#[test]
fn a_measurement_ends_the_silence_whatever_else_was_then() {
    let bytes = constant([0.0; OUTPUTS]).bytes();
    for ghost in [false, true] {
        let mut tracker = started(&bytes);
        for step in 1..=150 {
            let time_us = 100_000 * step;
            if ghost {
                let seen = measurement(time_us, 60.0 + (step % 7 * 40) as f32, -2.0);
                tracker.step(&seen, false).expect("an estimate");
            } else {
                tracker.coast(time_us).expect("a coast");
            }
            assert!(now(&tracker).memory.coast_s > 0.0);
            let seen = measurement(time_us, 33.0, 0.5);
            let estimate = tracker.step(&seen, false).expect("an estimate");
            assert_eq!(estimate.mode, Mode::Tracking, "{step}");
            assert_eq!(now(&tracker).memory.coast_s, 0.0);
        }
    }
}

/// Longer than a second without a measurement, accelerations go on as forecasts of them came true: not at all, and the
/// target goes straight on. What is open of that is open along them.
#[test]
fn a_long_gap_bends_as_forecasts_came_true() {
    let bytes = constant(outputs()).bytes();
    let coasted = |followed: f32, bent: f32, time_s: f32| {
        let mut tracker = started(&bytes);
        let target = tracker.belief.target.as_mut().expect("a target");
        target.state[3..].copy_from_slice(&[2.0, 1.0, 0.0, 0.5, -0.5, 0.25]);
        (target.foresight.followed, target.foresight.bent) = (followed, bent);
        // Nothing to be learned on the way.
        target.foresight.close();
        tracker.coast((1e6 * time_s) as u64).expect("a coast");
        now(&tracker)
    };
    let (open, sure) = (coasted(0.0, 0.0, 1.0), coasted(-240.0, 240.0, 1.0));
    assert_eq!((open.state, open.covariance), (sure.state, sure.covariance));
    let (open, straight) = (coasted(0.0, 0.0, 4.0), coasted(-240.0, 240.0, 4.0));
    let (later, late) = (straight.velocity(), sure.velocity());
    // The factor takes what it takes of the velocity in both.
    let turned: f32 = (0..3).map(|i| (open.velocity()[i] - late[i]).abs()).sum();
    let kept: f32 = (0..3).map(|i| (later[i] - late[i]).abs()).sum();
    assert!(kept < 0.5 * turned, "{kept} {turned}");
    assert!(open.position_variance() > straight.position_variance());
}

/// At the very time of another reading nothing moves, and what a manoeuvre multiplies is the network's noise, over what nobody
/// saw before.
#[test]
fn at_the_same_time_the_noise_is_the_networks() {
    let bytes = constant(outputs()).bytes();
    let mut tracker = started(&bytes);
    tracker.coast(200_000).expect("a coast");
    let mut run = tracker.run();
    run.set_out().expect("a target");
    let step = run.predict(200_000).expect("a prediction");
    assert_eq!(step.interval.noise, asked(&outputs()).schedule.noise);
    assert!((step.interval.coast_s - 0.2).abs() < 1e-6);
    let (moved, before) = (tracker.workspace.target, now(&tracker));
    assert_eq!(
        (moved.state, moved.covariance),
        (before.state, before.covariance)
    );
}
