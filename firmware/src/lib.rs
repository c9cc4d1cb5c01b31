//! Bayesian neural Kalman tracking for radar nodes: `no_std`, no allocation, static memory.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod blob;
mod measurement;
pub mod protocol;

pub use measurement::{Measurement, MeasurementError, MeasurementField, Sigmas};
