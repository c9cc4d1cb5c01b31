use super::*;

/// A covariance of the position alone with this sum of variances.
fn covariance(variance_m2: f32) -> Covariance<f32> {
    let mut covariance = [[0.0; 9]; 9];
    for (axis, row) in covariance.iter_mut().enumerate() {
        row[axis] = if axis < 3 { variance_m2 / 3.0 } else { 1.0 };
    }
    covariance
}

fn at(x: f32) -> State<f32> {
    let mut state = [0.0; 9];
    state[0] = x;
    state[3] = 2.0;
    state
}

/// A forecast for where a target comes that goes on as it is: 8 m away, 2 m/s.
fn straight(foresight: &mut Foresight, time_us: u64, variance_m2: f32) {
    let now = Steady::of(&at(8.0));
    foresight.expect(time_us, &now, &at(10.0), &covariance(variance_m2));
}

/// One forecast with variance 4, met by an estimate with variance 1 that lies `apart_m` away.
fn met(foresight: &mut Foresight, apart_m: f32) {
    straight(foresight, 0, 4.0);
    assert!(!foresight.is_idle());
    foresight.compare(999_999, &at(0.0), &covariance(1.0), 1.0);
    assert!(!foresight.is_idle(), "looked at before its time");
    foresight.compare(1_000_000, &at(10.0 + apart_m), &covariance(1.0), 1.0);
    assert!(foresight.is_idle());
}

#[test]
fn forecasts_that_come_true_as_they_said_change_nothing() {
    let mut foresight = Foresight::START;
    assert_eq!(foresight.scale(), 1.0);
    for _ in 0..50 {
        // 4 - 1 = 3: what is expected.
        met(&mut foresight, 3.0_f32.sqrt());
        assert!((foresight.scale() - 1.0).abs() < 1e-5);
    }
}

#[test]
fn the_scale_goes_where_forecasts_are_wrong() {
    let (mut wide, mut narrow) = (Foresight::START, Foresight::START);
    met(&mut wide, 0.0);
    // 5 / (5 + 0.75^2).
    assert!((wide.scale() - 5.0 / 5.5625).abs() < 1e-6);
    for _ in 0..100 {
        met(&mut wide, 0.2);
        met(&mut narrow, 4.0);
    }
    // 20 forecasts count: .2^2 and 4^2 in a variance of 4, a growth of 3 / 4.
    let settled = |square: f32| (5.0 + 20.0 * 0.75 * square / 4.0) / (5.0 + 20.0 * 0.75 * 0.75);
    for (foresight, square) in [(&wide, 0.04), (&narrow, 16.0)] {
        let ratio = foresight.scale() / settled(square);
        assert!((ratio - 1.0).abs() < 0.02, "{}", foresight.scale());
    }
    // One miss of any size counts for little.
    let mut once = Foresight::START;
    met(&mut once, 1e6);
    assert!(once.scale() < 2.0, "{}", once.scale());
}

#[test]
fn late_estimates_are_followed_back_or_do_not_count() {
    let mut foresight = Foresight::START;
    straight(&mut foresight, 0, 4.0);
    // A tenth of a second late at 2 m/s, 6 m/s^2: .2 m further, less .03 m.
    let mut state = at(10.17 + 2.95_f32.sqrt());
    state[6] = 6.0;
    let mut spread = covariance(1.0);
    // The position that was is as good as .1^2 + .005^2 of the others leave it, and their product.
    for axis in 0..3 {
        (spread[axis][3 + axis], spread[3 + axis][axis]) = (0.2, 0.2);
    }
    foresight.compare(1_100_000, &state, &spread, 1.0);
    let variance = 1.0 + 3.0 * (0.01 + 0.005 * 0.005 - 2.0 * 0.1 * 0.2);
    let growth = 1.0 - variance / 4.0;
    let expected = (5.0 + growth * 2.95 / 4.0) / (5.0 + growth * growth);
    assert!((foresight.scale() - expected).abs() < 1e-4);
    let mut foresight = Foresight::START;
    straight(&mut foresight, 0, 4.0);
    foresight.compare(1_500_001, &at(90.0), &covariance(1.0), 1.0);
    assert_eq!(foresight.scale(), 1.0);
    assert!(foresight.is_idle());
}

