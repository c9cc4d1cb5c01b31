use super::*;
use crate::gaussian::standard_normal;
use crate::measurement::Sensed;
use crate::radar::position;
use crate::rng::seeded;
use nalgebra::{Matrix3, Matrix4, Matrix6, SMatrix, Vector3, Vector4, Vector6};

/// Elevation, azimuth, range, range-rate and their standard deviations.
const MEASURED: [f32; 4] = [0.4, 3.1, 34.0, -1.2];
const SIGMAS: [f32; 4] = [0.02, 0.03, 2.0, 0.2];

fn measured_position() -> Converted {
    let [elevation, azimuth, range, _] = core::array::from_fn(|i| Sensed {
        value: MEASURED[i],
        sigma: SIGMAS[i],
    });
    crate::radar::converted(range, elevation, azimuth)
}

fn prior() -> (Vector6<f32>, Matrix6<f32>) {
    let mut rng = seeded(8);
    let spread = SMatrix::<f32, 6, 6>::from_fn(|_, _| 0.6 * standard_normal(&mut rng));
    let at = position(35.5, 0.45, -3.12);
    let state = Vector6::new(at[0], at[1], at[2], 1.0, -2.0, 0.5);
    (
        state,
        spread * spread.transpose() + Matrix6::identity() * 0.1,
    )
}

/// The correction of a prior, which stays as it is.
fn polar<S: Scalar>(
    state: &[S; 6],
    covariance: &[[S; 6]; 6],
    vectors: &Vectors<S>,
    variances: &[S; 4],
) -> (Corrected<S, 6>, [S; 4]) {
    let mut corrected = Corrected::before(state, covariance);
    let whitened = correct_polar(&mut corrected, vectors, variances);
    (corrected, whitened)
}

fn corrected(state: Vector6<f32>, covariance: Matrix6<f32>) -> Result<Corrected<f32, 6>, EkfError> {
    let variances = SIGMAS.map(|sigma| sigma * sigma);
    let vectors = Vectors::whole(MEASURED, SIGMAS);
    let (corrected, _) = polar(&state.into(), &covariance.into(), &vectors, &variances);
    corrected.check()?;
    Ok(corrected)
}

/// The joint correction in f64 by the textbook: K = P H' S^-1, P = (I - K H) P.
#[test]
fn polar_correction_equals_the_joint_one_in_f64() {
    let (state, covariance) = prior();
    let corrected = corrected(state, covariance).unwrap();
    let p = predict(
        [state[0], state[1], state[2]],
        [state[3], state[4], state[5]],
    );
    let h = SMatrix::<f64, 4, 6>::from_fn(|row, column| {
        f64::from(match (row, column) {
            (_, 0..3) => p.by_position[row][column],
            (3, _) => p.by_velocity[column - 3],
            _ => 0.0,
        })
    });
    let mut innovation =
        Vector4::from(MEASURED).map(f64::from) - Vector4::from(p.measurement).map(f64::from);
    innovation[1] -= core::f64::consts::TAU;
    let r = SIGMAS.map(|sigma| f64::from(sigma).powi(2));
    let covariance = covariance.map(f64::from);
    let s: Matrix4<f64> = h * covariance * h.transpose() + Matrix4::from_diagonal(&r.into());
    let inverse = s.try_inverse().unwrap();
    let gain = covariance * h.transpose() * inverse;
    let expected = state.map(f64::from) + gain * innovation;
    let expected_covariance = covariance - gain * h * covariance;
    let (state, covariance) = (
        Vector6::from(corrected.state).map(f64::from),
        Matrix6::from(corrected.covariance).map(f64::from),
    );
    assert!((state - expected).amax() < 1e-4);
    assert!((covariance - expected_covariance).amax() < 1e-4);
    assert!((f64::from(corrected.nis) - innovation.dot(&(inverse * innovation))).abs() < 1e-3);
}

