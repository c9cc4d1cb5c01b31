//! What a set of flights looks like: extent, speeds, accelerations.

use crate::flights::flight::{Flight, length};

/// Mean and limits of one quantity over every sample of a set of flights.
#[derive(Clone, Copy, Debug, PartialEq)]
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightStatistics {
    /// Number of flights.
    pub flights: usize,
    /// Number of samples.
    pub samples: usize,
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
    pub fn of(flights: &[Flight]) -> Option<Self> {
        let samples = || flights.iter().flat_map(|flight| &flight.samples);
        let pairs = || flights.iter().flat_map(|flight| flight.samples.windows(2));
        Some(Self {
            flights: flights.len(),
            samples: samples().count(),
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
