//! The state after the first measurement, fused with what is known of the population.

use super::population::Population;
use super::state::{Covariance, State};
use crate::ekf::NOISE_MIN_PART;
use crate::measurement::Vectors;
use crate::radar::{axes, position};
use crate::scalar::Scalar;

/// Squared deviations from the population up to which its prior is believed.
const SURPRISE_MAX: f64 = 9.0;
/// Squared deviations from the population at which a target is likelier elsewhere: a normal density is 3e-4 of its
/// peak there, one target in three thousand.
const ELSEWHERE: f64 = 16.0;
/// Largest half-spread of an angle's sigma points, rad: beyond it they would come round again.
const ANGLE_SPREAD_MAX_RAD: f64 = core::f64::consts::FRAC_PI_2;
/// Least variance of a position component, m^2.
const POSITION_VARIANCE_MIN_M2: f64 = 1e-8;

/// The state after a first measurement, which holds an azimuth.
///
/// The position is [`place`]'s; the range-rate then corrects the velocity along the line of
/// sight. The population is a prior with heavy tails: a measurement further than three deviations
/// from it widens it, so that a target anywhere, at any speed, is believed.
pub fn start<S: Scalar>(
    vectors: &Vectors<S>,
    population: &Population<S>,
) -> (State<S>, Covariance<S>) {
    let c = S::constant;
    let (p, measured, sigmas) = (population, &vectors.measured, &vectors.sigmas);
    let (mean, variances) = place(vectors, population);
    let (elevation, _) = elevation(vectors, population);
    let mut covariance = [[c(0.0); 9]; 9];
    // The line of sight is what was measured: the mean of a blunt direction may be anywhere.
    let unit = position(c(1.0), elevation, measured[1]);
    let level = p.horizontal_sigma_mps * p.horizontal_sigma_mps;
    let vertical = p.vertical_sigma_mps * p.vertical_sigma_mps;
    let along = (unit[0] * unit[0] + unit[1] * unit[1]) * level + unit[2] * unit[2] * vertical;
    let noise = sigmas[3] * sigmas[3];
    let surprise = measured[3] * measured[3] / (along + noise);
    let widen = (surprise / c(SURPRISE_MAX)).max(c(1.0));
    let speed_variances = [level * widen, level * widen, vertical * widen];
    let mut state = [c(0.0); 9];
    let gained: [S; 3] = core::array::from_fn(|axis| unit[axis] * speed_variances[axis]);
    let noise = noise.max(c(NOISE_MIN_PART) * along * widen);
    let weight = vectors.present[3] / (along * widen + noise);
    for row in 0..3 {
        state[row] = mean[row];
        state[3 + row] = gained[row] * weight * measured[3];
        for column in 0..3 {
            let gain = weight * (gained[row] * gained[column]);
            covariance[3 + row][3 + column] = -gain;
            covariance[row][column] = variances[row][column];
        }
        covariance[3 + row][3 + row] = covariance[3 + row][3 + row] + speed_variances[row];
        covariance[6 + row][6 + row] = p.acceleration_sigma_mps2 * p.acceleration_sigma_mps2;
    }
    (state, covariance)
}

/// Position and its covariance, m, m^2, of a measurement that holds an azimuth and of the population.
///
/// Range and elevation are fused with the population in spherical coordinates, or are the
/// population's where they were not measured; sigma points (Julier and Uhlmann 1997, kappa = 0)
/// carry the result to Cartesian ones.
// Its points are off the stack before anything else is made of the measurement.
#[inline(never)]
pub fn place<S: Scalar>(vectors: &Vectors<S>, population: &Population<S>) -> ([S; 3], [[S; 3]; 3]) {
    let c = S::constant;
    let (p, measured, sigmas) = (population, &vectors.measured, &vectors.sigmas);
    let (elevation, elevation_variance) = elevation(vectors, population);
    let (range, range_variance) = fuse(
        (p.range_m, p.range_sigma_m),
        (measured[2], sigmas[2]),
        vectors.present[2],
    );
    let centre = [elevation, measured[1], range];
    // Two points each way for three quantities: the root of three deviations.
    let angle = |spread: S| spread.min(c(ANGLE_SPREAD_MAX_RAD));
    let spread = [
        angle((c(3.0) * elevation_variance).sqrt()),
        angle(c(3.0).sqrt() * sigmas[1]),
        (c(3.0) * range_variance).sqrt(),
    ];
    let points: [[S; 3]; 6] = core::array::from_fn(|i| {
        let mut spherical = centre;
        let sign = c(if i % 2 == 0 { 1.0 } else { -1.0 });
        spherical[i / 2] = spherical[i / 2] + sign * spread[i / 2];
        position(spherical[2], spherical[0], spherical[1])
    });
    let mut mean = [c(0.0); 3];
    for point in &points {
        mean = core::array::from_fn(|axis| mean[axis] + point[axis] / c(6.0));
    }
    let mut covariance = [[c(0.0); 3]; 3];
    for point in &points {
        for row in 0..3 {
            for column in 0..3 {
                covariance[row][column] = covariance[row][column]
                    + (point[row] - mean[row]) * (point[column] - mean[column]) / c(6.0);
            }
        }
    }
    for (axis, row) in covariance.iter_mut().enumerate() {
        row[axis] = row[axis] + c(POSITION_VARIANCE_MIN_M2);
    }
    (mean, covariance)
}

