//! What makes a list of times and positions unusable as a flight.

use crate::brief_number::brief;

/// Fewest samples of a flight: what a centred velocity needs.
pub const SAMPLES_MIN: usize = 3;
/// Shortest time between two samples, seconds. Radar readings count microseconds.
pub const STEP_S_MIN: f64 = 1e-6;
/// Latest and, negated, earliest time, seconds: a Unix time in seconds passes, in milliseconds not.
pub const TIME_S_MAX: f64 = 1e11;
/// Largest absolute coordinate, metres: a UTM northing passes.
pub const COORDINATE_M_MAX: f64 = 1e7;

/// One value of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleField {
    /// Time, seconds.
    Time,
    /// East, metres.
    X,
    /// North, metres.
    Y,
    /// Up, metres.
    Z,
}

impl SampleField {
    /// The four fields in the order of a flight file.
    pub const ALL: [Self; 4] = [Self::Time, Self::X, Self::Y, Self::Z];

    /// The column of a flight file that holds this field.
    #[must_use]
    pub fn column(self) -> &'static str {
        ["timestamp", "tx", "ty", "tz"][self as usize]
    }

    /// Largest absolute value, in the field's unit.
    #[must_use]
    pub fn bound(self) -> f64 {
        match self {
            Self::Time => TIME_S_MAX,
            Self::X | Self::Y | Self::Z => COORDINATE_M_MAX,
        }
    }
}

impl std::fmt::Display for SampleField {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.column())
    }
}

/// Why positions over time are not a flight. `index` counts samples from 0.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TrackError {
    /// Fewer than [`SAMPLES_MIN`] samples.
    #[error("{found} samples, at least {SAMPLES_MIN} are needed")]
    TooFewSamples {
        /// How many there are.
        found: usize,
    },
    /// NaN or infinite.
    #[error("`{field}` is not finite")]
    NotFinite {
        /// Where.
        index: usize,
        /// What.
        field: SampleField,
    },
    /// Beyond [`SampleField::bound`].
    #[error("`{field}` = {} is beyond +-{}", brief(*value), field.bound())]
    OutOfRange {
        /// Where.
        index: usize,
        /// What.
        field: SampleField,
        /// The offending value.
        value: f64,
    },
    /// Less than [`STEP_S_MIN`] after the sample before, but after it.
    #[error(
        "time {} s is {:.2} us after {} s, the sample before: closer than 1 us, which times are counted in",
        brief(*time_s),
        1e6 * (time_s - previous_s),
        brief(*previous_s)
    )]
    TimesTooClose {
        /// Where.
        index: usize,
        /// The time before, seconds.
        previous_s: f64,
        /// The offending time, seconds.
        time_s: f64,
    },
    /// Not after the sample before.
    #[error("time {} s does not follow {} s", brief(*time_s), brief(*previous_s))]
    TimeNotIncreasing {
        /// Where.
        index: usize,
        /// The time before, seconds.
        previous_s: f64,
        /// The offending time, seconds.
        time_s: f64,
    },
}

impl TrackError {
    /// Index of the offending sample, if the error is about one.
    #[must_use]
    pub fn index(&self) -> Option<usize> {
        match self {
            Self::TooFewSamples { .. } => None,
            Self::NotFinite { index, .. }
            | Self::OutOfRange { index, .. }
            | Self::TimesTooClose { index, .. }
            | Self::TimeNotIncreasing { index, .. } => Some(*index),
        }
    }
}

/// Checks `[time_s, x_m, y_m, z_m]` rows: finite, within bounds, increasing in time, enough.
///
/// # Errors
/// The first fault.
pub(crate) fn check_track(rows: &[[f64; 4]]) -> Result<(), TrackError> {
    for (index, row) in rows.iter().enumerate() {
        for (field, value) in SampleField::ALL.into_iter().zip(*row) {
            if !value.is_finite() {
                return Err(TrackError::NotFinite { index, field });
            }
            if value.abs() > field.bound() {
                return Err(TrackError::OutOfRange {
                    index,
                    field,
                    value,
                });
            }
        }
        if index > 0 {
            let (previous_s, time_s) = (rows[index - 1][0], row[0]);
            if time_s <= previous_s {
                return Err(TrackError::TimeNotIncreasing {
                    index,
                    previous_s,
                    time_s,
                });
            }
            if time_s - previous_s < STEP_S_MIN {
                return Err(TrackError::TimesTooClose {
                    index,
                    previous_s,
                    time_s,
                });
            }
        }
    }
    if rows.len() < SAMPLES_MIN {
        return Err(TrackError::TooFewSamples { found: rows.len() });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{COORDINATE_M_MAX, SampleField, TrackError, check_track};

    #[test]
    fn bad_rows_are_named() {
        let good = |i: f64| [i, 0.0, 0.0, 5.0];
        let with = |row: [f64; 4]| check_track(&[good(0.0), row, good(2.0)]);
        assert_eq!(
            with([1.0, 0.0, f64::NAN, 5.0]),
            Err(TrackError::NotFinite {
                index: 1,
                field: SampleField::Y
            })
        );
        assert_eq!(
            with([1.0, 0.0, 0.0, -2.0 * COORDINATE_M_MAX]),
            Err(TrackError::OutOfRange {
                index: 1,
                field: SampleField::Z,
                value: -2.0 * COORDINATE_M_MAX
            })
        );
        assert_eq!(
            with([0.0, 0.0, 0.0, 5.0]),
            Err(TrackError::TimeNotIncreasing {
                index: 1,
                previous_s: 0.0,
                time_s: 0.0
            })
        );
        assert_eq!(
            check_track(&[good(0.0), good(1.0)]),
            Err(TrackError::TooFewSamples { found: 2 })
        );
    }
}
