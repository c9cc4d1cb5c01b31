//! The unit of a flight file's times: what its column's name says, or what is plausible.
//!
//! Units are a factor of a thousand apart, so step and speed together nearly always leave one: a
//! drone that is sampled every 10 ms at 2 m/s would, in seconds, be sampled every 10 s at 2 mm/s.
//! Where two are left, the caller is asked.

use super::MEDIAN_STEP_S_MAX;

/// A unit of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum TimeUnit {
    /// Seconds.
    S,
    /// Milliseconds.
    Ms,
    /// Microseconds.
    Us,
    /// Nanoseconds.
    Ns,
}

/// The times' unit cannot be told.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "`{column}` may be in seconds (steps of {step:.3} s, {speed_mps:.2e} m/s) or in {} (speeds of {:.1} m/s): \
     say which with --time-unit",
    other.name(), speed_mps * other.per_second()
)]
pub struct TimeUnitError {
    /// The time's column.
    column: String,
    /// Median step, as it stands in the file.
    step: f64,
    /// Speed if the times are seconds.
    speed_mps: f64,
    /// The other plausible unit.
    other: TimeUnit,
}

/// Faster than any aircraft that is tracked here, metres per second.
pub const SPEED_MPS_MAX: f64 = 150.0;
/// Slowest 95th percentile of a flight's speed that speaks for a unit, metres per second:
/// [`SPEED_MPS_MAX`] over a thousand, so that it speaks for one.
const SPEED_MPS_MIN: f64 = SPEED_MPS_MAX / 1000.0;
/// Steps at least this long may be other units than seconds: none counts in less than a half.
const STEP_DOUBTED: f64 = 0.5;
/// Usual steps, seconds: 200 Hz to every other second.
const STEP_S_USUAL: std::ops::Range<f64> = 5e-3..2.0;
/// A speed that few drones pass, metres per second.
const SPEED_MPS_USUAL: f64 = 50.0;

impl TimeUnit {
    const SHORTER: [Self; 3] = [Self::Ms, Self::Us, Self::Ns];

    /// How many make a second.
    #[must_use]
    pub fn per_second(self) -> f64 {
        match self {
            Self::S => 1.0,
            Self::Ms => 1e3,
            Self::Us => 1e6,
            Self::Ns => 1e9,
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::S => "seconds",
            Self::Ms => "milliseconds",
            Self::Us => "microseconds",
            Self::Ns => "nanoseconds",
        }
    }

    /// The unit that `text` (lower case) spells.
    #[must_use]
    pub fn spelt(text: &str) -> Option<Self> {
        Some(match text {
            "s" | "sec" | "secs" | "second" | "seconds" => Self::S,
            "ms" | "msec" | "msecs" | "millis" | "millisecond" | "milliseconds" => Self::Ms,
            "us" | "\u{b5}s" | "\u{3bc}s" | "usec" | "usecs" | "micros" | "microsecond"
            | "microseconds" => Self::Us,
            "ns" | "nsec" | "nsecs" | "nanos" | "nanosecond" | "nanoseconds" => Self::Ns,
            _ => return None,
        })
    }
}

/// The unit that gives `rows` of `[time, x, y, z]` (metres) plausible steps and speeds. Seconds for
/// what fits no unit, which is then refused for another reason.
///
/// # Errors
/// Two units do.
pub fn plausible(rows: &[[f64; 4]], column: &str) -> Result<TimeUnit, TimeUnitError> {
    let Some((step, speed)) = median_step_and_high_speed(rows) else {
        return Ok(TimeUnit::S);
    };
    let seconds = step <= MEDIAN_STEP_S_MAX;
    if step < STEP_DOUBTED || speed > SPEED_MPS_MAX || (seconds && speed >= SPEED_MPS_MIN) {
        return Ok(TimeUnit::S);
    }
    let by_speed = TimeUnit::SHORTER.into_iter().find(|unit| {
        (SPEED_MPS_MIN..SPEED_MPS_MAX).contains(&(speed * unit.per_second()))
            && step / unit.per_second() >= 1e-4
            && step / unit.per_second() <= MEDIAN_STEP_S_MAX
    });
    if let Some(unit) = by_speed {
        let usual = STEP_S_USUAL.contains(&(step / unit.per_second()));
        if usual && (!seconds || speed * unit.per_second() < SPEED_MPS_USUAL) {
            return Ok(unit);
        }
        if seconds {
            return Err(TimeUnitError {
                column: column.to_owned(),
                step,
                speed_mps: speed,
                other: unit,
            });
        }
    }
    if seconds {
        return Ok(TimeUnit::S);
    }
    // A hovering flight, or one that is stranger: the step alone.
    let by_step = TimeUnit::SHORTER
        .into_iter()
        .find(|unit| step / unit.per_second() < 2.0);
    Ok(by_step.unwrap_or(TimeUnit::S))
}

