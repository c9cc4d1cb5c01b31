//! What is asked of trackers about the times ahead, and the truth there.

use crate::flights::flight::Flight;
use crate::radar::sampling::time_us;

/// How far ahead forecasts are scored, microseconds.
pub const HORIZONS_US: [u64; 3] = [500_000, 1_000_000, 2_000_000];
/// Every so many samples a tracker is asked: what it says of two seconds changes little in half a
/// one, and asking at each would double the time of an evaluation.
pub const EVERY: usize = 5;

/// The times ahead of a sample of a flight.
#[derive(Clone, Debug)]
pub struct Ahead {
    /// Those of all horizons, microseconds.
    pub times_us: [u64; HORIZONS_US.len()],
    /// True positions at those that lie inside the flight, the first ones, m.
    pub truths_m: Vec<[f64; 3]>,
}

impl Ahead {
    /// What is asked after sample `number`; nothing after most, nor where the flight ends before the first
    /// horizon. The truth is the flight's, interpolated.
    pub fn of(flight: &Flight, number: usize) -> Option<Self> {
        let (sample, last) = (flight.samples.get(number)?, flight.samples.last()?);
        let now_us = time_us(flight, sample.time_s);
        let last_us = time_us(flight, last.time_s);
        let times_us = HORIZONS_US.map(|ahead_us| now_us + ahead_us);
        if !number.is_multiple_of(EVERY) || times_us[0] > last_us {
            return None;
        }
        let inside = HORIZONS_US.iter().zip(&times_us);
        let inside = inside.take_while(|&(_, &there_us)| there_us <= last_us);
        let truth = |(&ahead_us, _): (&u64, &u64)| {
            let time_s = sample.time_s + 1e-6 * ahead_us as f64;
            flight.at(time_s).position_m
        };
        Some(Self {
            times_us,
            truths_m: inside.map(truth).collect(),
        })
    }
}
