//! Tracks flights as `speed.py` wrote them, with nothing of Python: MODEL READINGS POSITIONS SAMPLES. Prints the seconds
//! that each flight took.

use std::error::Error;
use std::time::Instant;

use bnkf::{Measurement, Model, Sensed, Sensor, Settings, Tracker};

/// Time, four values and their sigmas.
const COLUMNS: usize = 9;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, readings, positions, samples] = arguments.as_slice() else {
        return Err("speed MODEL READINGS POSITIONS SAMPLES".into());
    };
    let blob = std::fs::read(model)?;
    let model = Model::new(&blob)?;
    let bytes = std::fs::read(readings)?;
    let numbers: Vec<f64> = bytes
        .as_chunks()
        .0
        .iter()
        .map(|number| f64::from_le_bytes(*number))
        .collect();
    let flight = samples.parse::<usize>()? * COLUMNS;
    let mut estimated = Vec::new();
    for flight in numbers.chunks_exact(flight) {
        let start = Instant::now();
        let mut tracker = Tracker::new(model, Settings::of(model.blob()))?;
        for row in flight.as_chunks::<COLUMNS>().0 {
            let time_us = row[0] as u64;
            let sensed = |i: usize| {
                (!row[i].is_nan()).then_some(Sensed {
                    value: row[i] as f32,
                    sigma: row[i + 4] as f32,
                })
            };
            let estimate = if row[1].is_nan() {
                tracker.coast(time_us)?
            } else {
                tracker.step(&Measurement {
                    time_us,
                    range: sensed(1),
                    elevation: sensed(2),
                    azimuth: sensed(3),
                    range_rate: sensed(4),
                    sensor: Sensor::ORIGIN,
                })?
            };
            estimated.extend(estimate.position_m);
        }
        println!("{}", start.elapsed().as_secs_f64());
    }
    let bytes: Vec<u8> = estimated.iter().flat_map(|x| x.to_le_bytes()).collect();
    Ok(std::fs::write(positions, bytes)?)
}
