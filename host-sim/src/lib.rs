//! The simulated measurement loop: baselines, metrics, reports, and the image in QEMU.

pub mod baseline;
pub mod cell;
pub mod chi_square;
pub mod filter;
pub mod metrics;
