//! The simulated measurement loop: baselines, metrics, reports, and the image in QEMU.

pub mod baseline;
pub mod cell;
pub mod chi_square;
pub mod filter;
pub mod image_build;
pub mod image_equality;
pub mod image_log;
pub mod image_session;
pub mod method;
pub mod metrics;
pub mod plot;
pub mod qemu;
pub mod table;
pub mod toolchain;
pub mod track;
