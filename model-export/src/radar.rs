//! What the radar reports of a flight: noise, kinds of errors, gaps, polar coordinates.

pub mod errors;
pub mod gaps;
pub mod noise;
pub mod polar;
pub mod pose;
pub mod reading;
pub mod sampling;
pub mod sensors;
