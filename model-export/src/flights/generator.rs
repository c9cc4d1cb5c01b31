//! Seeded flights of a multirotor: the built-in data set.
//!
//! Circles and lemniscates, flat or three-dimensional, are flown by a feedback controller through a
//! vehicle that lags, limits acceleration and jerk, and is pushed by gusts; waypoint flights add
//! stops and turns. Motion is integrated at 100 Hz with exact arithmetic for the acceleration held
//! in a step, so position, velocity and acceleration belong together: no finite differences.
//!
//! Nothing here panics; transcendental functions come from `libm`, so a seed gives the same flights
//! on every machine.

mod circle;
mod course;
mod lemniscate;
mod reference;
mod trajectory;
mod vehicle;
mod vertical;
mod waypoints;

use crate::brief_number::brief;
use crate::flights::flight::{Flight, SAMPLES_MIN, Sample};
use crate::flights::placement::{PlacementError, place};
use crate::flights::volume::{Volume, VolumeError};
use crate::random_source::RandomSource;
use crate::seed;
use course::Course;
use rayon::prelude::*;
use trajectory::Trajectory;
use vehicle::Vehicle;

/// Most samples of a flight.
pub const SAMPLES_MAX: usize = 1_000_000;
/// Longest flight before scaling, seconds: `duration_s * speed_scale / size_scale`.
pub const NOMINAL_S_MAX: f64 = 7200.0;
/// Fastest instant of a flight before scaling, metres per second; the paper's reach 4.4.
pub const NOMINAL_SPEED_MPS_MAX: f64 = 4.8;
/// Flights drawn in turn for one number until one is slow enough and fits the volume.
const ATTEMPTS_MAX: u64 = 100;

/// What to generate. The default is the paper's data: 15 s at 10 Hz in the paper's volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeneratorSettings {
    /// Number of flights.
    pub flights: usize,
    /// Flight `i` depends on the seed, on `i` and on the settings below, not on `flights`.
    pub seed: u64,
    /// Duration of a flight, seconds; it has `duration_s * rate_hz` samples, the first at 0.
    pub duration_s: f64,
    /// Samples per second.
    pub rate_hz: f64,
    /// Factor on speeds (mean 2.3 m/s at 1).
    pub speed_scale: f64,
    /// Factor on lengths. Accelerations (mean 2, up to 7 m/s^2 at 1) follow as
    /// `speed_scale^2 / size_scale`: give fast flights room.
    pub size_scale: f64,
    /// Standard deviation of the instant at which a sample is really taken, seconds. Recorded
    /// times stay even, as in logs. 0 gives the truth.
    pub timing_jitter_s: f64,
    /// Where the flights take place.
    pub volume: Volume,
}

impl Default for GeneratorSettings {
    fn default() -> Self {
        Self {
            flights: 200,
            seed: 1,
            duration_s: 15.0,
            rate_hz: 10.0,
            speed_scale: 1.0,
            size_scale: 1.0,
            timing_jitter_s: 0.0,
            volume: Volume::PAPER,
        }
    }
}

/// Why no flights can be generated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GeneratorError {
    /// A setting is NaN or beyond its limits.
    #[error("`{field}` = {} is not between {low} and {high}", brief(*value))]
    OutOfRange {
        /// Name of the setting.
        field: &'static str,
        /// Its value.
        value: f64,
        /// Lower limit.
        low: f64,
        /// Upper limit.
        high: f64,
    },
    /// The volume is empty.
    #[error("volume: {0}")]
    Volume(#[from] VolumeError),
    /// No attempt at this flight fits the volume.
    #[error("none of {ATTEMPTS_MAX} attempts at flight {index} fits the volume; the last: {last}")]
    NoFit {
        /// Number of the flight, from 0.
        index: usize,
        /// What stopped the last attempt.
        last: PlacementError,
    },
    /// Every attempt at this flight was too fast.
    #[error("all of {ATTEMPTS_MAX} attempts at flight {index} were too fast")]
    TooFast {
        /// Number of the flight, from 0.
        index: usize,
    },
}

