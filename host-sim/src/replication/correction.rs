//! The paper's Kalman correction of a network's estimate (Eq. 12-13).

use bnkf_model_export::radar::reading::Reading;
use nalgebra::{Cholesky, Matrix3, Matrix6, Vector3, Vector6};

use super::departure::Departure;
use super::moments::StateMoments;
use super::pair::line_of_sight_mps;
use super::recipe::Recipe;
use crate::baseline::sensor::cartesian_jacobian;
use crate::contest::track::position_of;

/// Position and its covariance before a correction.
pub fn uncorrected(moments: &StateMoments) -> (Vector3<f64>, Matrix3<f64>) {
    (
        moments.mean.fixed_rows::<3>(0).into(),
        moments.covariance.fixed_view::<3, 3>(0, 0).into(),
    )
}

/// Position (m) and its covariance (m^2) after the correction by `reading`, `None` if the
/// innovation's covariance is not positive definite.
///
/// As the paper says, `z*` is the measured position and R its covariance to first order. With
/// [`Departure::RangeSigma`] the whole estimate is measured, velocity along the line of sight and
/// all, with `R = sigma_range^2 I`.
pub fn corrected(
    moments: &StateMoments,
    reading: &Reading,
    recipe: &Recipe,
) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    if recipe.departs(Departure::RangeSigma) {
        with_range_sigma(moments, reading, recipe.outputs() > 3)
    } else {
        with_converted(moments, reading)
    }
}

fn with_converted(
    moments: &StateMoments,
    reading: &Reading,
) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    let (mean, covariance) = uncorrected(moments);
    let sigma = Vector3::new(
        reading.sigma_elevation_rad,
        reading.sigma_azimuth_rad,
        reading.sigma_range_m,
    );
    let jacobian = cartesian_jacobian(reading.elevation_rad, reading.azimuth_rad, reading.range_m);
    let noise =
        jacobian * Matrix3::from_diagonal(&sigma.component_mul(&sigma)) * jacobian.transpose();
    let innovation = Cholesky::new(covariance + noise)?;
    let gain = innovation.solve(&covariance).transpose();
    let position = mean + gain * (position_of(reading) - mean);
    let after = (Matrix3::identity() - gain) * covariance;
    Some((position, 0.5 * (after + after.transpose())))
}

fn with_range_sigma(
    moments: &StateMoments,
    reading: &Reading,
    velocity: bool,
) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    let mut measured = Vector6::zeros();
    measured
        .fixed_rows_mut::<3>(0)
        .copy_from(&position_of(reading));
    // Without a velocity both its estimate and its measurement are zero, and stay so.
    if velocity {
        measured
            .fixed_rows_mut::<3>(3)
            .copy_from(&line_of_sight_mps(reading));
    }
    let noise = Matrix6::identity() * reading.sigma_range_m.powi(2);
    let covariance = moments.covariance;
    let innovation = Cholesky::new(covariance + noise)?;
    let gain = innovation.solve(&covariance).transpose();
    let after = (Matrix6::identity() - gain) * covariance;
    Some(uncorrected(&StateMoments {
        mean: moments.mean + gain * (measured - moments.mean),
        covariance: 0.5 * (after + after.transpose()),
    }))
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::radar::pose::Pose;
    use bnkf_model_export::radar::reading::Reading;
    use nalgebra::{Matrix6, Vector3, Vector6};

    use super::{StateMoments, corrected, uncorrected};
    use crate::replication::departure::Departure;
    use crate::replication::recipe::Recipe;

    /// Due east at 30 m, level, outbound with 2 m/s.
    const READING: Reading = Reading {
        time_us: 0,
        range_m: 30.0,
        elevation_rad: 0.0,
        azimuth_rad: 0.0,
        range_rate_mps: 2.0,
        sigma_range_m: 3.0,
        sigma_elevation_rad: 0.1,
        sigma_azimuth_rad: 0.2,
        sigma_range_rate_mps: 0.5,
        sensor: Pose::ORIGIN,
        late_us: 0,
    };

    fn moments(covariance: Matrix6<f64>) -> StateMoments {
        StateMoments {
            mean: Vector6::new(20.0, 4.0, 1.0, 0.0, 0.0, 0.0),
            covariance,
        }
    }

    #[test]
    fn the_papers_correction_by_hand() {
        let mut variances = Vector6::repeat(9.0);
        variances[2] = 1.0;
        let prior = moments(Matrix6::from_diagonal(&variances));
        let (position, covariance) = corrected(&prior, &READING, &Recipe::PAPER).unwrap();
        // R is diag(3^2, (30 * 0.2)^2, (30 * 0.1)^2): gains 1/2, 1/5 and 1/10.
        let expected = Vector3::new(25.0, 4.0 - 4.0 / 5.0, 1.0 - 1.0 / 10.0);
        assert!((position - expected).norm() < 1e-12);
        let expected = Vector3::new(4.5, 9.0 * 0.8, 0.9);
        assert!((covariance.diagonal() - expected).norm() < 1e-12);
    }

    #[test]
    fn the_codes_correction_takes_the_velocity_along_by_its_covariance() {
        // x and vx belong together: [[9, 9], [9, 18]], R = 9 I.
        let mut covariance = Matrix6::identity() * 9.0;
        covariance[(3, 3)] = 18.0;
        (covariance[(0, 3)], covariance[(3, 0)]) = (9.0, 9.0);
        let prior = moments(covariance);
        let with_velocity = corrected(&prior, &READING, &Recipe::REFERENCE_CODE).unwrap();
        // S = [[18, 9], [9, 27]], det 405; gain of x: [9, 9] S^-1 = [162, 81] / 405 = [.4, .2].
        assert!((with_velocity.0.x - (20.0 + 0.4 * 10.0 + 0.2 * 2.0)).abs() < 1e-12);
        assert!((with_velocity.0.y - 2.0).abs() < 1e-12);
        // 9 - .4 * 9 - .2 * 9
        assert!((with_velocity.1[(0, 0)] - 3.6).abs() < 1e-12);

        let position_only = Recipe::REFERENCE_CODE.switched(Departure::Cartesian);
        let mut covariance = Matrix6::zeros();
        covariance.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        let prior = moments(covariance);
        let (position, after) = corrected(&prior, &READING, &position_only).unwrap();
        assert!((position - Vector3::new(21.0, 3.6, 0.9)).norm() < 1e-12);
        assert!((after.diagonal() - Vector3::repeat(0.9)).norm() < 1e-12);
        assert_eq!(uncorrected(&prior).0, Vector3::new(20.0, 4.0, 1.0));
    }

    #[test]
    fn an_innovation_without_a_factor_is_no_estimate() {
        let prior = moments(Matrix6::from_diagonal_element(f64::NAN));
        for recipe in [Recipe::PAPER, Recipe::REFERENCE_CODE] {
            assert!(corrected(&prior, &READING, &recipe).is_none());
        }
    }
}