#[test]
fn what_says_nothing_weighs_nothing() {
    let mut foresight = Foresight::START;
    straight(&mut foresight, 0, 4.0);
    foresight.compare(1_000_000, &at(90.0), &covariance(4.0), 1.0);
    assert_eq!(foresight.scale(), 1.0);
    straight(&mut foresight, 0, f32::INFINITY);
    assert!(foresight.is_idle());
    for far in [1e20, f32::NAN] {
        foresight.expect(0, &Steady::of(&at(8.0)), &at(far), &covariance(4.0));
        assert!(foresight.is_idle());
    }
    foresight.close();
    foresight.compare(2_000_000, &at(90.0), &covariance(1.0), 1.0);
    assert!(!foresight.is_idle());
    assert_eq!(foresight.scale(), 1.0);
}

#[test]
fn a_moved_sensor_moves_the_forecast() {
    let mut foresight = Foresight::START;
    straight(&mut foresight, 0, 4.0);
    foresight.shift([4.0, 0.0, 0.0]);
    foresight.compare(1_000_000, &at(6.0 + 3.0_f32.sqrt()), &covariance(1.0), 1.0);
    assert!((foresight.scale() - 1.0).abs() < 1e-5);
}

/// The growth is scaled, and what was there before is not.
#[test]
fn widening_scales_the_growth() {
    let mut foresight = Foresight::START;
    for _ in 0..100 {
        met(&mut foresight, 4.0);
    }
    let scale = foresight.scale();
    let mut grown = covariance(5.0);
    foresight.widen(&mut grown, 2.0);
    assert!((position_variance(&grown) - (2.0 + 3.0 * scale)).abs() < 1e-4);
    assert!((grown[4][4] - position_variance(&grown) / 5.0).abs() < 1e-5);
    let mut same = covariance(2.0);
    foresight.widen(&mut same, 2.0);
    assert_eq!(same, covariance(2.0));
}

/// The last moments of the clock are no reason to stop looking, or to refuse a track as bytes.
#[test]
fn the_end_of_time_is_a_time() {
    let mut foresight = Foresight::START;
    straight(&mut foresight, u64::MAX - 10, 4.0);
    assert!(foresight.is_sound(u64::MAX - 10));
    foresight.compare(u64::MAX, &at(10.0), &covariance(1.0), 1.0);
    assert!(foresight.is_idle());
}

/// A forecast with variance 4 that acceleration takes 2 m further, met by an estimate with variance 1
/// that it took `part` of that.
fn bent(foresight: &mut Foresight, part: f32) {
    let now = Steady::of(&at(8.0));
    foresight.expect(0, &now, &at(12.0), &covariance(4.0));
    foresight.compare(1_000_000, &at(10.0 + 2.0 * part), &covariance(1.0), 1.0);
    assert!(foresight.is_idle());
}

#[test]
fn accelerations_that_come_true_are_gone_on_with() {
    let mut foresight = Foresight::START;
    assert_eq!(foresight.bend(1.0), 1.0);
    for _ in 0..50 {
        bent(&mut foresight, 1.0);
        assert!((foresight.bend(1.0) - 1.0).abs() < 1e-6);
    }
    assert!(foresight.bent > 7.0, "nothing was learned");
}

