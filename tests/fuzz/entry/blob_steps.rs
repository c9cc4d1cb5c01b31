//! A damaged blob whose checksum was put right, then twenty calls of its tracker.
//!
//! Bytes: which blob; number of patches; each patch an offset (u16) and a byte, the first kilobyte
//! twice as likely as the rest; then per call a kind, the time since the last (u32, microseconds),
//! which channels are there, and eight raw single-precision numbers; six more for the sensor where
//! bit 4 of the channels' byte is set.

use bnkf::blob::{Blob, checksum, field};
use bnkf::call::Call;
use bnkf::estimate::Estimate;
use bnkf::{Measurement, Sensed, Sensor, Settings, StepError, Tracker};
use bnkf_model_export::soundness::{is_definite, is_finite, is_true};

const BLOBS: [&[u8]; 4] = [
    include_bytes!("../../../models/recursive.bnkf"),
    include_bytes!("../../../models/recursive-counter-uas.bnkf"),
    include_bytes!("../../golden/tiny_bnkf.bnkf"),
    include_bytes!("../../golden/tiny_bnkfe.bnkf"),
];
const CALLS: usize = 20;

/// Panics where the parser or the tracker does, or where something false leaves it.
pub fn run(bytes: &[u8]) {
    let mut rest = bytes.iter().copied();
    let mut next = || rest.next().unwrap_or(0);
    let mut blob = BLOBS[usize::from(next()) % BLOBS.len()].to_vec();
    for _ in 0..next() % 16 {
        let at = usize::from(u16::from_le_bytes([next(), next()]));
        let at = if at < 0x8000 { at % 1_024 } else { at };
        let at = at % blob.len();
        blob[at] = next();
    }
    let seal = checksum(&blob).to_le_bytes();
    blob[field::CRC].copy_from_slice(&seal);
    let Ok(blob) = Blob::parse(&blob) else {
        return;
    };
    let mut settings = Settings::of(&blob);
    settings.inference = settings.inference.at_most(2);
    let mut tracker = Tracker::new(blob, settings).expect("its own settings");
    let (mut time_us, mut before) = (0_u64, None::<Estimate>);
    for _ in 0..CALLS {
        let kind = next();
        let after_us = u32::from_le_bytes([next(), next(), next(), next()]);
        // Mostly as sensors do it, sometimes up to an hour.
        let after_us = if kind & 2 == 0 {
            after_us % 200_000
        } else {
            after_us
        };
        let at_us = time_us + u64::from(after_us);
        let present = next();
        let mut channel = |index: u32| {
            let value = f32::from_le_bytes([next(), next(), next(), next()]);
            let sigma = f32::from_le_bytes([next(), next(), next(), next()]);
            (present >> index & 1 == 0).then_some(Sensed { value, sigma })
        };
        let (range, elevation, azimuth) = (channel(0), channel(1), channel(2));
        let range_rate = channel(3);
        let mut number = || f32::from_le_bytes([next(), next(), next(), next()]);
        let sensor = if present & 16 == 0 {
            Sensor::ORIGIN
        } else {
            Sensor {
                position_m: core::array::from_fn(|_| number()),
                velocity_mps: core::array::from_fn(|_| number()),
            }
        };
        let measurement = Measurement {
            time_us: at_us,
            range,
            elevation,
            azimuth,
            range_rate,
            sensor,
        };
        let call = Call::new(at_us, (kind & 1 == 0).then_some(measurement));
        match call.answer(&mut tracker) {
            Ok(estimate) => {
                assert!(is_finite(&estimate), "{estimate:?}");
                assert!(is_definite(&estimate), "{estimate:?}");
                assert!(
                    is_true(&call, &estimate, before.as_ref()),
                    "{call:?}: {estimate:?}"
                );
                time_us = at_us;
                before = Some(estimate);
            }
            Err(error) => {
                if error == StepError::Lost {
                    before = None;
                }
            }
        }
    }
}