/// What was not measured changes nothing, whatever stands in its place.
#[test]
fn an_absent_channel_has_no_part() {
    let (state, covariance) = prior();
    let variances = SIGMAS.map(|sigma| sigma * sigma);
    let with = |vectors: &Vectors<f32>, variances: &[f32; 4]| {
        polar(&state.into(), &covariance.into(), vectors, variances)
    };
    for missing in 0..4 {
        let mut vectors = Vectors::whole(MEASURED, SIGMAS);
        vectors.present[missing] = 0.0;
        let (got, whitened) = with(&vectors, &variances);
        vectors.measured[missing] += 0.5;
        let (other, _) = with(&vectors, &variances);
        assert_eq!(got.state, other.state);
        assert_eq!(whitened[missing], 0.0);
        // A noise that drowns everything is the same, but for rounding.
        vectors.present[missing] = 1.0;
        let mut drowned = variances;
        drowned[missing] = 1e12;
        let (expected, _) = with(&vectors, &drowned);
        for i in 0..6 {
            assert!((got.state[i] - expected.state[i]).abs() < 1e-4);
        }
        assert!((got.nis - expected.nis).abs() < 1e-3);
    }
    let mut vectors = Vectors::whole(MEASURED, SIGMAS);
    vectors.present = [0.0; 4];
    let (got, _) = with(&vectors, &variances);
    assert_eq!((got.state, got.nis), (state.into(), 0.0));
}

/// A sensor that claims to be exact leaves a covariance that is one.
#[test]
fn exact_measurements_leave_a_positive_variance() {
    let (state, covariance) = prior();
    let vectors = Vectors::whole(MEASURED, SIGMAS);
    let (mut got, _) = polar(
        &state.into(),
        &covariance.into(),
        &vectors,
        &[1e-14, 1e-14, 1e-12, 1e-12],
    );
    for _ in 0..100 {
        (got, _) = polar(&got.state, &got.covariance, &vectors, &[1e-14; 4]);
        assert_eq!(got.check(), Ok(()));
        assert!(crate::cholesky::make_definite(&mut got.covariance).is_ok());
    }
}

/// With H = I the posterior is the product of two Gaussians.
#[test]
fn position_correction_is_the_product_of_gaussians() {
    let (state, covariance) = prior();
    let (a, p) = (
        Vector3::from(state.fixed_rows::<3>(0)),
        Matrix3::from(covariance.fixed_view::<3, 3>(0, 0)),
    );
    let measured = measured_position();
    let (b, r) = (measured.position, measured.covariance());
    let corrected = correct_position(a.into(), p.into(), &measured).unwrap();
    let (pi, ri) = (
        p.map(f64::from).try_inverse().unwrap(),
        r.map(f64::from).try_inverse().unwrap(),
    );
    let expected_covariance = (pi + ri).try_inverse().unwrap();
    let expected = expected_covariance * (pi * a.map(f64::from) + ri * b.map(f64::from));
    let covariance = Matrix3::from(corrected.covariance).map(f64::from);
    assert!((covariance - expected_covariance).amax() < 1e-4);
    let state = Vector3::from(corrected.state).map(f64::from);
    assert!((state - expected).amax() < 1e-3);
}

#[test]
fn refusals() {
    let (state, covariance) = prior();
    let broken = covariance.map(|_| f32::NAN);
    assert_eq!(corrected(state, broken).unwrap_err(), EkfError::NotFinite);
    let negative = -covariance * 1e3;
    assert_eq!(
        corrected(state, negative).unwrap_err(),
        EkfError::NotPositiveDefinite
    );
    let measured = measured_position();
    let (position, noise) = (measured.position, measured.covariance());
    assert_eq!(
        correct_position(position.into(), (-noise * 2.0).into(), &measured).unwrap_err(),
        EkfError::NotPositiveDefinite
    );
    assert_eq!(
        correct_position((position * f32::NAN).into(), noise.into(), &measured).unwrap_err(),
        EkfError::NotFinite
    );
}

/// A range of nearly nothing leaves no error across the line of sight.
#[test]
fn a_range_near_zero_is_corrected_with() {
    for range_m in [0.0, 1e-3, -0.05] {
        let sensed = |value, sigma| Sensed { value, sigma };
        let (elevation, azimuth) = (sensed(0.4, 0.02), sensed(3.1, 0.03));
        let near = crate::radar::converted(sensed(range_m, 100.0), elevation, azimuth);
        for variance in [1e-4, 1.0, 1e4] {
            let prior = Matrix3::identity() * variance;
            let start = Vector3::new(20.0, -15.0, 12.0);
            let corrected = correct_position(start.into(), prior.into(), &near);
            let covariance = Matrix3::from(corrected.expect("corrected").covariance);
            assert!(covariance.cholesky().is_some(), "{range_m} {variance}");
        }
    }
}

