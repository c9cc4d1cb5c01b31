//! The phases of a flight that tell different things about a filter.

use serde::Serialize;

/// The time that filters are given to settle, seconds.
pub const START_S: f64 = 2.0;

/// Where in a flight a step lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// The first two seconds, measured or not.
    Start,
    /// Later, without a reading.
    Gap,
    /// Later, with a reading.
    Measured,
}

impl Phase {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Start, Self::Gap, Self::Measured];

    /// The phase of a step at `time_s` after the flight's first sample.
    pub fn of(time_s: f64, in_gap: bool) -> Self {
        if time_s <= START_S {
            Self::Start
        } else if in_gap {
            Self::Gap
        } else {
            Self::Measured
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Phase;

    #[test]
    fn the_start_comes_first() {
        assert_eq!(Phase::of(1.9, true), Phase::Start);
        assert_eq!(Phase::of(2.1, true), Phase::Gap);
        assert_eq!(Phase::of(2.1, false), Phase::Measured);
    }
}
