//! How far ahead forecasts are scored.

/// Microseconds.
pub const HORIZONS_US: [u64; 3] = [500_000, 1_000_000, 2_000_000];
/// Every so many samples a tracker is asked: what it says of two seconds changes little in half a
/// one, and asking at each would double the time of an evaluation.
pub const EVERY: usize = 5;
