//! The state after the first measurement, fused with what is known of the population.

use super::carry::{Carry, MEANS, MEASUREMENT, MEMORY, STATE};
use crate::flights::flight::Flight;
use crate::radar::sampling::Polar;

/// Where and how fast flights are, before any measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Population {
    /// Mean range, metres.
    pub range_m: f64,
    /// Standard deviation of the range, metres.
    pub range_sigma_m: f64,
    /// Mean elevation, radians.
    pub elevation_rad: f64,
    /// Standard deviation of the elevation, radians.
    pub elevation_sigma_rad: f64,
    /// Standard deviation of each horizontal velocity, m/s.
    pub horizontal_sigma_mps: f64,
    /// Standard deviation of the vertical velocity, m/s.
    pub vertical_sigma_mps: f64,
    /// Standard deviation of each acceleration, m/s^2.
    pub acceleration_sigma_mps2: f64,
}

impl Population {
    /// About that of flights in the paper's volume, for a tracker without training.
    pub const PAPER: Self = Self {
        range_m: 33.5,
        range_sigma_m: 6.0,
        elevation_rad: 0.5,
        elevation_sigma_rad: 0.21,
        horizontal_sigma_mps: 1.6,
        vertical_sigma_mps: 0.5,
        acceleration_sigma_mps2: 2.0,
    };

    /// The population that `flights` are a sample of; `None` when there are none.
    pub fn of(flights: &[Flight]) -> Option<Self> {
        let samples = || flights.iter().flat_map(|flight| &flight.samples);
        let range = moments(samples().map(|s| Polar::of(s.position_m, s.velocity_mps).range_m))?;
        let elevation =
            moments(samples().map(|s| Polar::of(s.position_m, s.velocity_mps).elevation_rad))?;
        let pairs = || flights.iter().flat_map(|flight| flight.samples.windows(2));
        let root_mean_square =
            |mean_and_sigma: (f64, f64)| mean_and_sigma.0.hypot(mean_and_sigma.1);
        let horizontal = moments(samples().flat_map(|s| [s.velocity_mps[0], s.velocity_mps[1]]))?;
        let vertical = moments(samples().map(|s| s.velocity_mps[2]))?;
        let acceleration = moments(pairs().flat_map(|pair| {
            let dt_s = pair[1].time_s - pair[0].time_s;
            (0..3).map(move |i| (pair[1].velocity_mps[i] - pair[0].velocity_mps[i]) / dt_s)
        }))?;
        Some(Self {
            range_m: range.0,
            range_sigma_m: range.1,
            elevation_rad: elevation.0,
            elevation_sigma_rad: elevation.1,
            horizontal_sigma_mps: root_mean_square(horizontal),
            vertical_sigma_mps: root_mean_square(vertical),
            acceleration_sigma_mps2: root_mean_square(acceleration),
        })
    }
}

/// Mean and standard deviation; `None` of nothing.
fn moments(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let (mut count, mut mean, mut squares) = (0.0, 0.0, 0.0);
    for value in values {
        count += 1.0;
        let step = value - mean;
        mean += step / count;
        squares += step * (value - mean);
    }
    (count > 0.0).then(|| (mean, f64::sqrt(squares / count)))
}

