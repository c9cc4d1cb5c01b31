//! The image for the microcontroller: built, run in QEMU, and compared with the host.

pub mod build;
pub mod equality;
pub mod log;
pub mod qemu;
pub mod question;
pub mod report;
pub mod session;
pub mod stack;
pub mod toolchain;
