//! The Gaussian posterior of every weight of a network, and what reads it.

pub mod architecture;
pub mod gaussian_weights;
pub mod network_f64;
pub(crate) mod padded_weights;