/// What a sensor at rest would have measured in place of one with this velocity (m/s): its own motion
/// along the line of sight comes off the range-rate, and what it is unsure of because the direction is
/// goes to its noise, at most the speed itself.
pub fn at_rest<S: Scalar>(
    vectors: &Vectors<S>,
    velocity_mps: [S; 3],
    population: &Population<S>,
) -> Vectors<S> {
    let [vx, vy, vz] = velocity_mps;
    let (elevation, elevation_variance) = elevation(vectors, population);
    let along = |axis: [S; 3]| axis[0] * vx + axis[1] * vy + axis[2] * vz;
    let [radial, upward, lateral] = axes(elevation, vectors.measured[1]).map(along);
    let sideways = vectors.sigmas[1] * elevation.cos() * lateral;
    let unsure = elevation_variance * upward * upward + sideways * sideways;
    let unsure = unsure.min(vx * vx + vy * vy + vz * vz);
    let mut still = *vectors;
    still.measured[3] = vectors.measured[3] + vectors.present[3] * radial;
    still.sigmas[3] = (vectors.sigmas[3] * vectors.sigmas[3] + unsure).sqrt();
    still
}

/// Mean (rad) and variance of the elevation that a track starts at.
pub fn elevation<S: Scalar>(vectors: &Vectors<S>, population: &Population<S>) -> (S, S) {
    fuse(
        (population.elevation_rad, population.elevation_sigma_rad),
        (vectors.measured[0], vectors.sigmas[0]),
        vectors.present[0],
    )
}

