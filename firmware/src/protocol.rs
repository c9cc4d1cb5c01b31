//! Serial frames between a host and the image, both directions.
//!
//! One frame is `COBS(postcard(message) ++ CRC-32 little-endian) ++ 0x00`. The bytes may come from
//! anywhere: no input makes this module panic, every bad frame is a [`FrameError`] and the reader is
//! in step again at the next `0x00`. The wire structures are apart from the types that compute, so
//! a change of either shows here. `f32` travels as its four bytes: no bit is lost.
//!
//! What a host asks, as the image reads it:
//!
//! ```
//! use bnkf::protocol::{CorrectionCode, EncodeError, Frame, FrameError, FrameReader, InferenceCode};
//! use bnkf::protocol::{MeasurementFrame, Request, Reset, SensedFrame, SensorFrame, encode};
//!
//! let radar = SensorFrame { position_m: [10.0, 0.0, 2.0], velocity_mps: [0.0; 3] };
//! let seen = MeasurementFrame {
//!     time_us: 100_000,
//!     range: Some(SensedFrame { value: 33.0, sigma: 0.5 }),
//!     elevation: None,
//!     azimuth: Some(SensedFrame { value: 0.5, sigma: 0.01 }),
//!     range_rate: None,
//!     sensor: Some(radar),
//! };
//! let (correction, inference) = (CorrectionCode::Polar, InferenceCode::Mean);
//! let reset = Request::Reset(Reset { seed: 1, inference, correction });
//! let mut reader = FrameReader::new();
//! for request in [reset, Request::Step(seen)] {
//!     let frame: Frame = encode(&request)?;
//!     let read = frame.iter().find_map(|&byte| reader.push::<Request>(byte));
//!     assert_eq!(read, Some(Ok(request)));
//! }
//! // A line that lost a byte.
//! let frame = encode(&Request::Step(seen))?;
//! let read = frame.iter().skip(1).find_map(|&byte| reader.push::<Request>(byte));
//! assert!(matches!(read, Some(Err(FrameError::Stuffing | FrameError::Checksum))));
//! # Ok::<(), EncodeError>(())
//! ```
//!
//! What the image answers, as a host reads it:
//!
//! ```
//! use bnkf::protocol::{BudgetFrame, EstimateFrame, ForecastFrame, LikelihoodFrame, ModeCode};
//! use bnkf::protocol::{MotionFrame, PlaceFrame, Ready, RefusalCode, Reply};
//!
//! fn say(reply: &Reply) {
//!     match reply {
//!         Reply::Ready(Ready { blob_crc, .. }) => println!("it flies the model {blob_crc:08x}"),
//!         Reply::Started => println!("a new track"),
//!         Reply::Estimate(EstimateFrame { mode: ModeCode::Rejected, .. }) => println!("not it"),
//!         Reply::Estimate(EstimateFrame { position_m, motion, .. }) => {
//!             let motion: &Option<MotionFrame> = motion;
//!             println!("{position_m:?} {:?}", motion.map(|motion| motion.velocity_mps));
//!         }
//!         Reply::Forecast(ForecastFrame { places, .. }) => {
//!             let [PlaceFrame { position_m, .. }, ..] = places;
//!             println!("next at {position_m:?}");
//!         }
//!         Reply::Likelihood(LikelihoodFrame { passes_gate, .. }) => println!("{passes_gate}"),
//!         Reply::Budget(BudgetFrame { stack_bytes_max, .. }) => println!("{stack_bytes_max}"),
//!         Reply::Refused(RefusalCode::Blob) => println!("only a new image helps"),
//!         Reply::Refused(code) => println!("{code:?}"),
//!     }
//! }
//! say(&Reply::Started);
//! ```

mod forecast;
mod frame;
mod likelihood;
mod reply;
mod request;

pub use forecast::{ForecastFrame, HORIZONS, PlaceFrame};
pub use frame::{EncodeError, FRAME_BYTES_MAX, Frame, FrameError, FrameReader, encode};
pub use likelihood::LikelihoodFrame;
pub use reply::{BudgetFrame, EstimateFrame, ModeCode, MotionFrame, Ready, RefusalCode, Reply};
pub use request::{
    CorrectionCode, InferenceCode, MeasurementFrame, Request, Reset, SensedFrame, SensorFrame,
};

/// Raised when any frame changes; [`Ready`] reports it and the host refuses another.
pub const VERSION: u8 = 6;
