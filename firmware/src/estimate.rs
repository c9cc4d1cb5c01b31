//! What a tracker returns.

/// How an [`Estimate`] came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// From the first measurement, or the first one after a long silence.
    Started,
    /// From the current measurement and the ones before it.
    Tracking,
    /// Without a measurement: extrapolated, with a covariance that grows.
    Coasting,
}

/// Position and covariance at one instant; frame x east, y north, z up, radar at the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Time, microseconds, of the measurement or of the call to coast.
    pub time_us: u64,
    /// Position, m.
    pub position_m: [f32; 3],
    /// Covariance of the position, m^2, symmetric positive definite.
    pub covariance_m2: [[f32; 3]; 3],
    /// Normalised innovation squared of the correction; zero without one.
    pub nis: f32,
    /// How the estimate came about.
    pub mode: Mode,
}
