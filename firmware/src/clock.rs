//! What times a tracker takes, and a helper for clocks of 32 bits.

/// Furthest that a time may lie ahead of the latest one, microseconds: a minute. One absurd time
/// would otherwise make every honest one after it lie in the past.
pub const AHEAD_MAX_US: u64 = 60_000_000;

/// Why a time was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ClockError {
    /// Before the latest one.
    WentBack,
    /// More than [`AHEAD_MAX_US`] after the latest one.
    TooFarAhead,
}

/// What a measurement's time means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tick {
    /// It follows the latest time, or equals it.
    Next,
    /// There is no latest time, or two measurements in a row agreed that the clock was set.
    Anew,
}

/// The times of one track.
///
/// A time that lies absurdly far ahead or behind is refused. If the next measurement agrees with it, within
/// [`AHEAD_MAX_US`] after it, the clock was set or the silence was long: the track starts anew there. One in between
/// that is only a little late says nothing of that. That is the way back from any wrong time, besides a reset.
///
/// ```
/// use bnkf::clock::{Clock, ClockError, Tick};
///
/// let mut clock = Clock::NEW;
/// assert_eq!(clock.measured(5_000_000), Ok(Tick::Anew));
/// clock.advance(5_000_000);
/// assert_eq!(clock.measured(5_100_000), Ok(Tick::Next));
/// assert_eq!(clock.measured(4_000_000), Err(ClockError::WentBack));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    pub(crate) latest_us: Option<u64>,
    pub(crate) strange_us: Option<u64>,
}

impl Clock {
    /// Of a track that has seen nothing.
    pub const NEW: Self = Self {
        latest_us: None,
        strange_us: None,
    };

    /// Time of the latest measurement or coast, microseconds.
    pub fn latest_us(&self) -> Option<u64> {
        self.latest_us
    }

    /// Whether a measurement's time can be used; [`Clock::advance`] takes it.
    ///
    /// # Errors
    /// [`ClockError`]; a strange time is remembered for the next measurement.
    pub fn measured(&mut self, time_us: u64) -> Result<Tick, ClockError> {
        let Some(latest_us) = self.latest_us else {
            return Ok(Tick::Anew);
        };
        let error = match self.check(time_us) {
            Ok(()) => return Ok(Tick::Next),
            Err(error) => error,
        };
        // What is a little late is only late.
        if error == ClockError::WentBack && latest_us - time_us <= AHEAD_MAX_US {
            return Err(error);
        }
        let agrees = |strange_us| (0..=AHEAD_MAX_US).contains(&time_us.wrapping_sub(strange_us));
        if self.strange_us.is_some_and(agrees) {
            return Ok(Tick::Anew);
        }
        self.strange_us = Some(time_us);
        Err(error)
    }

    /// Whether a track can be propagated to a time.
    ///
    /// # Errors
    /// [`ClockError`]
    pub fn check(&self, time_us: u64) -> Result<(), ClockError> {
        match self.latest_us {
            Some(latest_us) if time_us < latest_us => Err(ClockError::WentBack),
            Some(latest_us) if time_us - latest_us > AHEAD_MAX_US => Err(ClockError::TooFarAhead),
            _ => Ok(()),
        }
    }

    /// Takes a time that was used.
    pub fn advance(&mut self, time_us: u64) {
        self.latest_us = Some(time_us);
        self.strange_us = None;
    }
}

/// Time between two instants in seconds; `later` is not before `earlier`.
pub fn seconds_between(earlier_us: u64, later_us: u64) -> f32 {
    // Differences are short; only they are converted, so epoch times lose nothing.
    later_us.saturating_sub(earlier_us) as f32 * 1e-6
}

/// Makes times of 64 bits from a microsecond counter of 32 bits, which wraps after 71 minutes.
///
/// Any two readings in a row must lie less than 35 minutes apart; a reading may be a little older
/// than the one before it.
///
/// ```
/// let mut clock = bnkf::WrappingClock::default();
/// assert_eq!(clock.extend(4_294_967_290), 4_294_967_290);
/// assert_eq!(clock.extend(10), 4_294_967_306);
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct WrappingClock {
    latest_us: Option<u64>,
}

impl WrappingClock {
    /// The time, microseconds, that a reading of the counter stands for.
    pub fn extend(&mut self, counter_us: u32) -> u64 {
        let time_us = match self.latest_us {
            None => u64::from(counter_us),
            Some(latest_us) => {
                let step = counter_us.wrapping_sub(latest_us as u32) as i32;
                latest_us.saturating_add_signed(i64::from(step))
            }
        };
        self.latest_us = Some(time_us);
        time_us
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(latest_us: u64) -> Clock {
        let mut clock = Clock::NEW;
        clock.advance(latest_us);
        clock
    }

    #[test]
    fn a_minute_ahead_is_the_limit() {
        let mut clock = at(1_000);
        assert_eq!(clock.measured(1_000), Ok(Tick::Next));
        assert_eq!(clock.measured(1_000 + AHEAD_MAX_US), Ok(Tick::Next));
        let late = 1_001 + AHEAD_MAX_US;
        assert_eq!(clock.measured(late), Err(ClockError::TooFarAhead));
        assert_eq!(clock.check(late), Err(ClockError::TooFarAhead));
        assert_eq!(clock.latest_us(), Some(1_000));
    }

    #[test]
    fn one_absurd_time_costs_one_measurement() {
        let mut clock = at(1_000_000);
        for absurd in [u64::MAX, 3_600_000_000] {
            assert_eq!(clock.measured(absurd), Err(ClockError::TooFarAhead));
            assert_eq!(clock.measured(1_100_000), Ok(Tick::Next));
            clock.advance(1_100_000);
        }
    }

    #[test]
    fn two_that_agree_set_the_clock() {
        let mut clock = at(1_000_000);
        assert_eq!(clock.measured(3_600_000_000), Err(ClockError::TooFarAhead));
        assert_eq!(clock.measured(3_600_100_000), Ok(Tick::Anew));
        clock.advance(3_600_100_000);
        assert_eq!(clock.measured(3_600_200_000), Ok(Tick::Next));
        // And back.
        assert_eq!(clock.measured(5_000_000), Err(ClockError::WentBack));
        assert_eq!(clock.measured(4_000_000), Err(ClockError::WentBack));
        assert_eq!(clock.measured(4_100_000), Ok(Tick::Anew));
    }

    #[test]
    fn what_is_only_late_never_sets_the_clock() {
        let mut clock = at(100_000_000);
        for time_us in [99_000_000, 99_100_000, 40_000_000, 40_100_000] {
            assert_eq!(clock.measured(time_us), Err(ClockError::WentBack));
        }
        assert_eq!(clock.measured(39_999_999), Err(ClockError::WentBack));
        assert_eq!(clock.measured(40_000_000), Err(ClockError::WentBack));
    }

    #[test]
    fn seconds_are_exact_at_any_epoch() {
        let epoch = 1_700_000_000_000_000;
        assert_eq!(seconds_between(epoch, epoch + 100_000), 0.1);
        assert_eq!(seconds_between(epoch, epoch - 1), 0.0);
    }

    #[test]
    fn a_counter_that_wraps_goes_on() {
        let mut clock = WrappingClock::default();
        let mut counter = 4_294_000_000_u32;
        let mut last = clock.extend(counter);
        for _ in 0..100_000 {
            counter = counter.wrapping_add(100_000);
            let next = clock.extend(counter);
            assert_eq!(next - last, 100_000);
            last = next;
        }
        assert_eq!(clock.extend(counter.wrapping_sub(5)), last - 5);
    }
}
