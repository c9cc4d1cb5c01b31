//! Flights that are hard to follow: made from built-in ones, with velocities (darts) or accelerations (bursts, falls)
//! that change at once. The shipped models' training has agile flights, which burst and brake as well, and nothing like darts.

pub mod bursts;
pub mod darts;
pub mod falls;
