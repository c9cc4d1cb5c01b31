//! What an estimate is worth beside the truth, and how sure that is.

pub mod bin;
pub mod binned;
pub mod bootstrap;
pub mod cell;
pub mod chi_square;
pub mod consistency;
pub mod forecast;
pub mod median;
pub mod paired;
pub mod phase;
