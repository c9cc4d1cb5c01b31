//! A computation recorded once, simplified, and run forwards and backwards over lanes of flights.

mod execution;
pub mod lanes;
pub mod program;
pub mod simplification;
pub mod tape;