/// Starts a flight from its first measurement (elevation, azimuth, range, range-rate) and the
/// population.
///
/// Range and elevation are fused with the population in spherical coordinates; seven sigma points
/// (Julier and Uhlmann 1997, kappa = 0) carry the result to Cartesian ones; the range-rate then
/// corrects the velocity along the line of sight.
pub fn start(
    measurement: &[f64; MEASUREMENT],
    sigmas: &[f64; MEASUREMENT],
    population: &Population,
) -> Carry<f64> {
    let [elevation, azimuth, range, range_rate] = *measurement;
    let p = population;
    let (elevation, elevation_sigma) = fuse(
        (p.elevation_rad, p.elevation_sigma_rad),
        (elevation, sigmas[0]),
    );
    let (range, range_sigma) = fuse((p.range_m, p.range_sigma_m), (range, sigmas[2]));
    let centre = [elevation.clamp(-0.2, 1.4), azimuth, range];
    let spread = [elevation_sigma, sigmas[1], range_sigma];
    let mut mean = [0.0; 3];
    let mut points = [[0.0; 3]; 6];
    for (i, point) in points.iter_mut().enumerate() {
        let mut spherical = centre;
        let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
        spherical[i / 2] += sign * 3.0_f64.sqrt() * spread[i / 2];
        let [elevation, azimuth, range] = spherical;
        *point = [
            range * elevation.cos() * azimuth.cos(),
            range * elevation.cos() * azimuth.sin(),
            range * elevation.sin(),
        ];
        for axis in 0..3 {
            mean[axis] += point[axis] / 6.0;
        }
    }
    let mut covariance = [[0.0; STATE]; STATE];
    for point in &points {
        for row in 0..3 {
            for column in 0..3 {
                covariance[row][column] +=
                    (point[row] - mean[row]) * (point[column] - mean[column]) / 6.0;
            }
        }
    }
    for axis in 0..3 {
        let speed_sigma = if axis < 2 {
            p.horizontal_sigma_mps
        } else {
            p.vertical_sigma_mps
        };
        covariance[axis][axis] += 1e-8;
        covariance[3 + axis][3 + axis] = speed_sigma * speed_sigma;
        covariance[6 + axis][6 + axis] = p.acceleration_sigma_mps2 * p.acceleration_sigma_mps2;
    }
    let mut state = [0.0; STATE];
    state[..3].copy_from_slice(&mean);
    let length = mean.iter().map(|x| x * x).sum::<f64>().sqrt();
    let unit = mean.map(|x| x / length);
    let gained: [f64; 3] = core::array::from_fn(|axis| unit[axis] * covariance[3 + axis][3 + axis]);
    let total = (0..3).map(|axis| gained[axis] * unit[axis]).sum::<f64>() + sigmas[3] * sigmas[3];
    for row in 0..3 {
        state[3 + row] = gained[row] / total * range_rate;
        for column in 0..3 {
            covariance[3 + row][3 + column] -= gained[row] * gained[column] / total;
        }
    }
    let velocity = [state[3], state[4], state[5]];
    Carry {
        state,
        covariance,
        innovation: [0.0; MEASUREMENT],
        drift: [0.0; MEASUREMENT],
        squares: [1.0; MEASUREMENT],
        ln_sigmas: sigmas.map(f64::ln),
        coast_s: 0.0,
        age_s: 0.0,
        velocity_means: [velocity; MEANS],
        memory: [0.0; MEMORY],
    }
}

/// Mean and standard deviation of the product of two Gaussians given likewise.
fn fuse(prior: (f64, f64), measured: (f64, f64)) -> (f64, f64) {
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
        let carry = start(
            &[0.4, -2.0, 30.0, 1.2],
            &[1e-4, 1e-4, 0.01, 1e-3],
            &Population::PAPER,
        );
        let expected = [
            30.0 * 0.4_f64.cos() * 2.0_f64.cos(),
            -30.0 * 0.4_f64.cos() * 2.0_f64.sin(),
            30.0 * 0.4_f64.sin(),
        ];
        let mut rate = 0.0;
        for axis in 0..3 {
            assert!((carry.state[axis] - expected[axis]).abs() < 1e-3);
            rate += expected[axis] / 30.0 * carry.state[3 + axis];
        }
        assert!((rate - 1.2).abs() < 1e-3);
    }

    #[test]
    fn the_population_is_that_of_the_flights() {
        let rows: Vec<[f64; 4]> = (0..5)
            .map(f64::from)
            .map(|t| [t, 30.0, 2.0 * t * t, 0.0])
            .collect();
        let flight = Flight::from_track("f", "f", &rows).unwrap();
        let population = Population::of(core::slice::from_ref(&flight)).unwrap();
        assert!((30.0..40.0).contains(&population.range_m));
        assert_eq!(population.elevation_sigma_rad, 0.0);
        assert_eq!(population.vertical_sigma_mps, 0.0);
        // 4 m/s^2 along y and the one-sided ends, nothing along x and z.
        assert!((1.5..2.5).contains(&population.acceleration_sigma_mps2));
        assert!(Population::of(&[]).is_none());
    }

    #[test]
    fn a_blunt_measurement_leaves_the_population() {
        let carry = start(
            &[0.9, 0.0, 90.0, 0.0],
            &[100.0, 1e-3, 1e5, 100.0],
            &Population::PAPER,
        );
        let range = carry.state[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
        // Elevation spread shortens the mean vector a little.
        assert!((range - 33.5).abs() < 1.0, "{range}");
        assert!((carry.covariance[3][3] - 1.6 * 1.6).abs() < 1e-2);
    }
}
