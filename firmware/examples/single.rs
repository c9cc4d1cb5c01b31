//! One target, one radar that misses it now and then: step where there is a measurement, coast where there is none.

use std::error::Error;

use bnkf::{Estimate, Measurement, Mode, Model, Sensed, Sensor, Settings, Tracker};

static BLOB: &[u8] = include_bytes!("../models/recursive.bnkf");

/// What a radar says of a target that passes 40 m to the east at 5 m/s; every sixth time nothing.
fn radar(tenth: u64) -> Option<Measurement> {
    let (x, y) = (40.0_f32, 0.5 * tenth as f32 - 10.0);
    let range = x.hypot(y);
    let sensed = |value, sigma| Some(Sensed { value, sigma });
    (tenth % 6 != 5).then_some(Measurement {
        time_us: 100_000 * tenth,
        range: sensed(range, 0.5),
        elevation: sensed(0.1, 0.01),
        azimuth: sensed(y.atan2(x), 0.01),
        range_rate: sensed(5.0 * y / range, 0.1),
        sensor: Sensor::ORIGIN,
    })
}

fn track() -> Result<Vec<Estimate>, Box<dyn Error>> {
    let model = Model::new(BLOB)?;
    let mut tracker = Tracker::new(model, Settings::of(model.blob()))?;
    let mut estimates = Vec::new();
    for tenth in 0..40 {
        let estimate = match radar(tenth) {
            Some(measurement) => tracker.step(&measurement)?,
            None => tracker.coast(100_000 * tenth)?,
        };
        if estimate.mode == Mode::Rejected {
            println!("{} us: that was not the target", estimate.time_us);
        }
        estimates.push(estimate);
    }
    Ok(estimates)
}

fn main() -> Result<(), Box<dyn Error>> {
    for estimate in track()? {
        let [x, y, z] = estimate.position_m;
        let sigma = estimate.covariance_m2[1][1].sqrt();
        let mode = estimate.mode;
        println!("{x:6.2} {y:6.2} {z:6.2} m, {sigma:.2} m to the north, {mode:?}");
    }
    Ok(())
}

#[test]
fn the_target_is_followed() {
    let estimates = track().expect("every call is answered");
    let last = estimates.last().expect("estimates");
    let miss = (last.position_m[1] - 9.5).abs();
    assert!(miss < 4.0 * last.covariance_m2[1][1].sqrt(), "{miss}");
    assert_eq!(last.mode, Mode::Tracking);
    assert_eq!(estimates[5].mode, Mode::Coasting);
}