impl GeneratorSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// The first one that makes no sense.
    pub fn check(&self) -> Result<(), GeneratorError> {
        let samples = (self.duration_s * self.rate_hz).round();
        let nominal_s = self.duration_s * self.speed_scale / self.size_scale;
        for (field, value, low, high) in [
            ("duration_s", self.duration_s, 1e-3, 1e5),
            ("rate_hz", self.rate_hz, 1e-2, 1e4),
            ("speed_scale", self.speed_scale, 1e-2, 1e2),
            ("size_scale", self.size_scale, 1e-2, 1e3),
            (
                "timing_jitter_s",
                self.timing_jitter_s,
                0.0,
                0.2 / self.rate_hz,
            ),
            (
                "duration_s * rate_hz",
                samples,
                SAMPLES_MIN as f64,
                SAMPLES_MAX as f64,
            ),
            (
                "duration_s * speed_scale / size_scale",
                nominal_s,
                0.0,
                NOMINAL_S_MAX,
            ),
        ] {
            if !(low..=high).contains(&value) {
                return Err(GeneratorError::OutOfRange {
                    field,
                    value,
                    low,
                    high,
                });
            }
        }
        Ok(self.volume.check()?)
    }
}

/// Generates `settings.flights` flights, on all cores; the result does not depend on their number.
///
/// # Errors
/// A setting makes no sense, or flights of this size do not fit the volume.
pub fn generate(settings: &GeneratorSettings) -> Result<Vec<Flight>, GeneratorError> {
    (0..settings.flights)
        .into_par_iter()
        .map(|index| generate_one(settings, index))
        .collect()
}

/// Generates flight `index`, counted from 0.
///
/// Its name tells its kind (`circle-tilted-0003`), and its source is its name: every generated
/// flight is a recording of its own.
///
/// # Errors
/// A setting makes no sense, or this flight does not fit the volume.
pub fn generate_one(settings: &GeneratorSettings, index: usize) -> Result<Flight, GeneratorError> {
    settings.check()?;
    let mut failure = GeneratorError::TooFast { index };
    for attempt in 0..ATTEMPTS_MAX {
        let ids = [seed::name_id("generator"), index as u64, attempt];
        let mut random = RandomSource::new(settings.seed, &ids);
        let Some(flight) = fly(settings, index, &mut random) else {
            continue;
        };
        match place(&flight, &settings.volume, random.bits()) {
            Ok(placed) => return Ok(placed),
            Err(last) => failure = GeneratorError::NoFit { index, last },
        }
    }
    Err(failure)
}

/// One flight about the origin; `None` if it is too fast at some instant.
fn fly(settings: &GeneratorSettings, index: usize, random: &mut RandomSource) -> Option<Flight> {
    // The whole flight is flown at nominal size, then lengths and time are stretched.
    let time_scale = settings.speed_scale / settings.size_scale;
    let nominal_s = settings.duration_s * time_scale;
    let vehicle = Vehicle::draw(random);
    let course = Course::draw(random, &vehicle, nominal_s);
    let name = format!("{}-{index:04}", course.kind());
    // Most recordings start in mid-flight.
    let lead_s = if random.chance(0.8) {
        random.uniform(0.2, 4.0)
    } else {
        0.2
    };
    let trajectory = Trajectory::fly(course, vehicle, lead_s + nominal_s, random);
    if trajectory.speed_mps_max() > NOMINAL_SPEED_MPS_MAX {
        return None;
    }
    let count = (settings.duration_s * settings.rate_hz).round() as usize;
    let samples = (0..count)
        .map(|k| {
            let time_s = k as f64 / settings.rate_hz;
            // Two standard deviations at most, so that samples keep their order.
            let jitter_s = settings.timing_jitter_s * random.normal().clamp(-2.0, 2.0);
            let state = trajectory.at(lead_s + (time_s + jitter_s) * time_scale);
            Sample {
                time_s,
                position_m: (state.position_m * settings.size_scale).into(),
                velocity_mps: (state.velocity_mps * settings.speed_scale).into(),
            }
        })
        .collect();
    Some(Flight {
        source: name.clone(),
        name,
        samples,
    })
}

#[cfg(test)]
mod tests;
