use super::*;
use nalgebra::{SMatrix, SVector};

/// Where the sensor is.
const HERE: [f32; 3] = [0.0; 3];
/// Where another one is, m.
const THERE: [f32; 3] = [-40.0, 0.0, 0.0];

/// A target two metres from the vertical axis, 20 m up, unsure by ten metres along every axis.
fn blind() -> Target {
    let mut target = target();
    target.state[..3].copy_from_slice(&[2.0, 0.0, 20.0]);
    for axis in 0..3 {
        target.covariance[axis][axis] = 100.0;
    }
    assert!(target.settle());
    target
}

/// What is seen 5 m from the axis: a sight that a blind target's curvature outweighs.
fn overhead() -> Measurement {
    Measurement {
        elevation: sensed(1.3, 0.001),
        azimuth: sensed(-2.0, 0.001),
        range: sensed(20.0, 0.5),
        ..first()
    }
}

#[test]
fn a_blind_target_takes_its_place_from_a_measurement() {
    let before = blind();
    let mut blinded = before;
    let mut corrected = Corrected::before(&before.state, &before.covariance);
    correct_soundly(&mut corrected, &Vectors::from(&overhead()), [1.0; 3]).expect("sound");
    let seen = radar::position(20.0_f32, 1.3, -2.0);
    let far = |state: &State<f32>| {
        let squares = (0..3).map(|axis| (state[axis] - seen[axis]).powi(2));
        squares.sum::<f32>().sqrt()
    };
    assert!(far(&corrected.state) > 3.0, "a correction does not find it");

    let mut vectors = Vectors::from(&overhead());
    let nis = blinded.relocate(&mut vectors, &population(), HERE);
    assert!(nis.is_some_and(|nis| nis > 0.0 && nis < 1.0), "{nis:?}");
    let left = Measurement {
        elevation: None,
        azimuth: None,
        range: None,
        ..overhead()
    };
    assert_eq!(vectors, Vectors::from(&left));
    assert!(far(&blinded.state) < 0.5);
    assert!(blinded.position_variance() < 0.5);
    assert_eq!(blinded.state[3..], before.state[3..]);
    for row in 3..9 {
        assert_eq!(blinded.covariance[row][3..], before.covariance[row][3..]);
        assert_eq!(blinded.covariance[row][..3], [0.0; 3]);
    }
    for row in 0..3 {
        for column in 0..9 {
            let (a, b) = (
                blinded.covariance[row][column],
                blinded.covariance[column][row],
            );
            assert!((a - b).abs() <= 1e-6 * a.abs(), "{row} {column}");
        }
    }
    assert!(blinded.settle());
}

/// Sure, far from the axis, seen in part, or by a sensor as blunt: each alone keeps the prediction, that of the sensor
/// which saw it before.
#[test]
fn a_target_that_is_not_blind_keeps_its_place() {
    let kept = |mut target: Target, measurement: Measurement| {
        let (before, mut vectors) = (target, Vectors::from(&measurement));
        target.relocate(&mut vectors, &population(), HERE).is_none()
            && vectors == Vectors::from(&measurement)
            && (target.state, target.covariance) == (before.state, before.covariance)
    };
    let mut sure = blind();
    for axis in 0..3 {
        sure.covariance[axis][axis] = 1.3;
    }
    assert!(kept(sure, overhead()));
    let mut far = blind();
    far.state[1] = 18.0;
    assert!(kept(far, overhead()));
    let blunt = Measurement {
        elevation: sensed(1.3, 0.4),
        azimuth: sensed(-2.0, 0.4),
        range: sensed(20.0, 100.0),
        ..first()
    };
    assert!(kept(blind(), blunt));
    for missing in [
        Measurement {
            range: None,
            ..overhead()
        },
        Measurement {
            elevation: None,
            ..overhead()
        },
        Measurement {
            azimuth: None,
            ..overhead()
        },
    ] {
        assert!(kept(blind(), missing));
    }
}

/// A target 10 m from the vertical axis, unsure by six metres along every axis, and what a radar sees on the other side.
fn aside() -> (Target, Measurement) {
    let mut target = target();
    target.state[..3].copy_from_slice(&[-10.0, 0.0, 15.0]);
    for axis in 0..3 {
        target.covariance[axis][axis] = 36.0;
    }
    assert!(target.settle());
    let seen = Measurement {
        elevation: sensed(0.9, 0.1),
        azimuth: sensed(-0.3, 0.1),
        range: sensed(40.0, 100.0),
        ..first()
    };
    (target, seen)
}

/// The first radar's guess of the range was wrong, and the slope of the second one's azimuth leads nowhere.
#[test]
fn a_target_that_is_seen_far_aside_takes_its_place() {
    let (before, seen) = aside();
    let mut corrected = Corrected::before(&before.state, &before.covariance);
    correct_soundly(&mut corrected, &Vectors::from(&seen), [1.0; 3]).expect("sound");
    assert!(corrected.state[0] < -5.0, "a correction does not find it");

    let mut target = before;
    let mut vectors = Vectors::from(&seen);
    let nis = target.relocate(&mut vectors, &population(), THERE);
    assert!(nis.is_some_and(|nis| nis > 4.0 && nis < 64.0), "{nis:?}");
    assert_eq!(vectors.present, [0.0, 0.0, 0.0, 1.0]);
    assert!(target.state[0] > 0.0 && target.state[0] < 20.0);
    assert!(target.settle());
}

