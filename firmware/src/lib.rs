//! Bayesian neural Kalman tracking for radar nodes: `no_std`, no allocation, static memory.
#![no_std]

pub mod blob;
mod measurement;

pub use measurement::{Measurement, MeasurementError, MeasurementField, Sigmas};
