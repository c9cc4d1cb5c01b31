//! The state after the first measurement, fused with what is known of the population.

use super::motion::{Covariance, State};
use super::population::Population;
use crate::radar::position;
use crate::scalar::Scalar;

/// The state after a first measurement (elevation, azimuth, range, range-rate) with these standard
/// deviations.
///
/// Range and elevation are fused with the population in spherical coordinates; seven sigma points
/// (Julier and Uhlmann 1997, kappa = 0) carry the result to Cartesian ones; the range-rate then
/// corrects the velocity along the line of sight.
pub fn start<S: Scalar>(
    measured: [S; 4],
    sigmas: [S; 4],
    population: &Population<S>,
) -> (State<S>, Covariance<S>) {
    let c = S::constant;
    let p = population;
    let (elevation, elevation_sigma) = fuse(
        (p.elevation_rad, p.elevation_sigma_rad),
        (measured[0], sigmas[0]),
    );
    let (range, range_sigma) = fuse((p.range_m, p.range_sigma_m), (measured[2], sigmas[2]));
    let centre = [elevation.clamp(-0.2, 1.4), measured[1], range];
    let spread = [elevation_sigma, sigmas[1], range_sigma];
    let points: [[S; 3]; 6] = core::array::from_fn(|i| {
        let mut spherical = centre;
        let sign = c(if i % 2 == 0 { 1.0 } else { -1.0 });
        spherical[i / 2] = spherical[i / 2] + sign * c(1.732_050_8) * spread[i / 2];
        position(spherical[2], spherical[0], spherical[1])
    });
    let sum = |values: &mut dyn Iterator<Item = S>| values.fold(c(0.0), |sum, x| sum + x);
    let mean: [S; 3] =
        core::array::from_fn(|axis| sum(&mut points.iter().map(|point| point[axis])) / c(6.0));
    let mut covariance = [[c(0.0); 9]; 9];
    for point in &points {
        for row in 0..3 {
            for column in 0..3 {
                covariance[row][column] = covariance[row][column]
                    + (point[row] - mean[row]) * (point[column] - mean[column]) / c(6.0);
            }
        }
    }
    let level = p.horizontal_sigma_mps * p.horizontal_sigma_mps;
    let speed_variances = [level, level, p.vertical_sigma_mps * p.vertical_sigma_mps];
    for axis in 0..3 {
        covariance[axis][axis] = covariance[axis][axis] + c(1e-8);
        covariance[3 + axis][3 + axis] = speed_variances[axis];
        covariance[6 + axis][6 + axis] = p.acceleration_sigma_mps2 * p.acceleration_sigma_mps2;
    }
    let mut state = [c(0.0); 9];
    // A range of zero has no direction; nothing is learned of the velocity there.
    let length = sum(&mut mean.iter().map(|&x| x * x)).sqrt().max(c(1e-20));
    let unit = mean.map(|x| x / length);
    let gained: [S; 3] = core::array::from_fn(|axis| unit[axis] * speed_variances[axis]);
    let total = sum(&mut (0..3).map(|axis| gained[axis] * unit[axis])) + sigmas[3] * sigmas[3];
    for row in 0..3 {
        state[row] = mean[row];
        state[3 + row] = gained[row] / total * measured[3];
        for column in 0..3 {
            covariance[3 + row][3 + column] =
                covariance[3 + row][3 + column] - gained[row] * gained[column] / total;
        }
    }
    (state, covariance)
}

/// Mean and standard deviation of the product of two Gaussians given likewise.
fn fuse<S: Scalar>(prior: (S, S), measured: (S, S)) -> (S, S) {
    let (prior_variance, measured_variance) = (prior.1 * prior.1, measured.1 * measured.1);
    let weight = prior_variance / (prior_variance + measured_variance);
    (
        prior.0 + weight * (measured.0 - prior.0),
        (measured_variance * weight).sqrt(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sharp_measurement_is_believed() {
        let (state, _) = start(
            [0.4, -2.0, 30.0, 1.2],
            [1e-4, 1e-4, 0.01, 1e-3],
            &Population::PAPER,
        );
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
        let (state, covariance) = start(
            [0.9, 0.0, 90.0, 0.0],
            [100.0, 1e-3, 1e5, 100.0],
            &Population::PAPER,
        );
        let range = state[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
        // Elevation spread shortens the mean vector a little.
        assert!((range - 33.5).abs() < 1.0, "{range}");
        assert!((covariance[3][3] - 1.6 * 1.6).abs() < 1e-2);
    }
}
