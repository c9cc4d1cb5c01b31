//! The commands of `host-sim`, one file each.

pub mod demo;
pub mod doubt;
pub mod evaluate;
pub mod image;
pub mod progress;
pub mod replicate;
