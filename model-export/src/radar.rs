//! What the radar reports of a flight: noise, gaps, polar coordinates.

pub mod gaps;
pub mod noise;
pub mod polar;
pub mod pose;
pub mod reading;
pub mod sampling;
pub mod sensors;
