//! A target that hovers, the shipped blobs, and what every estimate of it has to be.

// Every test uses a part of it.
#![allow(dead_code)]

use bnkf::blob::Blob;
use bnkf::{Estimate, Measurement, Sensed, Sensor, Settings, Tracker};
use nalgebra::SMatrix;

/// The default model.
pub const RECURSIVE: &[u8] = include_bytes!("../../models/recursive.bnkf");
pub const COUNTER_UAS: &[u8] = include_bytes!("../../models/recursive-counter-uas.bnkf");
pub const BNKF: &[u8] = include_bytes!("../../models/bnkf.bnkf");
pub const BNKFE: &[u8] = include_bytes!("../../models/bnkfe.bnkf");
pub const EVERY: [&[u8]; 4] = [RECURSIVE, COUNTER_UAS, BNKF, BNKFE];

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

/// Finite, symmetric, and positive definite for single and double precision.
pub fn assert_sound(estimate: &Estimate) {
    assert!(estimate.position_m.iter().all(|x| x.is_finite()));
    assert!(estimate.nis.is_finite() && estimate.nis >= 0.0);
    let block = SMatrix::<f32, 3, 3>::from_fn(|i, j| estimate.covariance_m2[i][j]);
    assert!(
        block == block.transpose() && block.cholesky().is_some(),
        "{block}"
    );
    assert!(block.map(f64::from).cholesky().is_some(), "{block}");
    if let Some(motion) = &estimate.motion {
        let full = SMatrix::<f32, 9, 9>::from_fn(|i, j| motion.covariance[i][j]);
        assert!(
            full == full.transpose() && full.cholesky().is_some(),
            "{full}"
        );
        assert!(full.map(f64::from).cholesky().is_some(), "{full}");
        let vectors = motion.velocity_mps.iter().chain(&motion.acceleration_mps2);
        assert!(vectors.into_iter().all(|x| x.is_finite()));
    }
}

/// From the truth, m.
pub fn distance(estimate: &Estimate, truth: [f32; 3]) -> f32 {
    (0..3)
        .map(|i| (estimate.position_m[i] - truth[i]).powi(2))
        .sum::<f32>()
        .sqrt()
}

/// Root of the trace of the covariance of the position, m.
pub fn sigma(estimate: &Estimate) -> f32 {
    (0..3)
        .map(|i| estimate.covariance_m2[i][i])
        .sum::<f32>()
        .sqrt()
}
