//! What a set of flights looks like: extent, speeds, accelerations.

use crate::flights::flight::{Flight, length};
use serde::Serialize;

/// Mean and limits of one quantity over every sample of a set of flights.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Lowest.
    pub min: f64,
    /// Arithmetic mean.
    pub mean: f64,
    /// Standard deviation (of the population).
    pub sd: f64,
    /// Highest.
    pub max: f64,
}

/// Statistics of a set of flights; radar at the origin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FlightStatistics {
    /// Number of flights.
    pub flights: usize,
    /// Number of samples.
    pub samples: usize,
    /// Duration of a flight, seconds.
    pub duration_s: Spread,
    /// Range to the radar, metres.
    pub range_m: Spread,
    /// Height, metres.
    pub height_m: Spread,
    /// Speed, metres per second.
    pub speed_mps: Spread,
    /// Magnitude of the acceleration: differences of neighbouring velocities, m/s^2.
    pub acceleration_mps2: Spread,
}

impl FlightStatistics {
    /// Statistics of `flights`; `None` when there are none, or none with two samples.
    #[must_use]
    pub fn of(flights: &[Flight]) -> Option<Self> {
        let samples = || flights.iter().flat_map(|flight| &flight.samples);
        let pairs = || flights.iter().flat_map(|flight| flight.samples.windows(2));
        Some(Self {
            flights: flights.len(),
            samples: samples().count(),
            duration_s: Spread::of(flights.iter().map(Flight::duration_s))?,
            range_m: Spread::of(samples().map(|sample| length(sample.position_m)))?,
            height_m: Spread::of(samples().map(|sample| sample.position_m[2]))?,
            speed_mps: Spread::of(samples().map(|sample| length(sample.velocity_mps)))?,
            acceleration_mps2: Spread::of(pairs().map(|pair| {
                let step_s = pair[1].time_s - pair[0].time_s;
                let change = std::array::from_fn(|axis| {
                    pair[1].velocity_mps[axis] - pair[0].velocity_mps[axis]
                });
                length(change) / step_s
            }))?,
        })
    }
}

impl Spread {
    /// Spread of `values`; `None` when there are none.
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> Option<Self> {
        let count = values.clone().count() as f64;
        if count == 0.0 {
            return None;
        }
        let mean = values.clone().sum::<f64>() / count;
        // Two passes: a sum of squares would cancel for values far from zero.
        let variance = values.clone().map(|v| (v - mean) * (v - mean)).sum::<f64>() / count;
        Some(Self {
            min: values.clone().fold(f64::INFINITY, f64::min),
            mean,
            sd: variance.sqrt(),
            max: values.fold(f64::NEG_INFINITY, f64::max),
        })
    }
}

impl std::fmt::Display for FlightStatistics {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (range, height) = (&self.range_m, &self.height_m);
        write!(
            f,
            "{} flights, {} samples, {:.1} s each; range {:.1} to {:.1} m (mean {:.1}, sd {:.1}); \
             height {:.1} to {:.1} m; speed mean {:.1}, max {:.1} m/s; \
             acceleration mean {:.1}, max {:.1} m/s^2",
            self.flights,
            self.samples,
            self.duration_s.mean,
            range.min,
            range.max,
            range.mean,
            range.sd,
            height.min,
            height.max,
            self.speed_mps.mean,
            self.speed_mps.max,
            self.acceleration_mps2.mean,
            self.acceleration_mps2.max,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::{FlightStatistics, Spread};
    use crate::flights::flight::Flight;

    #[test]
    fn a_known_flight_has_known_statistics() {
        // x = 3 + t^2 at 0, 1, 2 s: speeds 1, 2, 3; accelerations 1, 1.
        let rows = [
            [5.0, 3.0, 0.0, 4.0],
            [6.0, 4.0, 0.0, 4.0],
            [7.0, 7.0, 0.0, 4.0],
        ];
        let flight = Flight::from_track("f", "f", &rows).unwrap();
        let stats = FlightStatistics::of(&[flight]).unwrap();
        assert_eq!((stats.flights, stats.samples), (1, 3));
        assert_eq!(stats.duration_s.mean, 2.0);
        assert_eq!(stats.range_m.min, 5.0);
        assert!((stats.range_m.max - 65.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!((stats.height_m.min, stats.height_m.max), (4.0, 4.0));
        assert_eq!((stats.speed_mps.mean, stats.speed_mps.max), (2.0, 3.0));
        assert!((stats.speed_mps.sd - (2.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!(stats.acceleration_mps2.max, 1.0);
        assert!(
            stats
                .to_string()
                .starts_with("1 flights, 3 samples, 2.0 s each; range 5.0 to 8.1")
        );
    }

    #[test]
    fn nothing_has_no_statistics() {
        assert_eq!(FlightStatistics::of(&[]), None);
        assert_eq!(Spread::of(std::iter::empty()), None);
    }
}