/// Median of the steps in time, and 95th percentile of the speeds; of no steps, nothing.
fn median_step_and_high_speed(rows: &[[f64; 4]]) -> Option<(f64, f64)> {
    let mut steps = Vec::with_capacity(rows.len());
    let mut speeds = Vec::with_capacity(rows.len());
    for pair in rows.windows(2) {
        let [dt, dx, dy, dz]: [f64; 4] = std::array::from_fn(|i| pair[1][i] - pair[0][i]);
        let speed = (dx * dx + dy * dy + dz * dz).sqrt() / dt;
        if dt > 0.0 && dt.is_finite() && speed.is_finite() {
            steps.push(dt);
            speeds.push(speed);
        }
    }
    let quantile = |values: &mut [f64], part: f64| {
        let last = values.len().checked_sub(1)?;
        let place = (part * last as f64) as usize;
        Some(*values.select_nth_unstable_by(place, f64::total_cmp).1)
    };
    Some((quantile(&mut steps, 0.5)?, quantile(&mut speeds, 0.95)?))
}

#[cfg(test)]
mod tests {
    use super::{TimeUnit, plausible};
    use proptest::prelude::*;

    /// Steps of `step`, as they stand in a file, and `metres` between two samples.
    fn rows(step: f64, metres: f64) -> Vec<[f64; 4]> {
        (0..50)
            .map(|i| [1e6 + step * f64::from(i), metres * f64::from(i), 0.0, 5.0])
            .collect()
    }

    #[test]
    fn common_logs_have_their_unit() {
        let cases = [
            // Seconds: 10 Hz, 1 Hz, every 5 s; a hover; a fast jet.
            (0.1, 0.2, TimeUnit::S),
            (1.0, 5.0, TimeUnit::S),
            (5.0, 10.0, TimeUnit::S),
            (0.1, 1e-5, TimeUnit::S),
            (0.1, 0.0, TimeUnit::S),
            (1.0, 300.0, TimeUnit::S),
            // Milliseconds: 200, 100, 10 and 1 Hz, and a hover.
            (5.0, 0.01, TimeUnit::Ms),
            (10.0, 0.018, TimeUnit::Ms),
            (100.0, 0.18, TimeUnit::Ms),
            (1000.0, 1.8, TimeUnit::Ms),
            (100.0, 0.0, TimeUnit::Ms),
            // Microseconds: 250, 50 and 10 Hz, and a hover.
            (4000.0, 0.008, TimeUnit::Us),
            (20_000.0, 0.04, TimeUnit::Us),
            (100_000.0, 0.18, TimeUnit::Us),
            (100_000.0, 1e-6, TimeUnit::Us),
            // Nanoseconds: 100 and 10 Hz.
            (1e7, 0.05, TimeUnit::Ns),
            (1e8, 0.5, TimeUnit::Ns),
        ];
        for (step, metres, unit) in cases {
            assert_eq!(
                plausible(&rows(step, metres), "t"),
                Ok(unit),
                "{step} {metres}"
            );
        }
        assert_eq!(plausible(&[], "t"), Ok(TimeUnit::S));
    }

    #[test]
    fn what_two_units_explain_is_asked_for() {
        // Every second at 2 mm/s, or a thousand times a second at 2 m/s.
        let error = plausible(&rows(1.0, 0.002), "time")
            .unwrap_err()
            .to_string();
        assert_eq!(
            error,
            "`time` may be in seconds (steps of 1.000 s, 2.00e-3 m/s) or in milliseconds (speeds of 2.0 m/s): \
             say which with --time-unit"
        );
    }

    proptest! {
        #[test]
        fn any_numbers_have_a_unit_or_a_question(
            rows in prop::collection::vec(prop::array::uniform4(any::<f64>()), 0..9)
        ) {
            let _unit = plausible(&rows, "t");
        }

        /// Of 10 to 100 Hz at 0.5 to 40 m/s the unit is found, whatever it is.
        #[test]
        fn usual_flights_have_their_unit(
            step_s in 0.01..0.1_f64, speed_mps in 0.5..40.0_f64, unit in 0_usize..4
        ) {
            let unit = [TimeUnit::S, TimeUnit::Ms, TimeUnit::Us, TimeUnit::Ns][unit];
            let rows = rows(step_s * unit.per_second(), step_s * speed_mps);
            prop_assert_eq!(plausible(&rows, "t"), Ok(unit));
        }
    }
}
