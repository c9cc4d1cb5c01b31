//! The radar's measurement model and its inverse.
//!
//! Frame: radar at the origin, x east, y north, z up. Azimuth from +x towards +y, elevation from
//! the horizontal plane, range-rate positive outbound. Metres, radians, metres per second.
//! Measurement order everywhere: elevation, azimuth, range, range-rate.

use libm::{cosf, sinf};
use nalgebra::{Matrix3, Vector3};

use crate::Measurement;
use crate::scalar::Scalar;

/// Closest horizontal distance, m, at which the Jacobian is evaluated: nearer to the vertical the
/// azimuth's derivative would overflow.
const HORIZONTAL_MIN_M: f64 = 1e-3;

/// What a noiseless radar would measure, with its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Prediction<S> {
    /// Elevation, azimuth, range, range-rate.
    pub measurement: [S; 4],
    /// Derivatives of each by position (x, y, z).
    pub by_position: [[S; 3]; 4],
    /// Derivative of range-rate by velocity: the line-of-sight unit vector. The other three do not
    /// depend on velocity.
    pub by_velocity: [S; 3],
}

/// The measurement function h and its Jacobian at a position (m) and velocity (m/s).
pub fn predict<S: Scalar>(position: [S; 3], velocity: [S; 3]) -> Prediction<S> {
    let [x, y, z] = position;
    let horizontal = x.hypot(y);
    let bounded = horizontal.max(S::constant(HORIZONTAL_MIN_M));
    let range = (bounded * bounded + z * z).sqrt();
    let unit = [x / range, y / range, z / range];
    let range_rate = unit[0] * velocity[0] + unit[1] * velocity[1] + unit[2] * velocity[2];
    let range_squared = range * range;
    Prediction {
        measurement: [z.atan2(horizontal), y.atan2(x), range, range_rate],
        by_position: [
            [
                -x * z / (range_squared * bounded),
                -y * z / (range_squared * bounded),
                bounded / range_squared,
            ],
            [-y / (bounded * bounded), x / (bounded * bounded), S::constant(0.0)],
            unit,
            core::array::from_fn(|i| (velocity[i] - range_rate * unit[i]) / range),
        ],
        by_velocity: unit,
    }
}

/// Position of a target at `range` (m), `elevation` and `azimuth` (rad). A negative range, which
/// noise can produce, gives the point opposite.
pub fn position<S: Scalar>(range: S, elevation: S, azimuth: S) -> [S; 3] {
    let horizontal = range * elevation.cos();
    [
        horizontal * azimuth.cos(),
        horizontal * azimuth.sin(),
        range * elevation.sin(),
    ]
}

/// A measured position and how it may err.
#[derive(Clone, Copy, Debug)]
pub struct Converted {
    /// Position, m.
    pub position: Vector3<f32>,
    /// Unit vectors along which the errors are independent: radial, upward, lateral.
    pub axes: [Vector3<f32>; 3],
    /// Standard deviation along each, m.
    pub sigmas_m: [f32; 3],
}

impl Converted {
    /// The covariance of the position, m^2: `R = J diag(sigma^2) J'`.
    pub fn covariance(&self) -> Matrix3<f32> {
        let mut covariance = Matrix3::zeros();
        for (axis, sigma) in self.axes.iter().zip(self.sigmas_m) {
            covariance += axis * axis.transpose() * (sigma * sigma);
        }
        covariance
    }
}

