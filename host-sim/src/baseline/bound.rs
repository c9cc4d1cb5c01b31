//! The posterior Cramer-Rao bound of the fitted motion model: the floor line of the tables.
//!
//! The recursion is Tichavsky's (Tichavsky, Muravchik and Nehorai 1998) for linear motion and
//! additive noise, `J' = (Q + F J^-1 F')^-1 + H' R^-1 H`, with H taken at the flight's true states.
//! It is run flight by flight and averaged over flights. Averaging the information first would mix
//! what a radar knows across the line of sight of one flight into the range of another.
//!
//! It is the floor for filters that believe in this motion model, on targets that follow it. A
//! method with a better model of the very flights may go below it.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::reading::Reading;
use bnkf_model_export::radar::sampling::time_us;
use nalgebra::{Matrix3, Matrix6, SymmetricEigen, Vector3, Vector4};

use super::correction::Correction;
use super::discrete::Discrete;
use super::gaussian::Gaussian;
use super::motion::Motion;
use super::prior::PopulationPrior;
use super::sensor::Observation;
use crate::filter::FilterError;

/// Bounds on the covariance of the position [m^2] at every sample of `flight`, the first included.
///
/// Of `readings`, one entry per sample, only the times and the standard deviations are used.
///
/// # Errors
/// The first reading is missing ([`FilterError::NotStarted`]) or a matrix is not positive definite.
pub fn position_bounds<const N: usize>(
    motion: &impl Motion<N>,
    prior: &PopulationPrior,
    flight: &Flight,
    readings: &[Option<Reading>],
) -> Result<Vec<Matrix3<f64>>, FilterError> {
    let (Some(first), Some(Some(reading))) = (flight.samples.first(), readings.first()) else {
        return Err(FilterError::NotStarted);
    };
    let truth = (first.position_m.into(), first.velocity_mps.into());
    let mut state = motion.initial(&first_bound(prior, &truth, &Observation::from(reading))?);
    let mut bounds = vec![position(&state)];
    let mut step = None;
    let mut last_us = time_us(flight, first.time_s);
    for (sample, reading) in flight.samples.iter().zip(readings).skip(1) {
        let now_us = time_us(flight, sample.time_s);
        let elapsed_us = now_us
            .checked_sub(last_us)
            .ok_or(FilterError::TimeWentBack)?;
        last_us = now_us;
        let step = Discrete::kept(&mut step, motion, elapsed_us as f64 * 1e-6);
        state = state.predicted(step);
        if let Some(reading) = reading {
            // The covariance of an extended filter that linearises at the truth is the bound.
            let (p, v) = (
                Vector3::from(sample.position_m),
                Vector3::from(sample.velocity_mps),
            );
            state.mean.fixed_rows_mut::<3>(0).copy_from(&p);
            state.mean.fixed_rows_mut::<3>(3).copy_from(&v);
            let observation = Observation::from(reading);
            let noiseless = Observation {
                z: observation.expected(&p, &v),
                ..observation
            };
            state = Correction::Extended.apply(&state, &noiseless)?.0;
        }
        bounds.push(position(&state));
    }
    Ok(bounds)
}

fn position<const N: usize>(state: &Gaussian<N>) -> Matrix3<f64> {
    state.covariance.fixed_view::<3, 3>(0, 0).into_owned()
}

/// Inverse of the information in the population's range, elevation and velocity and in the first
/// reading.
fn first_bound(
    prior: &PopulationPrior,
    truth: &(Vector3<f64>, Vector3<f64>),
    observation: &Observation,
) -> Result<Gaussian<6>, FilterError> {
    let (p, v) = truth;
    let weight = |sigma: f64| sigma.powi(-2);
    let h = observation.jacobian(p, v);
    let measured = Vector4::from_fn(|i, _| match observation.present[i] {
        true => weight(observation.sigma[i]),
        false => 0.0,
    });
    let mut information = h.transpose() * nalgebra::Matrix4::from_diagonal(&measured) * h;
    let spherical = h.fixed_view::<4, 3>(0, 0);
    let known = Vector4::new(
        weight(prior.elevation_rad.sigma),
        0.0,
        weight(prior.range_m.sigma),
        0.0,
    );
    let mut block = information.fixed_view_mut::<3, 3>(0, 0);
    block += spherical.transpose() * nalgebra::Matrix4::from_diagonal(&known) * spherical;
    for axis in 3..5 {
        information[(axis, axis)] += weight(prior.velocity_horizontal_sigma_mps);
    }
    information[(5, 5)] += weight(prior.velocity_vertical_sigma_mps);
    let factor = information
        .cholesky()
        .ok_or(FilterError::NotPositiveDefinite)?;
    Ok(Gaussian {
        mean: nalgebra::Vector6::new(p.x, p.y, p.z, v.x, v.y, v.z),
        covariance: factor.solve(&Matrix6::identity()),
    })
}