/// Mean and variance of the product of a prior and, if present, a measurement, both Gaussians given
/// by mean and standard deviation. Beyond [`SURPRISE_MAX`] the prior widens with the square of the
/// surprise, and soon says nothing; beyond [`ELSEWHERE`], where a blunt measurement is hardly of the population any
/// more, until it is two deviations away.
fn fuse<S: Scalar>(prior: (S, S), measured: (S, S), present: S) -> (S, S) {
    let measured_variance = measured.1 * measured.1;
    let apart = measured.0 - prior.0;
    let surprise = present * apart * apart / (prior.1 * prior.1 + measured_variance);
    let widen = (surprise / S::constant(SURPRISE_MAX)).max(S::constant(1.0));
    let elsewhere = (surprise - S::constant(ELSEWHERE)).step();
    let explained = S::constant(0.25) * apart * apart - measured_variance;
    let prior_variance = (prior.1 * prior.1 * widen * widen).max(elsewhere * explained);
    let weight = present * prior_variance / (prior_variance + measured_variance);
    let left = S::constant(1.0) - present;
    (
        prior.0 + weight * apart,
        measured_variance * weight + left * prior_variance,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Vector3};

    #[test]
    fn a_sharp_measurement_is_believed() {
        let vectors = Vectors::whole([0.4, -2.0, 30.0, 1.2], [1e-4, 1e-4, 0.01, 1e-3]);
        let (state, _) = start(&vectors, &Population::PAPER);
        let expected = [
            30.0 * 0.4_f64.cos() * 2.0_f64.cos(),
            -30.0 * 0.4_f64.cos() * 2.0_f64.sin(),
            30.0 * 0.4_f64.sin(),
        ];
        let mut rate = 0.0;
        for axis in 0..3 {
            assert!((state[axis] - expected[axis]).abs() < 1e-3);
            rate += expected[axis] / 30.0 * state[3 + axis];
        }
        assert!((rate - 1.2).abs() < 1e-3);
    }

    #[test]
    fn a_blunt_measurement_leaves_the_population() {
        let vectors = Vectors::whole([0.9, 0.0, 90.0, 0.0], [1.0, 1e-3, 1e5, 100.0]);
        let (state, covariance) = start(&vectors, &Population::PAPER);
        let range = state[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
        // Elevation spread shortens the mean vector a little.
        assert!((range - 33.5).abs() < 1.0, "{range}");
        assert!((covariance[3][3] - 1.6 * 1.6).abs() < 1e-2);
    }

    /// A direction far from the population's is believed, at any noise.
    #[test]
    fn the_population_is_no_clamp() {
        for elevation in [-1.5, -1.4, -0.8, -0.3, 0.0, 0.8, 1.4, 1.55] {
            for (sigma, range_sigma) in [(0.005, 0.1), (0.01, 10.0), (0.1, 100.0)] {
                let vectors = Vectors::whole(
                    [elevation, 2.0, 33.0, 0.0],
                    [sigma, sigma, range_sigma, 0.05],
                );
                let (state, covariance) = start(&vectors, &Population::PAPER);
                let truth = position(33.0_f64, elevation, 2.0);
                let block = core::array::from_fn(|i| core::array::from_fn(|j| covariance[i][j]));
                let factor = crate::cholesky::cholesky::<f64, 3>(&block);
                let error = core::array::from_fn(|i| state[i] - truth[i]);
                let whitened = crate::cholesky::forward_substitute(&factor, error);
                let nees: f64 = whitened.iter().map(|w| w * w).sum();
                assert!(nees < 9.0, "{elevation} {sigma}: {nees}");
            }
        }
    }

    #[test]
    fn a_range_far_from_the_population_is_believed() {
        for range in [0.0, 0.5, 5.0, 90.0, 900.0] {
            let vectors = Vectors::whole([0.4, 0.0, range, 0.0], [1e-3, 1e-3, 0.1, 0.05]);
            let (state, _) = start(&vectors, &Population::PAPER);
            let got = state[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!((got - range).abs() < 0.05, "{range} {got}");
        }
    }

    /// Blunt, but too far away to be of the population: what is said of it is honest.
    #[test]
    fn a_blunt_range_far_from_the_population_is_believed() {
        for (range, sigma) in [(500.0, 100.0), (900.0, 100.0), (2000.0, 300.0)] {
            let vectors = Vectors::whole([0.4, 0.0, range, 0.0], [1e-3, 1e-3, sigma, 0.05]);
            let (state, covariance) = start(&vectors, &Population::PAPER);
            let got = state[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
            let deviation = (0..3).map(|i| covariance[i][i]).sum::<f64>().sqrt();
            assert!((got - range).abs() < 3.0 * deviation, "{got} {deviation}");
            assert!(deviation < sigma);
        }
    }

    /// 30 m/s along the line of sight: the velocity across may be as large.
    #[test]
    fn a_speed_far_from_the_population_is_believed() {
        let vectors = Vectors::whole([0.1, 0.0, 33.0, 30.0], [1e-3, 1e-3, 0.1, 0.05]);
        let (state, covariance) = start(&vectors, &Population::PAPER);
        assert!((state[3] - 30.0).abs() < 0.5, "{state:?}");
        assert!(covariance[4][4].sqrt() > 8.0);
        let slow = Vectors::whole([0.1, 0.0, 33.0, 1.0], [1e-3, 1e-3, 0.1, 0.05]);
        let (_, covariance) = start(&slow, &Population::PAPER);
        assert!((covariance[4][4].sqrt() - 1.6).abs() < 1e-9);
    }

    /// Targets of the population itself, seen from a vehicle at 20 m/s: NEES of position and velocity
    /// are 3 as for a radar at rest. 4000 draws: a standard error of sqrt(6 / 4000) = 0.04; the
    /// Gaussian stands for a bent region.
    #[test]
    fn a_start_from_a_moving_sensor_is_honest() {
        let p = Population::PAPER;
        let mut rng = crate::rng::seeded(3);
        let mut normal = || f64::from(crate::gaussian::standard_normal(&mut rng));
        for (sigmas, own) in [
            ([0.01, 0.01, 10.0, 0.1], [0.0; 3]),
            ([0.01, 0.01, 10.0, 0.1], [14.0, -14.0, 3.0]),
            ([0.1, 0.1, 100.0, 1.0], [14.0, -14.0, 3.0]),
            ([0.001, 0.001, 1.0, 0.01], [0.0, 20.0, 0.0]),
        ] {
            let mut nees = [0.0; 2];
            let draws = 4000;
            for _ in 0..draws {
                let target = position(
                    p.range_m + p.range_sigma_m * normal(),
                    p.elevation_rad + p.elevation_sigma_rad * normal(),
                    2.0 * normal(),
                );
                let velocity = [
                    p.horizontal_sigma_mps * normal(),
                    p.horizontal_sigma_mps * normal(),
                    p.vertical_sigma_mps * normal(),
                ];
                let relative = core::array::from_fn(|i| velocity[i] - own[i]);
                let mut measured = crate::radar::predict(target, relative).measurement;
                for (value, sigma) in measured.iter_mut().zip(sigmas) {
                    *value += sigma * normal();
                }
                let vectors = Vectors::whole(measured, sigmas);
                let (state, covariance) = start(&at_rest(&vectors, own, &p), &p);
                for (half, truth) in [target, velocity].into_iter().enumerate() {
                    let block = core::array::from_fn(|i| {
                        core::array::from_fn(|j| covariance[3 * half + i][3 * half + j])
                    });
                    let factor = crate::cholesky::cholesky::<f64, 3>(&block);
                    let error = core::array::from_fn(|i| state[3 * half + i] - truth[i]);
                    let whitened = crate::cholesky::forward_substitute(&factor, error);
                    nees[half] += whitened.iter().map(|w| w * w).sum::<f64>() / f64::from(draws);
                }
            }
            assert!(
                nees.iter().all(|n| (n - 3.0).abs() < 0.3),
                "{own:?} {nees:?}"
            );
        }
    }

    #[test]
    fn what_was_not_measured_is_the_population() {
        let mut vectors = Vectors::whole([0.0, 1.0, 0.0, 0.0], [1.0, 0.01, 1.0, 1.0]);
        vectors.present = [0.0, 1.0, 0.0, 0.0];
        let p = Population::PAPER;
        let (state, covariance) = start(&vectors, &p);
        let range = state[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!((range - p.range_m).abs() < 1.0, "{range}");
        let upward = (state[2] / range).asin();
        assert!((upward - p.elevation_rad).abs() < 0.02, "{upward}");
        let spread: f64 = (0..3).map(|i| covariance[i][i]).sum();
        let expected = p.range_sigma_m.powi(2) + (p.range_m * p.elevation_sigma_rad).powi(2);
        assert!((spread / expected - 1.0).abs() < 0.1, "{spread} {expected}");
        assert_eq!(state[3..6], [0.0; 3]);
        assert!((covariance[5][5] - 0.25).abs() < 1e-12);
    }

    /// Precision-weighted mean and its variance, the prior widened by a surprise.
    fn product(prior: (f64, f64), measured: Option<(f64, f64)>) -> (f64, f64) {
        let Some((value, sigma)) = measured else {
            return (prior.0, prior.1.powi(2));
        };
        let away = (value - prior.0).abs();
        let surprise = (away / prior.1.hypot(sigma)).powi(2);
        let mut widened = prior.1 * f64::max(1.0, surprise / 9.0);
        if surprise > 16.0 {
            // As wide as leaves it two deviations away.
            widened = widened.max((0.25 * away * away - sigma * sigma).sqrt());
        }
        let (a, b) = (widened.powi(-2), sigma.powi(-2));
        ((a * prior.0 + b * value) / (a + b), 1.0 / (a + b))
    }

    /// The whole start, written again with matrices: ordinary, surprising, blunt, exact and
    /// incomplete measurements.
    #[test]
    fn a_start_is_what_its_formulas_say() {
        let mut wide = Population::PAPER;
        wide.elevation_sigma_rad = 2.0;
        wide.acceleration_sigma_mps2 = 3.0;
        let all = [1.0; 4];
        let cases = [
            ([0.4, -2.0, 30.0, 1.2], [0.02, 0.03, 2.0, 0.4], all),
            ([-0.6, 2.5, 90.0, -14.0], [0.02, 0.03, 2.0, 0.4], all),
            ([0.9, 1.0, 25.0, 0.5], [0.9, 1.0, 9.0, 1e-4], all),
            ([0.9, 1.0, 500.0, 0.5], [0.1, 0.1, 100.0, 1.0], all),
            ([0.9, 1.0, 25.0, -9.0], [0.9, 1.0, 9.0, 1e-4], all),
            (
                [0.4, 1.0, 30.0, 0.7],
                [0.02, 0.03, 2.0, 0.4],
                [0.0, 1.0, 1.0, 1.0],
            ),
            (
                [0.4, 1.0, 30.0, 0.7],
                [0.02, 0.03, 2.0, 0.4],
                [1.0, 1.0, 0.0, 0.0],
            ),
        ];
        for (measured, sigmas, present) in cases {
            for p in [Population::PAPER, wide] {
                let vectors = Vectors {
                    measured,
                    sigmas,
                    present,
                };
                let (state, covariance) = start(&vectors, &p);
                let channel = |i: usize| (present[i] > 0.0).then_some((measured[i], sigmas[i]));
                let (elevation, elevation_variance) =
                    product((p.elevation_rad, p.elevation_sigma_rad), channel(0));
                let (range, range_variance) = product((p.range_m, p.range_sigma_m), channel(2));
                let limit = core::f64::consts::FRAC_PI_2;
                let reach = [
                    (3.0 * elevation_variance).sqrt().min(limit),
                    (3.0_f64.sqrt() * sigmas[1]).min(limit),
                    (3.0 * range_variance).sqrt(),
                ];
                let cartesian = |e: f64, a: f64, r: f64| {
                    Vector3::new(r * e.cos() * a.cos(), r * e.cos() * a.sin(), r * e.sin())
                };
                let mut points = std::vec::Vec::new();
                for (axis, reach) in reach.into_iter().enumerate() {
                    for away in [reach, -reach] {
                        let mut at = [elevation, measured[1], range];
                        at[axis] += away;
                        points.push(cartesian(at[0], at[1], at[2]));
                    }
                }
                let mean = points.iter().sum::<Vector3<f64>>() / 6.0;
                let mut place = Matrix3::identity() * 1e-8;
                for point in &points {
                    place += (point - mean) * (point - mean).transpose() / 6.0;
                }
                let unit = cartesian(elevation, measured[1], 1.0);
                let (level, upward) = (p.horizontal_sigma_mps, p.vertical_sigma_mps);
                let deviations = Vector3::new(level, level, upward);
                let mut motion = Matrix3::from_diagonal(&deviations.map(|s| s * s));
                let along = unit.dot(&(motion * unit));
                let surprise = measured[3].powi(2) / (along + sigmas[3].powi(2));
                let widen = f64::max(1.0, surprise / 9.0);
                motion *= widen;
                let noise = sigmas[3].powi(2).max(1e-5 * along * widen);
                let gain = motion * unit * (present[3] / (along * widen + noise));
                let velocity = gain * measured[3];
                motion -= gain * unit.transpose() * motion;
                for i in 0..3 {
                    assert!((state[i] - mean[i]).abs() < 1e-9, "{i}");
                    assert!((state[3 + i] - velocity[i]).abs() < 1e-9, "{i}");
                    assert_eq!(state[6 + i], 0.0);
                    for j in 0..3 {
                        let own = |block: usize| covariance[block + i][block + j];
                        assert!((own(0) - place[(i, j)]).abs() < 1e-9, "{i} {j}");
                        assert!((own(3) - motion[(i, j)]).abs() < 1e-9, "{i} {j}");
                        let variance = p.acceleration_sigma_mps2.powi(2);
                        let expected = if i == j { variance } else { 0.0 };
                        assert_eq!(own(6), expected);
                        for (row, column) in [(0, 3), (0, 6), (3, 6), (3, 0), (6, 0), (6, 3)] {
                            assert_eq!(covariance[row + i][column + j], 0.0);
                        }
                    }
                }
            }
        }
    }
}