/// Half the logarithm of the determinant of the joint innovation covariance, and whitened
/// innovations whose squares sum to the NIS.
#[test]
fn the_root_of_the_determinant_is_the_joint_one() {
    let (state, covariance) = prior();
    let variances = SIGMAS.map(|sigma| f64::from(sigma).powi(2));
    let state: [f64; 6] = state.map(f64::from).into();
    let p = covariance.map(f64::from);
    let vectors = Vectors::whole(MEASURED.map(f64::from), SIGMAS.map(f64::from));
    let (got, whitened) = polar(&state, &p.into(), &vectors, &variances);
    let at = predict(
        [state[0], state[1], state[2]],
        [state[3], state[4], state[5]],
    );
    let h = SMatrix::<f64, 4, 6>::from_fn(|row, column| match (row, column) {
        (_, 0..3) => at.by_position[row][column],
        (3, _) => at.by_velocity[column - 3],
        _ => 0.0,
    });
    let s = h * p * h.transpose() + Matrix4::from_diagonal(&variances.into());
    assert!((got.ln_root - 0.5 * s.determinant().ln()).abs() < 1e-9);
    let sum: f64 = whitened.iter().map(|y| y * y).sum();
    assert!((got.nis - sum).abs() < 1e-9 * sum);
}

/// A noise below a hundred-thousandth of what the state doubts counts as that.
#[test]
fn the_least_noise_is_a_part_of_the_doubt() {
    let mut corrected = Corrected {
        state: [1.0_f64, 2.0],
        covariance: [[4.0, 1.0], [1.0, 9.0]],
        nis: 0.0,
        ln_root: 0.0,
    };
    let whitened = correct_scalar(&mut corrected, &[1.0, 0.0], 3.0, 0.0, 1.0);
    let variance = 4.0 * (1.0 + 1e-5);
    assert!((whitened - 3.0 / variance.sqrt()).abs() < 1e-12);
    assert!((corrected.ln_root - 0.5 * variance.ln()).abs() < 1e-12);
    assert!((corrected.state[0] - (1.0 + 4.0 / variance * 3.0)).abs() < 1e-12);
    assert!((corrected.state[1] - (2.0 + 1.0 / variance * 3.0)).abs() < 1e-12);
    let left = [
        [4.0 - 16.0 / variance, 1.0 - 4.0 / variance],
        [1.0 - 4.0 / variance, 9.0 - 1.0 / variance],
    ];
    for i in 0..2 {
        for j in 0..2 {
            assert!((corrected.covariance[i][j] - left[i][j]).abs() < 1e-12);
        }
    }
}

/// A converted measurement without errors is a millimetre wide.
#[test]
fn an_exact_position_is_a_millimetre_wide() {
    let measured = Converted {
        position: Vector3::new(1.0, 2.0, 3.0),
        axes: [Vector3::x(), Vector3::y(), Vector3::z()],
        sigmas_m: [0.0, 1e-3, 2e-3],
    };
    let prior = (Matrix3::identity() * 1e-6).into();
    let got = correct_position([1.0, 2.0, 3.001], prior, &measured).expect("corrected");
    for (axis, expected) in [5e-7, 5e-7, 8e-7].into_iter().enumerate() {
        let variance = got.covariance[axis][axis];
        assert!(
            (variance / expected - 1.0).abs() < 1e-4,
            "{axis}: {variance}"
        );
    }
    assert!((got.state[2] - 3.0008).abs() < 1e-5);
    assert!((got.nis - 0.2).abs() < 1e-3);
}

/// Each reason to refuse by itself, and what is just sound.
#[test]
fn what_rounding_spoiled_is_named() {
    let sound = Corrected {
        state: [1.0_f32, 2.0],
        covariance: [[1e-30, 0.0], [0.0, 1.0]],
        nis: 3.0,
        ln_root: 0.5,
    };
    let refusal = |change: fn(&mut Corrected<f32, 2>)| {
        let mut changed = sound;
        change(&mut changed);
        changed.check().err()
    };
    let (infinite, indefinite) = (
        Some(EkfError::NotFinite),
        Some(EkfError::NotPositiveDefinite),
    );
    assert_eq!(refusal(|_| ()), None);
    assert_eq!(refusal(|c| c.state[1] = f32::INFINITY), infinite);
    assert_eq!(refusal(|c| c.covariance[0][1] = f32::NAN), infinite);
    assert_eq!(refusal(|c| c.covariance[1][1] = 0.0), indefinite);
    assert_eq!(refusal(|c| c.covariance[0][0] = -1.0), indefinite);
    assert_eq!(refusal(|c| c.nis = f32::NAN), indefinite);
    assert_eq!(refusal(|c| c.nis = f32::INFINITY), infinite);
}
