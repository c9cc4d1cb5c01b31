//! Where and how fast flights are, measured.

use bnkf::recursive::population::Population;

use crate::flights::flight::Flight;
use crate::radar::polar::Polar;

/// The population that `flights` are a sample of; `None` when there are none.
pub fn population_of(flights: &[Flight]) -> Option<Population<f64>> {
    let samples = || flights.iter().flat_map(|flight| &flight.samples);
    let range = moments(samples().map(|s| Polar::of(s.position_m, s.velocity_mps).range_m))?;
    let elevation =
        moments(samples().map(|s| Polar::of(s.position_m, s.velocity_mps).elevation_rad))?;
    let horizontal_range = moments(samples().map(|s| s.position_m[0].hypot(s.position_m[1])))?;
    let height = moments(samples().map(|s| s.position_m[2]))?;
    let pairs = || flights.iter().flat_map(|flight| flight.samples.windows(2));
    let root_mean_square = |mean_and_sigma: (f64, f64)| mean_and_sigma.0.hypot(mean_and_sigma.1);
    let horizontal = moments(samples().flat_map(|s| [s.velocity_mps[0], s.velocity_mps[1]]))?;
    let vertical = moments(samples().map(|s| s.velocity_mps[2]))?;
    let acceleration = moments(pairs().flat_map(|pair| {
        let dt_s = pair[1].time_s - pair[0].time_s;
        (0..3).map(move |i| (pair[1].velocity_mps[i] - pair[0].velocity_mps[i]) / dt_s)
    }))?;
    Some(Population {
        range_m: range.0,
        range_sigma_m: range.1,
        elevation_rad: elevation.0,
        elevation_sigma_rad: elevation.1,
        horizontal_sigma_mps: root_mean_square(horizontal),
        vertical_sigma_mps: root_mean_square(vertical),
        acceleration_sigma_mps2: root_mean_square(acceleration),
        horizontal_m: horizontal_range.0,
        horizontal_sigma_m: horizontal_range.1,
        height_m: height.0,
        height_sigma_m: height.1,
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_population_is_that_of_the_flights() {
        let rows: Vec<[f64; 4]> = (0..5)
            .map(f64::from)
            .map(|t| [t, 30.0, 2.0 * t * t, 0.0])
            .collect();
        let flight = Flight::from_track("f", "f", &rows).unwrap();
        let population = population_of(core::slice::from_ref(&flight)).unwrap();
        assert!((30.0..40.0).contains(&population.range_m));
        assert_eq!(population.elevation_sigma_rad, 0.0);
        assert_eq!(population.vertical_sigma_mps, 0.0);
        // 4 m/s^2 along y and the one-sided ends, nothing along x and z.
        assert!((1.5..2.5).contains(&population.acceleration_sigma_mps2));
        assert!(population_of(&[]).is_none());
    }
}