/// The measured position with its errors converted from the polar sigmas to first order. Metres.
pub fn converted(measurement: &Measurement) -> Converted {
    let Measurement {
        range_m,
        elevation_rad,
        azimuth_rad,
        sigmas,
        ..
    } = *measurement;
    let (sin_el, cos_el) = (sinf(elevation_rad), cosf(elevation_rad));
    let (sin_az, cos_az) = (sinf(azimuth_rad), cosf(azimuth_rad));
    let radial = Vector3::new(cos_el * cos_az, cos_el * sin_az, sin_el);
    let upward = Vector3::new(-sin_el * cos_az, -sin_el * sin_az, cos_el);
    let lateral = Vector3::new(-sin_az, cos_az, 0.0);
    Converted {
        position: radial * range_m,
        axes: [radial, upward, lateral],
        sigmas_m: [
            sigmas.range_m,
            (range_m * sigmas.elevation_rad).abs(),
            (range_m * cos_el * sigmas.azimuth_rad).abs(),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Sigmas;
    use crate::gaussian::standard_normal;
    use crate::rng::seeded;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn wrapping_keeps_the_direction(angle in -1e4_f32..1e4) {
            let wrapped = wrap_angle(angle);
            prop_assert!((-PI..PI).contains(&wrapped));
            let turns = f64::from(angle - wrapped) / core::f64::consts::TAU;
            prop_assert!((turns - libm::round(turns)).abs() < 1e-3);
        }

        #[test]
        fn prediction_inverts_position(range in 1.0_f32..5e3, el in -1.4_f32..1.4, az in -3.1_f32..3.1) {
            let predicted = predict(position(range, el, az), [0.0; 3]).measurement;
            prop_assert!((predicted[0] - el).abs() < 1e-5);
            prop_assert!((predicted[1] - az).abs() < 1e-5);
            prop_assert!((predicted[2] / range - 1.0).abs() < 1e-6);
        }

        /// Central differences in f64 of the textbook formulas.
        #[test]
        fn jacobian_agrees_with_differences(
            x in -50.0_f64..50.0, y in 2.0_f64..50.0, z in -20.0_f64..30.0,
            v in prop::array::uniform3(-8.0_f64..8.0),
        ) {
            let h = |p: [f64; 3], v: [f64; 3]| {
                let r = libm::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
                [libm::asin(p[2] / r), libm::atan2(p[1], p[0]), r,
                 (p[0] * v[0] + p[1] * v[1] + p[2] * v[2]) / r]
            };
            let narrow = |p: [f64; 3]| p.map(|c| c as f32);
            let p = [x, y, z];
            let predicted = predict(narrow(p), narrow(v));
            for axis in 0..3 {
                let step = |value: [f64; 3], d: f64| {
                    let mut moved = value; moved[axis] += d; moved
                };
                let (high, low) = (h(step(p, 1e-4), v), h(step(p, -1e-4), v));
                for row in 0..4 {
                    let difference = (high[row] - low[row]) / 2e-4;
                    prop_assert!((f64::from(predicted.by_position[row][axis]) - difference).abs() < 2e-4);
                }
                let difference = (h(p, step(v, 1e-4))[3] - h(p, step(v, -1e-4))[3]) / 2e-4;
                prop_assert!((f64::from(predicted.by_velocity[axis]) - difference).abs() < 1e-5);
            }
        }
    }

    /// Monte Carlo: the covariance of converted noisy measurements at low noise.
    #[test]
    fn converted_covariance_is_that_of_the_noise() {
        let sigmas = Sigmas {
            range_m: 0.5,
            elevation_rad: 0.01,
            azimuth_rad: 0.02,
            range_rate_mps: 0.1,
        };
        let truth = Measurement {
            time_us: 0,
            range_m: 40.0,
            elevation_rad: 0.5,
            azimuth_rad: 2.0,
            range_rate_mps: 0.0,
            sigmas,
        };
        let converted = converted(&truth);
        let (mean, covariance) = (converted.position, converted.covariance());
        let mut rng = seeded(5);
        let mut sum = Matrix3::<f64>::zeros();
        const DRAWS: usize = 40_000;
        for _ in 0..DRAWS {
            let noisy = position(
                truth.range_m + sigmas.range_m * standard_normal(&mut rng),
                truth.elevation_rad + sigmas.elevation_rad * standard_normal(&mut rng),
                truth.azimuth_rad + sigmas.azimuth_rad * standard_normal(&mut rng),
            );
            let error = (Vector3::from(noisy) - mean).map(f64::from);
            sum += error * error.transpose();
        }
        let sampled = sum / DRAWS as f64;
        // Five standard errors of a variance over 40,000 draws are 3.5 %.
        let largest = f64::from(covariance.amax());
        assert!((sampled - covariance.map(f64::from)).amax() < 0.035 * largest);
    }

    #[test]
    fn straight_above_and_at_the_origin_stays_finite() {
        for point in [[0.0, 0.0, 20.0], [0.0; 3]] {
            let predicted = predict(point, [3.0, 2.0, 1.0]);
            assert!(predicted.measurement.iter().all(|v| v.is_finite()));
            assert!(
                predicted
                    .by_position
                    .iter()
                    .flatten()
                    .all(|v| v.is_finite())
            );
        }
    }
}