/// Aside by less than the slope means something over, from a surer prediction, or as the same sensor sees it: the
/// correction's business, or the gate's.
#[test]
fn what_is_a_little_aside_is_corrected() {
    let (target, seen) = aside();
    let seen_at = |mut target: Target, azimuth: Option<Sensed>, before_m: [f32; 3]| {
        let mut vectors = Vectors::from(&Measurement { azimuth, ..seen });
        let nis = target.relocate(&mut vectors, &population(), before_m);
        let taken = nis.is_some_and(|nis| nis < GATE_NIS as f32);
        assert_eq!(taken, vectors.present == [0.0, 0.0, 0.0, 1.0]);
        taken
    };
    let from = |target, azimuth, before_m| seen_at(target, sensed(azimuth, 0.1), before_m);
    let relocated = |target: Target, azimuth: f32| from(target, azimuth, THERE);
    let behind = core::f32::consts::PI;
    assert!(!relocated(target, behind - 0.60));
    assert!(relocated(target, behind - 0.68));
    let mut surer = target;
    for axis in 0..3 {
        surer.covariance[axis][axis] = 8.0;
    }
    assert!(!relocated(surer, 0.0));
    surer.covariance[0][0] = 10.0;
    assert!(relocated(surer, 0.0));
    // The latest sensor was this one, or one nearer than the target is sure of.
    assert!(!from(target, 0.0, HERE));
    assert!(!from(target, 0.0, [0.0, 10.0, 0.0]));
    assert!(from(target, 0.0, [0.0, 11.0, 0.0]));
    // A place so blunt that the prediction would be lost in it.
    let mut far = Vectors::from(&Measurement {
        range: sensed(5e4, 5e3),
        ..seen
    });
    let (mut lost, before) = (target, far);
    assert_eq!(lost.relocate(&mut far, &population(), THERE), None);
    assert_eq!(far, before);
    // An azimuth so blunt is far aside by chance.
    assert!(seen_at(target, sensed(-0.3, 0.2), THERE));
    assert!(!seen_at(target, sensed(-0.3, 0.22), THERE));
}

/// What it takes is what Kalman's filter takes of a measured position, in double precision, and what is far beyond
/// the prediction is not taken.
#[test]
fn a_blind_target_is_corrected_by_a_position() {
    let mut before = blind();
    for axis in 0..3 {
        // Found together, as in a gap: position, velocity and acceleration.
        for (block, common) in [(3, 9.0), (6, 2.0)] {
            before.covariance[axis][block + axis] = common;
            before.covariance[block + axis][axis] = common;
        }
    }
    before.covariance[0][4] = 1.5;
    before.covariance[4][0] = 1.5;
    assert!(before.settle());
    let (place_m, place_m2) = place(&Vectors::from(&overhead()), &population());
    let prior = SMatrix::<f64, 9, 9>::from_fn(|i, j| before.covariance[i][j].into());
    let seen = SMatrix::<f64, 3, 9>::identity();
    let noise = SMatrix::<f64, 3, 3>::from_fn(|i, j| place_m2[i][j].into());
    let apart = SVector::<f64, 3>::from_fn(|i, _| f64::from(place_m[i] - before.state[i]));
    let both = (seen * prior * seen.transpose() + noise)
        .try_inverse()
        .expect("definite");
    let gain = prior * seen.transpose() * both;
    let moved = gain * apart;
    let left = prior - gain * seen * prior;

    let mut blinded = before;
    let nis = blinded.relocate(&mut Vectors::from(&overhead()), &population(), HERE);
    let nis = nis.expect("blind");
    let expected = (apart.transpose() * both * apart)[0];
    assert!((f64::from(nis) - expected).abs() < 1e-4 * expected);
    assert!(moved.rows(3, 6).amax() > 0.2, "the velocity is learned");
    for i in 0..9 {
        let got = f64::from(blinded.state[i] - before.state[i]);
        assert!((got - moved[i]).abs() < 1e-4, "{i}");
        for j in 0..9 {
            let scale = (left[(i, i)] * left[(j, j)]).sqrt();
            let got = f64::from(blinded.covariance[i][j]);
            assert!((got - left[(i, j)]).abs() < 1e-3 * scale, "{i} {j}");
        }
    }

    let mut elsewhere = before;
    let mut vectors = Vectors::from(&Measurement {
        range: sensed(300.0, 0.5),
        ..overhead()
    });
    let unread = vectors;
    let nis = elsewhere.relocate(&mut vectors, &population(), HERE);
    assert!(nis.is_some_and(|nis| nis >= GATE_NIS as f32));
    assert_eq!(vectors, unread);
    assert_eq!(
        (elsewhere.state, elsewhere.covariance),
        (before.state, before.covariance)
    );
}
