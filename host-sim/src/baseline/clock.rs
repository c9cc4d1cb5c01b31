//! Time of a filter's belief.

use crate::filter::FilterError;

/// The time a filter has reached, microseconds since the flight's first sample.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    time_us: u64,
}

impl Clock {
    /// A clock that shows `time_us`.
    pub fn new(time_us: u64) -> Self {
        Self { time_us }
    }

    /// Moves to `time_us` and tells by how many seconds.
    ///
    /// # Errors
    /// [`FilterError::TimeWentBack`]; the clock stays.
    pub fn advance_s(&mut self, time_us: u64) -> Result<f64, FilterError> {
        let elapsed_us = time_us
            .checked_sub(self.time_us)
            .ok_or(FilterError::TimeWentBack)?;
        self.time_us = time_us;
        Ok(elapsed_us as f64 * 1e-6)
    }
}
