//! One number for everything that trackers of both kinds say of a fixed set of measurements; the host's test
//! includes this file.

use bnkf::blob::Blob;
use bnkf::protocol::{EstimateFrame, ForecastFrame, LikelihoodFrame, RefusalCode, Reply, encode};
use bnkf::{Inference, Measurement, Mounting, Sensed, Sensor, Settings, StepError, Tracker};

/// The models, each with numbers of passes, exact and frozen; then without any: moments.
const RUNS: [(&[u8], &[u16]); 3] = [
    (include_bytes!("../../../../models/recursive.bnkf"), &[1, 6]),
    (
        include_bytes!("../../../../tests/golden/tiny_bnkf.bnkf"),
        &[9],
    ),
    (
        include_bytes!("../../../../tests/golden/tiny_bnkfe.bnkf"),
        &[5],
    ),
];
/// Steps of a run, a tenth of a second apart; every fifth is a gap.
const STEPS: u64 = 24;

/// FNV-1a of 64 bits over the frames of all answers.
pub fn hash() -> u64 {
    let mut hash = Hash(0xCBF2_9CE4_8422_2325);
    for (bytes, runs) in RUNS {
        match Blob::parse(bytes) {
            Ok(blob) => {
                let own = Settings::of(&blob).inference;
                for &passes in runs {
                    let exact = Inference::of_passes(passes).unwrap_or(own);
                    run(blob, exact, &mut hash);
                    // Mean weights once.
                    if exact.frozen() != exact {
                        run(blob, exact.frozen(), &mut hash);
                    }
                }
                run(blob, Inference::Moments, &mut hash);
            }
            Err(_) => hash.add(&Reply::Refused(RefusalCode::Blob)),
        }
    }
    hash.0
}

struct Hash(u64);

impl Hash {
    fn add(&mut self, reply: &Reply) {
        // Every reply fits a frame; one that did not would change the hash by its absence.
        for byte in encode(reply).iter().flatten() {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3);
        }
    }

    fn answer<T>(&mut self, answer: Result<T, StepError>, reply: impl FnOnce(&T) -> Reply) {
        match &answer {
            Ok(answer) => self.add(&reply(answer)),
            Err(error) => self.add(&Reply::Refused(RefusalCode::from(*error))),
        }
    }
}

// A frame of its own, so that one tracker's way over the stack is gone before the next.
#[inline(never)]
fn run(blob: Blob<'_>, inference: Inference, hash: &mut Hash) {
    let settings = Settings {
        inference,
        ..Settings::of(&blob)
    };
    let Ok(mut tracker) = Tracker::new(blob, settings) else {
        return hash.add(&Reply::Refused(RefusalCode::Settings));
    };
    let estimated = |e: &_| Reply::Estimate(EstimateFrame::new(e, 0));
    for step in 0..STEPS {
        let time_us = 100_000 * step;
        if step % 5 == 4 {
            hash.answer(tracker.coast(time_us), estimated);
        } else {
            let seen = measurement(time_us, step);
            hash.answer(tracker.likelihood(&seen), |likelihood| {
                Reply::Likelihood(LikelihoodFrame::new(likelihood, 0))
            });
            hash.answer(tracker.step(&seen), estimated);
        }
        let ahead_us = [time_us + 50_000, time_us + 1_000_000, time_us + 2_500_000];
        hash.answer(tracker.forecasts(&ahead_us), |forecasts| {
            Reply::Forecast(ForecastFrame::new(forecasts, 0))
        });
    }
}

/// A target that rises and turns, with errors of a tenth of their sigma's size and one wild reading.
fn measurement(time_us: u64, step: u64) -> Measurement {
    let error = |channel: u64| ((step * 7 + channel * 3) % 11) as f32 * 0.04 - 0.2;
    let sensed = |value: f32, sigma: f32, channel: u64| Sensed {
        value: value + sigma * error(channel),
        sigma,
    };
    let wild = if step == 13 { 25.0 } else { 0.0 };
    let along = step as f32;
    let mounting = Mounting::new(0.9, 0.1, -0.05);
    let elevation = sensed(0.2 + 0.006 * along, 0.01, 1);
    let seen = mounting.direction(elevation, sensed(-0.6 + 0.04 * along, 0.01, 2));
    Measurement {
        time_us,
        range: Some(sensed(30.0 + 0.15 * along + wild, 0.5, 0)),
        elevation: Some(seen.elevation),
        azimuth: seen.azimuth,
        range_rate: Some(sensed(1.5, 0.1, 3)),
        sensor: Sensor::ORIGIN,
    }
}