/// Mean distance (m) of a zero-mean Gaussian of covariance `covariance_m2` from its mean: what the
/// bound on a covariance means for a mean Euclidean distance.
///
/// E|e| = (1 / 2 sqrt(pi)) x the integral of (1 - E exp(-t |e|^2)) t^(-3/2) over t > 0, and
/// E exp(-t |e|^2) = 1 / sqrt(det(1 + 2 t C)). With t = exp(s) the integrand is smooth and falls
/// as exp(-|s| / 2), so the trapezoid rule with steps of one is right to 1e-8.
pub fn mean_distance_m(covariance_m2: &Matrix3<f64>) -> f64 {
    let trace = covariance_m2.trace();
    if trace <= 0.0 {
        return 0.0;
    }
    let eigenvalues = SymmetricEigen::new(covariance_m2 / trace).eigenvalues;
    let integrand = |s: f64| {
        let t = s.exp();
        let log_det: f64 = eigenvalues
            .iter()
            .map(|l| (2.0 * t * l.max(0.0)).ln_1p())
            .sum();
        -(-0.5 * log_det).exp_m1() * (-0.5 * s).exp()
    };
    let integral: f64 = (-40..=40).map(|s| integrand(f64::from(s))).sum();
    integral * trace.sqrt() / (2.0 * core::f64::consts::PI.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baseline::motion::WhiteAcceleration;
    use crate::baseline::prior::tests::PRIOR;
    use bnkf_model_export::flights::flight::Flight;
    use bnkf_model_export::radar::pose::Pose;

    #[test]
    fn mean_distances_by_closed_form() {
        let isotropic = mean_distance_m(&(Matrix3::identity() * 4.0));
        assert!((isotropic - 2.0 * 2.0 * (2.0 / core::f64::consts::PI).sqrt()).abs() < 1e-7);
        let line = mean_distance_m(&Matrix3::from_diagonal(&Vector3::new(9.0, 0.0, 0.0)));
        assert!((line - 3.0 * (2.0 / core::f64::consts::PI).sqrt()).abs() < 1e-7);
        // Two axes: Rayleigh, sigma sqrt(pi / 2).
        let plane = mean_distance_m(&Matrix3::from_diagonal(&Vector3::new(1.0, 0.0, 1.0)));
        assert!((plane - (core::f64::consts::PI / 2.0).sqrt()).abs() < 1e-7);
        assert_eq!(mean_distance_m(&Matrix3::zeros()), 0.0);
    }

    fn reading(time_us: u64) -> Reading {
        Reading {
            time_us,
            range_m: f64::NAN,
            elevation_rad: f64::NAN,
            azimuth_rad: f64::NAN,
            range_rate_mps: f64::NAN,
            sigma_range_m: 2.0,
            sigma_elevation_rad: 0.01,
            sigma_azimuth_rad: 0.02,
            sigma_range_rate_mps: 0.5,
            sensor: Pose::ORIGIN,
            late_us: 0,
        }
    }

    /// Straight away from the radar the radial axis is a scalar problem: a two-state Kalman
    /// recursion for range and range-rate, written out here in information form.
    #[test]
    fn along_the_line_of_sight_it_is_the_scalar_recursion() {
        let rows: Vec<[f64; 4]> = (0..30)
            .map(|k| [0.1 * f64::from(k), 300.0 + 0.2 * f64::from(k), 0.0, 0.0])
            .collect();
        let flight = Flight::from_track("f", "f", &rows).unwrap();
        let readings: Vec<_> = (0..30)
            .map(|k| (k % 4 != 3).then(|| reading(k * 100_000)))
            .collect();
        let motion = WhiteAcceleration { q_m2_s3: 0.4 };
        let bounds = position_bounds(&motion, &PRIOR, &flight, &readings).unwrap();

        use nalgebra::{Matrix2, Vector2};
        let r_inv = Matrix2::from_diagonal(&Vector2::new(1.0 / 4.0, 1.0 / 0.25));
        let prior = Matrix2::from_diagonal(&Vector2::new(1.0 / 36.0, 1.0 / (1.7 * 1.7)));
        let f = Matrix2::new(1.0, 0.1, 0.0, 1.0);
        let q = Matrix2::new(0.001 / 3.0, 0.005, 0.005, 0.1) * 0.4;
        let mut information = prior + r_inv;
        for (k, bound) in bounds.iter().enumerate() {
            if k > 0 {
                let predicted = f * information.try_inverse().unwrap() * f.transpose() + q;
                information = predicted.try_inverse().unwrap();
                if readings[k].is_some() {
                    information += r_inv;
                }
            }
            let radial = information.try_inverse().unwrap()[(0, 0)];
            assert!((bound[(0, 0)] / radial - 1.0).abs() < 1e-6, "step {k}");
        }
    }

    #[test]
    fn a_flight_without_its_first_reading_has_no_bound() {
        let rows = [
            [0.0, 30.0, 0.0, 9.0],
            [0.1, 30.0, 0.0, 9.0],
            [0.2, 30.0, 0.0, 9.0],
        ];
        let flight = Flight::from_track("f", "f", &rows).unwrap();
        let motion = WhiteAcceleration { q_m2_s3: 0.4 };
        let none = position_bounds(&motion, &PRIOR, &flight, &[None, None, None]);
        assert_eq!(none, Err(FilterError::NotStarted));
    }
}
