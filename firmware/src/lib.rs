//! Bayesian neural Kalman tracking for radar nodes: `no_std`, no allocation, static memory.
//!
//! A [`Tracker`] reads a [`blob::Blob`] of quantised weight means and variances, draws Monte Carlo
//! passes of the Bayesian network, and corrects their mean and covariance with the measurement.
//! The same code runs on the microcontroller and on the host, and gives the same bits.
//!
//! Frame and units at every public boundary: radar at the origin, x east, y north, z up; azimuth
//! from +x towards +y, elevation from the horizontal, range-rate positive outbound; metres,
//! seconds, radians, metres per second.
//!
//! What this is not: no attitude estimation, no multi-target association, no networking.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod blob;
pub mod cholesky;
pub mod clock;
pub mod ekf;
pub mod estimate;
pub mod gaussian;
pub mod kernel;
pub mod likelihood;
pub mod measurement;
pub mod memoryless;
pub mod network;
pub mod protocol;
pub mod radar;
pub mod recursive;
pub mod rng;
pub mod scalar;
mod series;
mod settings;
mod step_error;
mod tracker;

pub use clock::WrappingClock;
pub use estimate::{Doubt, Estimate, Mode, Motion};
pub use likelihood::Likelihood;
pub use measurement::{Channel, Measurement, MeasurementError, Sensed};
pub use settings::{Correction, Settings, TrackerError};
pub use step_error::StepError;
pub use tracker::{TRACKER_BYTES_MAX, Tracker};
