//! One flight as the recursive tracker meets it: a start, then arrivals with the truth beside them.

use super::carry::Carry;
use super::step::Arrival;
use crate::flights::flight::Sample;
use crate::radar::reading::Reading;
use bnkf::recursive::population::Population;

/// What the tracker gets, step by step, and where the drone really was.
#[derive(Clone, Debug)]
pub struct Encounter {
    /// The state after the first measurement.
    pub start: Carry<f64>,
    /// Every later step.
    pub arrivals: Vec<Arrival<f64>>,
    /// True position at every later step, metres.
    pub truths_m: Vec<[f64; 3]>,
}

impl Encounter {
    /// Pairs the samples of a flight with what the radar reads at each of them (`None` in a gap).
    /// `None` when there is no first reading to start from.
    pub fn new(
        samples: &[Sample],
        readings: &[Option<Reading>],
        population: &Population<f64>,
    ) -> Option<Self> {
        let first = readings.first()?.as_ref()?.vectors();
        let mut vectors = first;
        let mut arrivals = Vec::with_capacity(samples.len());
        for (pair, reading) in samples.windows(2).zip(&readings[1..]) {
            // In a gap anything finite does.
            if let Some(reading) = reading {
                vectors = reading.vectors();
            }
            arrivals.push(Arrival {
                dt_s: pair[1].time_s - pair[0].time_s,
                measured: f64::from(u8::from(reading.is_some())),
                vectors,
            });
        }
        Some(Self {
            start: Carry::start(&first, population),
            arrivals,
            truths_m: samples[1..]
                .iter()
                .map(|sample| sample.position_m)
                .collect(),
        })
    }
}
