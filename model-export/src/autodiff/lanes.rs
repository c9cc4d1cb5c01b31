//! A handful of flights that advance together, one number of each side by side.

/// Flights in one group. Sixteen `f64` keep the values and adjoints of a filter step inside a
/// second-level cache while the cost of decoding an operation stays below that of executing it.
pub const LANES: usize = 16;

/// One number of every flight in a group.
pub type Lanes = [f64; LANES];

/// Every lane zero.
pub const ZERO: Lanes = [0.0; LANES];
