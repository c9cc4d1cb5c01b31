//! The radar's measurement model and its inverse.
//!
//! Frame: radar at rest at the origin (positions and velocities are relative to it), x east, y north, z up. Azimuth from +x towards +y, elevation from
//! the horizontal plane, range-rate positive outbound. Metres, radians, metres per second.
//! Measurement order everywhere: elevation, azimuth, range, range-rate.

use nalgebra::Vector3;

use crate::measurement::{Sensed, Vectors};
use crate::scalar::Scalar;

/// Least squared horizontal distance, m^2, at which a derivative is evaluated and an azimuth is
/// followed: a centimetre. Nearer to the vertical the azimuth's derivative grows without bound.
pub const HORIZONTAL_FLOOR_M2: f64 = 1e-4;

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
#[inline]
pub fn predict<S: Scalar>(position: [S; 3], velocity: [S; 3]) -> Prediction<S> {
    predict_beyond(HORIZONTAL_FLOOR_M2, position, velocity)
}

/// [`predict`] with another floor (m^2) than [`HORIZONTAL_FLOOR_M2`]. Range and range-rate are
/// exact where the squared horizontal distance exceeds it, so a floor next to zero makes them
/// exact on the vertical too, where the derivatives then grow without bound.
#[inline]
pub fn predict_beyond<S: Scalar>(
    floor_m2: f64,
    position: [S; 3],
    velocity: [S; 3],
) -> Prediction<S> {
    let [x, y, z] = position;
    let squared = x * x + y * y;
    let bounded_squared = squared.max(S::constant(floor_m2));
    let bounded = bounded_squared.sqrt();
    let range_squared = bounded_squared + z * z;
    let range = range_squared.sqrt();
    let unit = [x / range, y / range, z / range];
    let range_rate = unit[0] * velocity[0] + unit[1] * velocity[1] + unit[2] * velocity[2];
    Prediction {
        measurement: [z.atan2(squared.sqrt()), y.atan2(x), range, range_rate],
        by_position: [
            [
                -x * z / (range_squared * bounded),
                -y * z / (range_squared * bounded),
                bounded / range_squared,
            ],
            [-y / bounded_squared, x / bounded_squared, S::constant(0.0)],
            unit,
            core::array::from_fn(|i| (velocity[i] - range_rate * unit[i]) / range),
        ],
        by_velocity: unit,
    }
}

/// What a measurement (elevation, azimuth, range, range-rate) says beyond what was expected.
///
/// Elevation and azimuth name every direction twice: `(e, a)` and `(pi - e, a + pi)`. The pair that
/// lies nearer to the expected one counts, so a target that passes the zenith between two
/// measurements, or a noisy elevation beyond it, is met without a jump of half a circle. Without an azimuth nothing
/// tells the two apart, and the elevation is taken as it is.
pub fn innovations<S: Scalar>(vectors: &Vectors<S>, expected: &[S; 4]) -> [S; 4] {
    let measured = &vectors.measured;
    let half_turn = S::constant(core::f64::consts::PI);
    let elevation = (measured[0] - expected[0]).wrap();
    let azimuth = (measured[1] - expected[1]).wrap();
    let over = (half_turn - measured[0] - expected[0]).wrap();
    let opposite = (azimuth + half_turn).wrap();
    let nearer = elevation * elevation + azimuth * azimuth - over * over - opposite * opposite;
    // Only near the vertical, or where noise may have carried it over: elsewhere the other side is another place.
    let reach = (S::constant(9.0) * vectors.sigmas[0] * vectors.sigmas[0]).clamp(1.0, 2.25);
    let vertical = reach - over * over;
    let other = nearer.step() * vertical.step() * vectors.present[1];
    [
        elevation + other * (over - elevation),
        azimuth + other * (opposite - azimuth),
        measured[2] - expected[2],
        measured[3] - expected[3],
    ]
}

/// Position of a target at `range` (m), `elevation` and `azimuth` (rad). A negative range, which
/// noise can produce, gives the point opposite.
pub fn position<S: Scalar>(range: S, elevation: S, azimuth: S) -> [S; 3] {
    let (sin_el, cos_el) = elevation.sin_cos();
    let (sin_az, cos_az) = azimuth.sin_cos();
    let horizontal = range * cos_el;
    [horizontal * cos_az, horizontal * sin_az, range * sin_el]
}

/// Unit vectors at a direction (rad) along which range, elevation and azimuth grow.
#[inline]
pub fn axes<S: Scalar>(elevation: S, azimuth: S) -> [[S; 3]; 3] {
    let (sin_el, cos_el) = elevation.sin_cos();
    let (sin_az, cos_az) = azimuth.sin_cos();
    [
        [cos_el * cos_az, cos_el * sin_az, sin_el],
        [-sin_el * cos_az, -sin_el * sin_az, cos_el],
        [-sin_az, cos_az, S::constant(0.0)],
    ]
}

/// A measured position and how it may err.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Converted {
    /// Position, m.
    pub position: Vector3<f32>,
    /// Unit vectors along which the errors are independent: radial, upward, lateral.
    pub axes: [Vector3<f32>; 3],
    /// Standard deviation along each, m.
    pub sigmas_m: [f32; 3],
}

