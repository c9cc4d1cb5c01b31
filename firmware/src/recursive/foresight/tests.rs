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

/// One forecast with variance 4, met by an estimate with variance 1 that lies `apart_m` away.
fn met(foresight: &mut Foresight, apart_m: f32) {
    foresight.expect(0, &at(10.0), &covariance(4.0));
    assert!(!foresight.is_idle());
    foresight.compare(999_999, &at(0.0), &covariance(1.0));
    assert!(!foresight.is_idle(), "looked at before its time");
    foresight.compare(1_000_000, &at(10.0 + apart_m), &covariance(1.0));
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
    foresight.expect(0, &at(10.0), &covariance(4.0));
    // A tenth of a second late at 2 m/s, 6 m/s^2: .2 m further, less .03 m.
    let mut state = at(10.17 + 2.95_f32.sqrt());
    state[6] = 6.0;
    let mut spread = covariance(1.0);
    // The position that was is as good as .1^2 + .005^2 of the others leave it, and their product.
    for axis in 0..3 {
        (spread[axis][3 + axis], spread[3 + axis][axis]) = (0.2, 0.2);
    }
    foresight.compare(1_100_000, &state, &spread);
    let variance = 1.0 + 3.0 * (0.01 + 0.005 * 0.005 - 2.0 * 0.1 * 0.2);
    let growth = 1.0 - variance / 4.0;
    let expected = (5.0 + growth * 2.95 / 4.0) / (5.0 + growth * growth);
    assert!((foresight.scale() - expected).abs() < 1e-4);
    let mut foresight = Foresight::START;
    foresight.expect(0, &at(10.0), &covariance(4.0));
    foresight.compare(1_500_001, &at(90.0), &covariance(1.0));
    assert_eq!(foresight.scale(), 1.0);
    assert!(foresight.is_idle());
}

#[test]
fn what_says_nothing_weighs_nothing() {
    let mut foresight = Foresight::START;
    foresight.expect(0, &at(10.0), &covariance(4.0));
    foresight.compare(1_000_000, &at(90.0), &covariance(4.0));
    assert_eq!(foresight.scale(), 1.0);
    foresight.expect(0, &at(10.0), &covariance(f32::INFINITY));
    assert!(foresight.is_idle());
    foresight.close();
    foresight.compare(2_000_000, &at(90.0), &covariance(1.0));
    assert!(!foresight.is_idle());
    assert_eq!(foresight.scale(), 1.0);
}

#[test]
fn a_moved_sensor_moves_the_forecast() {
    let mut foresight = Foresight::START;
    foresight.expect(0, &at(10.0), &covariance(4.0));
    foresight.shift([4.0, 0.0, 0.0]);
    foresight.compare(1_000_000, &at(6.0 + 3.0_f32.sqrt()), &covariance(1.0));
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
    foresight.expect(u64::MAX - 10, &at(10.0), &covariance(4.0));
    assert!(foresight.is_sound(u64::MAX - 10));
    foresight.compare(u64::MAX, &at(10.0), &covariance(1.0));
    assert!(foresight.is_idle());
}
