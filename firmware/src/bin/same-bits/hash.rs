//! One number for everything that trackers of both kinds say of a fixed flight; the host's tests include
//! this file. It is of plain numbers in a fixed order, so that `examples/c/main.c` can say the same.

use bnkf::blob::Blob;
use bnkf::c::BnkfStatus;
use bnkf::{
    Estimate, Inference, Likelihood, Settings, StepError, TRACK_SNAPSHOT_BYTES, Track, Tracker,
};

use crate::flight::{STEPS, is_gap, measurement};

/// The models, each with numbers of passes, exact and frozen; then without any: moments.
const RUNS: [(&[u8], &[u16]); 3] = [
    (include_bytes!("../../../models/recursive.bnkf"), &[1, 6]),
    (include_bytes!("../../../tests/golden/tiny_bnkf.bnkf"), &[9]),
    (
        include_bytes!("../../../tests/golden/tiny_bnkfe.bnkf"),
        &[5],
    ),
];
/// The step before which a track is written down and read again.
const SNAPSHOT: u64 = 12;

/// FNV-1a of 64 bits over all answers.
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
            Err(error) => hash.status(error.into()),
        }
    }
    hash.0
}

struct Hash(u64);

impl Hash {
    fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3);
        }
    }

    fn status(&mut self, status: BnkfStatus) {
        self.bytes(&[status as u8]);
    }

    fn floats(&mut self, floats: &[f32]) {
        floats.iter().for_each(|x| self.bytes(&x.to_le_bytes()));
    }

    fn answer<T>(&mut self, answer: &Result<T, StepError>, add: impl FnOnce(&mut Self, &T)) {
        match answer {
            Ok(answer) => {
                self.status(BnkfStatus::Ok);
                add(self, answer);
            }
            Err(error) => self.status((*error).into()),
        }
    }

    fn estimate(&mut self, e: &Estimate) {
        self.bytes(&e.time_us.to_le_bytes());
        self.floats(&e.position_m);
        self.floats(e.covariance_m2.as_flattened());
        self.floats(&[e.nis, e.doubt.manoeuvre, e.doubt.outlier]);
        let has_motion = e.motion.is_some();
        self.bytes(&[e.mode as u8, u8::from(e.outside), u8::from(has_motion)]);
        if let Some(motion) = &e.motion {
            self.floats(&motion.velocity_mps);
            self.floats(&motion.acceleration_mps2);
            self.floats(motion.covariance.as_flattened());
        }
    }

    fn likelihood(&mut self, l: &Likelihood) {
        for innovation in l.innovation {
            self.bytes(&[u8::from(innovation.is_some())]);
            self.floats(&[innovation.unwrap_or_default()]);
        }
        self.floats(&[l.nis, l.ln_likelihood]);
        self.bytes(&[l.degrees, u8::from(l.passes_gate)]);
    }
}

// A frame of its own, so that one tracker's way over the stack is gone before the next.
#[inline(never)]
fn run(blob: Blob<'_>, inference: Inference, hash: &mut Hash) {
    let settings = Settings {
        inference,
        ..Settings::of(&blob)
    };
    let mut tracker = match Tracker::new(blob, settings) {
        Ok(tracker) => tracker,
        Err(error) => return hash.status(error.into()),
    };
    for step in 0..STEPS {
        let time_us = 100_000 * step;
        if step == SNAPSHOT {
            resume(&mut tracker, hash);
        }
        if is_gap(step) {
            hash.answer(&tracker.coast(time_us), Hash::estimate);
        } else {
            let seen = measurement(time_us, step);
            hash.answer(&tracker.likelihood(&seen), Hash::likelihood);
            hash.answer(&tracker.step(&seen), Hash::estimate);
        }
        let ahead_us = [time_us + 50_000, time_us + 1_000_000, time_us + 2_500_000];
        hash.answer(&tracker.forecasts(&ahead_us), |hash, forecasts| {
            forecasts
                .iter()
                .for_each(|forecast| hash.estimate(forecast));
        });
    }
}

/// Goes on from the track's bytes.
#[inline(never)]
fn resume(tracker: &mut Tracker<'_>, hash: &mut Hash) {
    let mut bytes = [0; TRACK_SNAPSHOT_BYTES];
    tracker.track().to_bytes(&mut bytes);
    hash.bytes(&bytes);
    tracker.reset();
    match Track::from_bytes(&bytes) {
        Ok(track) => match tracker.resume(&track) {
            Ok(()) => hash.status(BnkfStatus::Ok),
            Err(error) => hash.status(error.into()),
        },
        Err(error) => hash.status(error.into()),
    }
}