#[cfg(test)]
impl Converted {
    /// The covariance of the position, m^2: `R = J diag(sigma^2) J'`.
    pub fn covariance(&self) -> nalgebra::Matrix3<f32> {
        let mut covariance = nalgebra::Matrix3::zeros();
        for (axis, sigma) in self.axes.iter().zip(self.sigmas_m) {
            covariance += axis * axis.transpose() * (sigma * sigma);
        }
        covariance
    }
}

/// The measured position with its errors converted from the polar sigmas to first order. Metres.
pub(crate) fn converted(range: Sensed, elevation: Sensed, azimuth: Sensed) -> Converted {
    let (range_m, elevation_rad, azimuth_rad) = (range.value, elevation.value, azimuth.value);
    let axes = axes(elevation_rad, azimuth_rad).map(Vector3::from);
    Converted {
        position: axes[0] * range_m,
        axes,
        sigmas_m: [
            range.sigma,
            (range_m * elevation.sigma).abs(),
            (range_m * Scalar::cos(elevation_rad) * azimuth.sigma).abs(),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaussian::standard_normal;
    use crate::rng::seeded;
    use core::f64::consts::PI;
    use nalgebra::Matrix3;
    use proptest::prelude::*;

    proptest! {

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
        let sensed = |value, sigma| Sensed { value, sigma };
        let (range, elevation, azimuth) = (sensed(40.0, 0.5), sensed(0.5, 0.01), sensed(2.0, 0.02));
        let converted = converted(range, elevation, azimuth);
        let (mean, covariance) = (converted.position, converted.covariance());
        let mut rng = seeded(5);
        let mut sum = Matrix3::<f64>::zeros();
        const DRAWS: usize = 40_000;
        for _ in 0..DRAWS {
            let mut noisy =
                |sensed: Sensed| sensed.value + sensed.sigma * standard_normal(&mut rng);
            let noisy = position(noisy(range), noisy(elevation), noisy(azimuth));
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
        for point in [[0.0_f32, 0.0, 20.0], [0.0; 3]] {
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

    /// Jacobian of every component by central differences in f64.
    #[test]
    fn the_jacobian_is_the_derivative() {
        let at = [12.0, -21.0, 9.0, 1.5, -0.7, 0.4];
        let expected = |s: &[f64; 6]| predict([s[0], s[1], s[2]], [s[3], s[4], s[5]]);
        let prediction = expected(&at);
        for k in 0..6 {
            let (mut high, mut low) = (at, at);
            high[k] += 1e-5;
            low[k] -= 1e-5;
            for i in 0..4 {
                let difference =
                    (expected(&high).measurement[i] - expected(&low).measurement[i]) / 2e-5;
                let derivative = match (k, i) {
                    (0..3, _) => prediction.by_position[i][k],
                    (_, 3) => prediction.by_velocity[k - 3],
                    _ => 0.0,
                };
                assert!((derivative - difference).abs() < 1e-9, "{i} {k}");
            }
        }
    }

    /// The innovations of a measurement that lacks nothing.
    fn whole(measured: [f64; 4], expected: &[f64; 4]) -> [f64; 4] {
        innovations(&Vectors::whole(measured, [0.1; 4]), expected)
    }

    #[test]
    fn a_direction_has_two_names() {
        let expected = [1.50, 0.3, 20.0, 1.0];
        let plain = whole([1.52, 0.25, 21.0, 0.5], &expected);
        let named = [PI - 1.52, 0.25 + PI, 21.0, 0.5];
        for (a, b) in plain.into_iter().zip(whole(named, &expected)) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        for (a, b) in plain.into_iter().zip([0.02, -0.05, 1.0, -0.5]) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }

    /// Past the zenith the azimuth has turned by half a circle; the innovation has not.
    #[test]
    fn the_zenith_is_passed_smoothly() {
        let before = predict([0.5, 0.0, 20.0], [0.0; 3]).measurement;
        let behind = predict([-0.5, 0.001, 20.0], [0.0; 3]).measurement;
        let jump = whole(behind, &before);
        assert!((jump[0] - 0.05).abs() < 1e-3, "{jump:?}");
        assert!(jump[1].abs() < 0.01, "{jump:?}");
        // Far from the zenith a target on the other side is on the other side.
        let far = whole([0.2, PI - 0.1, 20.0, 0.0], &[0.2, 0.0, 20.0, 0.0]);
        assert!(far[0].abs() < 1e-12 && (far[1] - (PI - 0.1)).abs() < 1e-12);
    }

    /// An azimuth that was not measured does not say that the target is on the other side.
    #[test]
    fn without_an_azimuth_there_is_no_other_side() {
        for azimuth in [0.0, 1.5, 2.8, -3.0] {
            let expected = [1.3, azimuth, 20.0, 0.0];
            let mut vectors = Vectors::whole([1.32, 0.0, 20.0, 0.0], [1.0; 4]);
            assert_eq!(
                innovations(&vectors, &expected)[0] > 0.03,
                azimuth.abs() > 2.0
            );
            vectors.present[1] = 0.0;
            assert!((innovations(&vectors, &expected)[0] - 0.02).abs() < 1e-12);
        }
    }

    /// Of a target at 55 degrees a blunt sensor reads 124: that is no target at 56 on the other side.
    #[test]
    fn noise_may_carry_an_elevation_past_the_vertical() {
        let expected = [0.96, 0.4, 20.0, 0.0];
        let canonical = [PI - (0.96 + 1.2), 0.4 + PI, 20.0, 0.0];
        let of = |sigma| innovations(&Vectors::whole(canonical, [sigma; 4]), &expected);
        assert!(of(0.3)[1].abs() > 3.0);
        let [elevation, azimuth, ..] = of(0.5);
        assert!((elevation - 1.2).abs() < 1e-9 && azimuth.abs() < 1e-9);
    }

    /// The same choice written with branches, for every pair of a grid that meets no tie.
    #[test]
    fn the_nearer_name_counts_and_only_near_the_vertical() {
        let wrap = |angle: f64| angle - 2.0 * PI * (angle / (2.0 * PI)).round();
        let mut others = 0;
        for i in 0..40 {
            for j in 0..40 {
                for k in 0..16 {
                    let expected = [-1.57 + 0.0803 * f64::from(i), 0.4, 20.0, 1.0];
                    let elevation = -1.61 + 0.0811 * f64::from(j);
                    let measured = [elevation, 0.37 + 0.397 * f64::from(k), 18.5, -2.0];
                    let direct = [
                        wrap(measured[0] - expected[0]),
                        wrap(measured[1] - expected[1]),
                    ];
                    let over = [wrap(PI - measured[0] - expected[0]), wrap(direct[1] + PI)];
                    let length = |pair: [f64; 2]| pair[0].hypot(pair[1]);
                    let crossed = length(over) < length(direct) && over[0].abs() < 1.0;
                    others += u32::from(crossed);
                    let [e, a] = if crossed { over } else { direct };
                    let got = whole(measured, &expected);
                    for (got, expected) in got.into_iter().zip([e, a, -1.5, -3.0]) {
                        assert!((got - expected).abs() < 1e-9, "{measured:?} {got}");
                    }
                }
            }
        }
        assert!(others > 500, "{others}");
    }

    /// Near the vertical the derivatives are those of a centimetre's distance; the elevation is exact.
    #[test]
    fn derivatives_near_the_vertical_are_bounded() {
        let (x, y, z) = (3e-3, -4e-3, 20.0);
        let got = predict([x, y, z], [3.0, 2.0, 1.0]);
        let (rho, range2) = (0.01, 1e-4 + 400.0_f64);
        let range = range2.sqrt();
        let rate = (3.0 * x + 2.0 * y + z) / range;
        let expected = [z.atan2(5e-3), y.atan2(x), range, rate];
        let unit = [x / range, y / range, z / range];
        let by_position = [
            [
                -x * z / (range2 * rho),
                -y * z / (range2 * rho),
                rho / range2,
            ],
            [-y / 1e-4, x / 1e-4, 0.0],
            unit,
            core::array::from_fn(|i| ([3.0, 2.0, 1.0][i] - rate * unit[i]) / range),
        ];
        for i in 0..4 {
            assert!((got.measurement[i] - expected[i]).abs() < 1e-12, "{i}");
            for k in 0..3 {
                let apart = got.by_position[i][k] - by_position[i][k];
                assert!(apart.abs() < 1e-9, "{i} {k}");
            }
        }
        // With a floor next to zero the range is exact.
        let exact = predict_beyond(1e-12, [x, y, z], [0.0; 3]).measurement[2];
        assert!((exact - (25e-6_f64 + 400.0).sqrt()).abs() < 1e-12);
    }

    /// The covariance by the Jacobian of the conversion, at a range that noise made negative as well.
    #[test]
    fn converted_errors_are_those_of_the_jacobian() {
        for range_m in [40.0_f32, -0.3] {
            let sensed = |value, sigma| Sensed { value, sigma };
            let got = converted(sensed(range_m, 0.5), sensed(0.5, 0.01), sensed(2.0, 0.02));
            let at = |r: f64, e: f64, a: f64| Vector3::from(position(r, e, a));
            let (r, h) = (f64::from(range_m), 1e-5);
            let by = [
                (at(r + h, 0.5, 2.0) - at(r - h, 0.5, 2.0)) * (0.5 / (2.0 * h)),
                (at(r, 0.5 + h, 2.0) - at(r, 0.5 - h, 2.0)) * (0.01 / (2.0 * h)),
                (at(r, 0.5, 2.0 + h) - at(r, 0.5, 2.0 - h)) * (0.02 / (2.0 * h)),
            ];
            let expected: Matrix3<f64> = by.iter().map(|v| v * v.transpose()).sum();
            let apart = got.covariance().map(f64::from) - expected;
            assert!(apart.amax() < 1e-6 * expected.amax(), "{range_m}: {apart}");
            assert!((got.position.map(f64::from) - at(r, 0.5, 2.0)).amax() < 1e-5);
            assert!(got.sigmas_m.iter().all(|sigma| *sigma > 0.0));
        }
    }
}
