//! Links only if nothing that this crate does can panic: the panic handler calls a function that
//! nobody defines, so a single path to it that the compiler keeps is an undefined symbol.
//!
//! Here is every operation of a blob, of the trackers, of `Mounting`, `WrappingClock` and the protocol, for inputs that the
//! compiler does not see; what only verifies (passes that draw every weight) is not. Some paths are gone because
//! the optimiser saw that they are: that holds for this profile. `tests/panic_free.rs` builds it as the
//! image is built; it is never run. By hand:
//!
//! ```text
//! cargo build -p bnkf --bin panic-free --features panic-free --profile image --target thumbv7em-none-eabihf
//! ```
#![no_std]
#![no_main]
#![allow(unsafe_code)]

use core::hint::black_box;
use core::panic::PanicInfo;

use bnkf::blob::Blob;
use bnkf::protocol::{
    EstimateFrame, ForecastFrame, FrameReader, LikelihoodFrame, MeasurementFrame, RefusalCode,
    Reply, Request, encode,
};
use bnkf::{
    Call, Estimate, LateTracker, Measurement, Model, Mounting, Sensed, Sensor, Settings, StepError,
    TRACK_SNAPSHOT_BYTES, Track, Tracker, Workspace, WrappingClock,
};

// SAFETY: no object defines it, so what calls it does not link.
unsafe extern "C" {
    fn something_here_can_panic() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    // SAFETY: never linked, see above.
    unsafe { something_here_can_panic() }
}

// SAFETY: the linker's entry point; no other object has one.
#[unsafe(no_mangle)]
extern "C" fn _start() -> ! {
    let bytes = black_box(&[0_u8; 64][..]);
    if let Ok(blob) = Blob::parse(bytes) {
        views(&blob);
        track(blob, black_box(Settings::of(&blob)));
    }
    directions();
    frames(bytes);
    loop {}
}

fn views(blob: &Blob<'_>) {
    black_box((blob.kind(), blob.features(), blob.passes(), blob.checksum()));
    black_box((blob.network_count(), blob.outputs()));
    let floats = [
        blob.parameters(),
        blob.input_normalisation(),
        blob.output_normalisation(),
    ];
    for floats in floats {
        black_box((floats.len(), floats.get(black_box(7))));
        black_box(floats.iter().sum::<f32>());
    }
    for network in blob.networks() {
        for index in 0..network.layers() {
            let layer = network.layer(index);
            let (output, input) = black_box((3, 5));
            black_box((layer.mean(output, input), layer.variance(output, input)));
        }
    }
}

fn track(blob: Blob<'_>, settings: Settings) {
    let Ok(mut tracker) = Tracker::new(blob, settings) else {
        return;
    };
    let seen = black_box(measurement());
    black_box((tracker.settings(), tracker.latest_us()));
    answered(tracker.step(&seen), |e| {
        Reply::Estimate(EstimateFrame::new(e, 1))
    });
    answered(tracker.coast(black_box(1)), |e| {
        Reply::Estimate(EstimateFrame::new(e, 1))
    });
    answered(tracker.forecasts(black_box(&[3, 4, 5])), |forecasts| {
        Reply::Forecast(ForecastFrame::new(forecasts, 1))
    });
    answered(tracker.likelihood(&seen), |likelihood| {
        Reply::Likelihood(LikelihoodFrame::new(likelihood, 1))
    });
    black_box(tracker.forecast(black_box(2))).ok();
    black_box(Call::new(black_box(6), black_box(None)).answer(&mut tracker)).ok();
    shared(&Model::from(blob), tracker.track());
    let track = tracker.track().clone();
    black_box(tracker.resume(&track)).ok();
    tracker.reset();
    let mut late = LateTracker::new(tracker);
    black_box(late.step(&seen)).ok();
    black_box(late.coast(black_box(7))).ok();
    black_box(late.forecasts(black_box(&[8]))).ok();
    black_box(late.likelihood(&seen)).ok();
    black_box((late.calls_rerun(), late.tracker().latest_us()));
    late.reset();
    black_box(&late);
}

/// A track written down, read, and taken over by a model that it shares.
fn shared(model: &Model<'_>, track: &Track) {
    let mut bytes = [0; TRACK_SNAPSHOT_BYTES];
    track.to_bytes(&mut bytes);
    let Ok(mut track) = Track::from_bytes(black_box(&bytes)) else {
        return;
    };
    black_box(track.hand_over(model)).ok();
    let mut workspace = Workspace::new();
    let each = |place: usize, estimate: &Estimate| {
        black_box((place, estimate.time_us));
    };
    black_box(track.forecast_each(model, &mut workspace, black_box(&[9]), each)).ok();
    black_box(track.begin(model, black_box(track.settings()))).ok();
    black_box(&track);
}

/// An answer of a tracker as it goes over the line.
fn answered<T>(answer: Result<T, StepError>, reply: impl FnOnce(&T) -> Reply) {
    let reply = match &answer {
        Ok(answer) => reply(answer),
        Err(error) => Reply::Refused(RefusalCode::from(*error)),
    };
    black_box(encode(&reply)).ok();
}

fn measurement() -> Measurement {
    let sensed = Some(Sensed {
        value: 1.0,
        sigma: 1.0,
    });
    Measurement {
        time_us: 0,
        range: sensed,
        elevation: sensed,
        azimuth: sensed,
        range_rate: sensed,
        sensor: Sensor::ORIGIN,
    }
}

fn directions() {
    let [yaw, pitch, roll, value, sigma] = black_box([0.1; 5]);
    let sensed = Sensed { value, sigma };
    black_box(Mounting::new(yaw, pitch, roll).direction(sensed, sensed));
    black_box(WrappingClock::default().extend(black_box(1)));
}

/// What comes over the line, and what a host would send.
fn frames(bytes: &[u8]) {
    let mut reader = FrameReader::new();
    for &byte in bytes {
        match reader.push(byte) {
            Some(Ok(Request::Step(frame) | Request::Likelihood(frame))) => {
                black_box(Measurement::from(&frame));
            }
            Some(Ok(Request::Reset(reset))) => {
                black_box(Settings::try_from(reset)).ok();
            }
            other => {
                black_box(other);
            }
        }
    }
    let frame = MeasurementFrame::from(&black_box(measurement()));
    black_box(encode(&Request::Step(frame))).ok();
}
