//! The state after the first measurement, fused with what is known of the population.

use super::motion::{Covariance, State};
use super::population::Population;
use crate::Measurement;
use crate::kernel::sqrt;
use crate::radar::position;

/// Range and elevation are fused with the population in spherical coordinates; seven sigma points
/// (Julier and Uhlmann 1997, kappa = 0) carry the result to Cartesian ones; the range-rate then
/// corrects the velocity along the line of sight.
pub fn start(measurement: &Measurement, population: &Population) -> (State, Covariance) {
    let (p, sigmas) = (population, &measurement.sigmas);
    let (elevation, elevation_sigma) = fuse(
        (p.elevation_rad, p.elevation_sigma_rad),
        (measurement.elevation_rad, sigmas.elevation_rad),
    );
    let (range, range_sigma) = fuse(
        (p.range_m, p.range_sigma_m),
        (measurement.range_m, sigmas.range_m),
    );
    let centre = [elevation.clamp(-0.2, 1.4), measurement.azimuth_rad, range];
    let spread = [elevation_sigma, sigmas.azimuth_rad, range_sigma];
    let points: [[f32; 3]; 6] = core::array::from_fn(|i| {
        let mut spherical = centre;
        let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
        spherical[i / 2] += sign * 1.732_050_8 * spread[i / 2];
        position(spherical[2], spherical[0], spherical[1])
    });
    let mean: [f32; 3] =
        core::array::from_fn(|axis| points.iter().map(|point| point[axis]).sum::<f32>() / 6.0);
    let mut covariance = Covariance::zeros();
    for point in &points {
        for row in 0..3 {
            for column in 0..3 {
                covariance[(row, column)] +=
                    (point[row] - mean[row]) * (point[column] - mean[column]) / 6.0;
            }
        }
    }
    let level = p.horizontal_sigma_mps * p.horizontal_sigma_mps;
    let speed_variances = [level, level, p.vertical_sigma_mps * p.vertical_sigma_mps];
    for axis in 0..3 {
        covariance[(axis, axis)] += 1e-8;
        covariance[(3 + axis, 3 + axis)] = speed_variances[axis];
        covariance[(6 + axis, 6 + axis)] = p.acceleration_sigma_mps2 * p.acceleration_sigma_mps2;
    }
    let mut state = State::zeros();
    let length = sqrt(mean.iter().map(|x| x * x).sum());
    // Only a range of zero has no direction; any will do.
    let unit = if length > 0.0 {
        mean.map(|x| x / length)
    } else {
        [0.0, 0.0, 1.0]
    };
    let gained: [f32; 3] = core::array::from_fn(|axis| unit[axis] * speed_variances[axis]);
    let total = (0..3).map(|axis| gained[axis] * unit[axis]).sum::<f32>()
        + sigmas.range_rate_mps * sigmas.range_rate_mps;
    for row in 0..3 {
        state[row] = mean[row];
        state[3 + row] = gained[row] / total * measurement.range_rate_mps;
        for column in 0..3 {
            covariance[(3 + row, 3 + column)] -= gained[row] * gained[column] / total;
        }
    }
    (state, covariance)
}

/// Mean and standard deviation of the product of two Gaussians given likewise.
fn fuse(prior: (f32, f32), measured: (f32, f32)) -> (f32, f32) {
    let (prior_variance, measured_variance) = (prior.1 * prior.1, measured.1 * measured.1);
    let weight = prior_variance / (prior_variance + measured_variance);
    (
        prior.0 + weight * (measured.0 - prior.0),
        sqrt(measured_variance * weight),
    )
}
