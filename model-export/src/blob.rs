//! From real-valued posteriors to the bytes that the firmware reads, and back to words for people.

pub mod description;
pub mod grid;
pub mod quantise;
pub mod sealed;
pub mod unrounded;
pub mod writer;
