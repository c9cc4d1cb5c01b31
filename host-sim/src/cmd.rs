//! The commands of `host-sim`, one file each.

pub mod demo;
pub mod doubt;
pub mod evaluate;
pub mod image;
mod positive;
pub mod progress;
pub mod readings;
pub mod replicate;
pub mod score;
pub mod track;
