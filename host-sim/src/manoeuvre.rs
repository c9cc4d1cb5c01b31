//! Flights that no training shows: made from built-in ones, with velocities (darts) or accelerations (bursts, falls)
//! that change at once.

pub mod bursts;
pub mod darts;
pub mod falls;
