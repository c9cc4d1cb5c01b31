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

pub mod activation;
pub mod blob;
pub mod cholesky;
mod coast;
pub mod ekf;
mod estimate;
mod features;
pub mod gaussian;
pub mod kernel;
pub mod layer;
mod measurement;
mod memoryless;
pub mod monte_carlo;
pub mod network;
pub mod protocol;
pub mod radar;
pub mod recursive;
pub mod rng;
pub mod scalar;
mod series;
mod tracker;

pub use estimate::{Estimate, Mode, Motion};
pub use features::{FEATURES_MAX, features};
pub use measurement::{Measurement, MeasurementError, MeasurementField, Sigmas};
pub use tracker::{Correction, Settings, StepError, TRACKER_BYTES_MAX, Tracker, TrackerError};
