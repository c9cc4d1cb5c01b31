//! The simulated measurement loop: baselines, metrics, reports, and the image in QEMU.

pub mod filter;
