//! Bayesian neural Kalman tracking for radar nodes: `no_std`, no allocation, static memory.
#![no_std]

mod measurement;

pub use measurement::{Measurement, MeasurementError, MeasurementField, Sigmas};
