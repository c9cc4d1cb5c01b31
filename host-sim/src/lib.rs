//! The simulated measurement loop: baselines, metrics, reports, and the image in QEMU.

pub mod baseline;
pub mod cell;
pub mod chi_square;
pub mod filter;
pub mod method;
pub mod metrics;
pub mod plot;
pub mod table;
pub mod track;
