//! Flights that no training shows: made from built-in ones, with velocities that change at once.

pub mod bursts;
pub mod darts;
pub mod falls;