#[test]
fn accelerations_that_end_are_not() {
    let mut foresight = Foresight::START;
    bent(&mut foresight, 0.2);
    // Growth 3 / 4, a bend of 2 m in a variance of 4: (1 + .75 * .2) / (1 + .75).
    assert!((foresight.bend(1.0) - 1.15 / 1.75).abs() < 1e-6);
    // What was found lies 1.6 m short of the forecast as it was then.
    let expected = (5.0 + 0.75 * 1.6 * 1.6 / 4.0) / (5.0 + 0.75 * 0.75);
    assert!((foresight.scale() - expected).abs() < 1e-6);
    for _ in 0..100 {
        bent(&mut foresight, 0.2);
    }
    // Ten comparisons count.
    let settled = (1.0 + 10.0 * 0.75 * 0.2) / (1.0 + 10.0 * 0.75);
    assert!((foresight.bend(1.0) - settled).abs() < 1e-3);
    // By then forecasts are made with what was learned: hardly anything is wrong with them.
    assert!(foresight.scale() < 0.7, "{}", foresight.scale());
}

/// What a blob knows beforehand is where learning sets out.
#[test]
fn what_is_known_of_bends_is_the_prior() {
    let mut foresight = Foresight::START;
    assert_eq!(foresight.bend(0.4), 0.4);
    bent(&mut foresight, 0.2);
    assert!((foresight.bend(0.4) - 0.55 / 1.75).abs() < 1e-6);
    let now = Steady::of(&at(8.0));
    // Where it comes true as it was known to, nothing is wrong with a forecast but its width.
    let mut known = Foresight::START;
    known.expect(0, &now, &at(12.0), &covariance(4.0));
    known.compare(1_000_000, &at(10.8), &covariance(1.0), 0.4);
    assert!((known.bend(0.4) - 0.4).abs() < 1e-6);
    assert!((known.scale() - 5.0 / (5.0 + 0.75 * 0.75)).abs() < 1e-6);
}

/// What lies across a bend, or where there is none, says nothing of it; and nothing is taken for more than
/// three times a bend, however far away.
#[test]
fn bends_are_learned_from_bends_alone() {
    let mut foresight = Foresight::START;
    met(&mut foresight, 5.0);
    assert_eq!((foresight.bend(1.0), foresight.bent), (1.0, 0.0));
    let now = Steady::of(&at(8.0));
    let mut aside = at(12.0);
    aside[1] = 7.0;
    foresight.expect(0, &now, &at(12.0), &covariance(4.0));
    foresight.compare(1_000_000, &aside, &covariance(1.0), 1.0);
    assert!((foresight.bend(1.0) - 1.0).abs() < 1e-6);
    for (part, end) in [(1e6, 1.5), (-1e6, 0.0)] {
        let mut foresight = Foresight::START;
        bent(&mut foresight, part);
        let expected = (1.0 + 0.75 * 3.0 * part.signum()) / 1.75;
        assert!((foresight.bend(1.0) - expected.clamp(0.0, 1.5)).abs() < 1e-6);
        for _ in 0..100 {
            bent(&mut foresight, part);
        }
        assert_eq!(foresight.bend(1.0), end);
        assert!(foresight.is_sound(0));
    }
    // A kilometre in a square metre weighs as much as five deviations.
    let mut far = Foresight::START;
    far.expect(0, &now, &at(1010.0), &covariance(1.0));
    far.compare(1_000_000, &at(10.0), &covariance(0.0), 1.0);
    assert!((far.bend(1.0) - 1.0 / 26.0).abs() < 1e-6);
}

/// A regression's variance: open at the start, and less so by what comparisons weigh.
#[test]
fn bends_are_known_by_what_was_compared() {
    let mut foresight = Foresight::START;
    assert!((foresight.bend_variance() - 0.3).abs() < 1e-7);
    bent(&mut foresight, 0.2);
    assert!((foresight.bend_variance() - 0.3 / 1.75).abs() < 1e-7);
    // What says nothing of bends leaves it.
    let before = foresight.bend_variance() * 1.75;
    met(&mut foresight, 5.0);
    let kept = foresight.bend_variance() * (1.0 + 0.9 * 0.75);
    assert!((kept - before).abs() < 1e-6);
}
