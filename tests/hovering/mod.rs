//! A target that hovers, and a tracker of it.

use bnkf::blob::Blob;
use bnkf::{Estimate, Measurement, Sensed, Sensor, Settings, Tracker};

/// The default model.
pub const RECURSIVE: &[u8] = include_bytes!("../../models/recursive.bnkf");

/// A tracker of a shipped blob, with four passes where the blob is run with passes.
pub fn tracker(bytes: &[u8]) -> Tracker<'_> {
    let blob = Blob::parse(bytes).expect("shipped blob");
    let mut settings = Settings::of(&blob);
    settings.inference = settings.inference.at_most(4);
    Tracker::new(blob, settings).expect("settings of the blob")
}

/// A channel.
pub fn sensed(value: f32, sigma: f32) -> Option<Sensed> {
    Some(Sensed { value, sigma })
}

/// A target that hovers 33 m away.
pub fn z(i: u64) -> Measurement {
    Measurement {
        time_us: i * 100_000,
        range: sensed(33.0, 0.1),
        elevation: sensed(0.4, 0.005),
        azimuth: sensed(0.5, 0.005),
        range_rate: sensed(0.0, 0.05),
        sensor: Sensor::ORIGIN,
    }
}

/// A measurement with something changed.
pub fn with(measurement: Measurement, mut change: impl FnMut(&mut Measurement)) -> Measurement {
    let mut changed = measurement;
    change(&mut changed);
    changed
}

/// From the truth, m.
pub fn distance(estimate: &Estimate, truth: [f32; 3]) -> f32 {
    (0..3)
        .map(|i| (estimate.position_m[i] - truth[i]).powi(2))
        .sum::<f32>()
        .sqrt()
}
