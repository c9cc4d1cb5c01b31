//! Serial frames between a host and the image, both directions.
//!
//! One frame is `COBS(postcard(message) ++ CRC-32 little-endian) ++ 0x00`. The bytes may come from
//! anywhere: no input makes this module panic, every bad frame is a [`FrameError`] and the reader is
//! in step again at the next `0x00`. The wire structures are apart from the types that compute, so
//! a change of either shows here. `f32` travels as its four bytes: no bit is lost.

mod forecast;
mod frame;
mod likelihood;
mod reply;
mod request;

pub use forecast::{ForecastFrame, HORIZONS, PlaceFrame};
pub use frame::{EncodeError, FRAME_BYTES_MAX, Frame, FrameError, FrameReader, encode};
pub use likelihood::LikelihoodFrame;
pub use reply::{BudgetFrame, EstimateFrame, ModeCode, Ready, RefusalCode, Reply};
pub use request::{
    CorrectionCode, InferenceCode, MeasurementFrame, Request, Reset, SensedFrame, SensorFrame,
};

/// Raised when any frame changes; [`Ready`] reports it and the host refuses another.
pub const VERSION: u8 = 6;
