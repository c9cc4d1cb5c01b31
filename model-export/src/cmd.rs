//! The subcommands of `model-export`, one file each.

pub mod flight_source;
pub mod train;
pub mod train_recursive;
pub mod verify_recursive;
