//! The subcommands of `model-export`, one file each.

pub mod blob_file;
pub mod flight_source;
pub mod flights;
pub mod import;
pub mod inspect;
pub mod moments;
mod number_within;
pub mod remarks;
mod rounding;
pub mod stress;
pub mod train;
pub mod train_memoryless;
pub mod train_recursive;
pub mod tunable_file;
pub mod tune;
pub mod verify;
pub mod verify_recursive;
