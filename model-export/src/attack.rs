//! An attack on the firmware's tracker: any finite input, any time, plausible and absurd sigmas,
//! channels that are missing, sensors anywhere, at random and by hill climbing towards a covariance that is none.
//!
//! A script of calls is run from a fresh track; a part of it is then changed, and the change kept if
//! the worst covariance of the run came nearer to being singular.

use crate::random_source::RandomSource;
use crate::seed::name_id;
use crate::soundness::{is_definite, is_finite, is_true};
use bnkf::blob::Blob;
use bnkf::call::Call;
use bnkf::clock::AHEAD_MAX_US;
use bnkf::estimate::{Estimate, Mode};
use bnkf::{Measurement, Sensed, Sensor, Settings, StepError, Tracker, TrackerError};
use rayon::prelude::*;
use serde::Serialize;

/// Calls of a script.
const CALLS: usize = 64;
/// Changes to a script before another one is drawn.
const CLIMB: usize = 40;
/// Monte Carlo passes at most: what is attacked is the filter.
const PASSES_MAX: u16 = 2;

/// What happened, summed over calls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Found {
    /// Calls of the tracker.
    pub calls: u64,
    /// Estimates that were checked.
    pub estimates: u64,
    /// Calls that were refused with an error.
    pub refused: u64,
    /// Estimates with a number that is NaN or infinite.
    pub not_finite: u64,
    /// Covariances that are not symmetric positive definite.
    pub not_definite: u64,
    /// Estimates whose mode or time is not what happened.
    pub untrue: u64,
    /// Estimates outside what the model was trained for.
    pub outside: u64,
    /// Measurements rejected.
    pub rejected: u64,
    /// Tracks that another took over, or that were started anew.
    pub restarted: u64,
    /// Smallest pivot of a covariance whose variances are scaled to one.
    pub worst_pivot: f64,
}

impl Found {
    fn join(self, other: Self) -> Self {
        Self {
            calls: self.calls + other.calls,
            estimates: self.estimates + other.estimates,
            refused: self.refused + other.refused,
            not_finite: self.not_finite + other.not_finite,
            not_definite: self.not_definite + other.not_definite,
            untrue: self.untrue + other.untrue,
            outside: self.outside + other.outside,
            rejected: self.rejected + other.rejected,
            restarted: self.restarted + other.restarted,
            worst_pivot: self.worst_pivot.min(other.worst_pivot),
        }
    }

    /// Whether nothing false left the tracker.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.estimates > 0 && self.not_finite + self.not_definite + self.untrue == 0
    }
}

/// One call of a script: what it does beside the time since the last one.
#[derive(Clone, Copy, Debug)]
struct Move {
    after_us: u64,
    back: bool,
    coast: bool,
    /// Whether forecasts and a likelihood are asked for as well.
    asks: bool,
    measured: [Option<Sensed>; 4],
    sensor: Sensor,
}

/// Attacks a blob's tracker with about `calls` calls.
///
/// # Errors
/// The blob's own settings do not fit it.
pub fn attack(blob: Blob<'_>, calls: u64, seed: u64) -> Result<Found, TrackerError> {
    let mut settings = Settings::of(&blob);
    settings.inference = settings.inference.at_most(PASSES_MAX);
    Tracker::new(blob, settings)?;
    let climbs = calls.div_ceil((CALLS * CLIMB) as u64);
    let found = (0..climbs)
        .into_par_iter()
        .filter_map(|index| {
            let tracker = Tracker::new(blob, settings).ok()?;
            let mut random = RandomSource::new(seed, &[name_id("attack"), index]);
            Some(climb(tracker, &mut random))
        })
        .reduce(
            || Found {
                worst_pivot: 1.0,
                ..Found::default()
            },
            Found::join,
        );
    Ok(found)
}

fn climb(mut tracker: Tracker<'_>, random: &mut RandomSource) -> Found {
    let wildness = random.unit();
    let mut script: Vec<Move> = (0..CALLS).map(|_| draw(random, wildness)).collect();
    let mut total = run(&mut tracker, &script);
    let mut best = total.worst_pivot;
    for _ in 1..CLIMB {
        let mut changed = script.clone();
        for _ in 0..1 + random.below(6) {
            let at = random.below(CALLS);
            changed[at] = draw(random, wildness);
        }
        let found = run(&mut tracker, &changed);
        if found.worst_pivot <= best {
            best = found.worst_pivot;
            script = changed;
        }
        total = total.join(found);
    }
    total
}

fn run(tracker: &mut Tracker<'_>, script: &[Move]) -> Found {
    tracker.reset();
    let mut found = Found {
        worst_pivot: 1.0,
        ..Found::default()
    };
    let mut time_us = 1_000_000_000_000_u64;
    let mut before: Option<Estimate> = None;
    for step in script {
        let at_us = if step.back {
            time_us.saturating_sub(step.after_us)
        } else {
            time_us.saturating_add(step.after_us)
        };
        let [elevation, azimuth, range, range_rate] = step.measured;
        let call = if step.coast {
            Call::Coast(at_us)
        } else {
            Call::Step(Measurement {
                time_us: at_us,
                range,
                elevation,
                azimuth,
                range_rate,
                sensor: step.sensor,
            })
        };
        found.calls += 1;
        let estimate = match call.answer(tracker) {
            Ok(estimate) => estimate,
            Err(error) => {
                found.refused += 1;
                if error == StepError::Lost {
                    before = None;
                }
                continue;
            }
        };
        time_us = at_us;
        found.estimates += 1;
        found.not_finite += u64::from(!is_finite(&estimate));
        found.not_definite += u64::from(!is_definite(&estimate));
        found.untrue += u64::from(!is_true(&call, &estimate, before.as_ref()));
        found.outside += u64::from(estimate.outside);
        found.rejected += u64::from(estimate.mode == Mode::Rejected);
        found.restarted += u64::from(estimate.mode == Mode::Restarted);
        found.worst_pivot = found.worst_pivot.min(smallest_pivot(&estimate));
        before = Some(estimate);
        if step.asks {
            ask(tracker, &call, step, &mut found);
        }
    }
    found
}

/// Asks where the target will be and how well the last measurement fits: nothing false may come of that
/// either.
fn ask(tracker: &mut Tracker<'_>, call: &Call, step: &Move, found: &mut Found) {
    let ahead_us = step.after_us % (AHEAD_MAX_US / 2);
    let times_us = [0, ahead_us, 2 * ahead_us].map(|us| call.time_us().saturating_add(us));
    found.calls += 1;
    match tracker.forecasts(&times_us) {
        Ok(forecasts) => {
            for (forecast, time_us) in forecasts.iter().zip(times_us) {
                let is_then = forecast.mode == Mode::Coasting && forecast.time_us == time_us;
                found.estimates += 1;
                found.not_finite += u64::from(!is_finite(forecast));
                found.not_definite += u64::from(!is_definite(forecast));
                found.untrue += u64::from(!is_then);
            }
        }
        Err(_) => found.refused += 1,
    }
    if let Call::Step(measurement) = call {
        found.calls += 1;
        match tracker.likelihood(measurement) {
            Ok(told) => {
                let innovation = told.innovation.iter().flatten();
                let numbers = innovation.chain([&told.nis, &told.ln_likelihood]);
                found.not_finite += u64::from(!numbers.into_iter().all(|x| x.is_finite()));
                found.untrue += u64::from(told.nis < 0.0 || told.degrees > 4);
            }
            Err(_) => found.refused += 1,
        }
    }
}

/// Smallest pivot of the largest covariance there is, its variances scaled to one.
fn smallest_pivot(estimate: &Estimate) -> f64 {
    let motion = estimate.motion.as_ref();
    let size = if motion.is_some() { 9 } else { 3 };
    let entry = |i: usize, j: usize| {
        f64::from(motion.map_or_else(
            || estimate.covariance_m2[i % 3][j % 3],
            |motion| motion.covariance[i][j],
        ))
    };
    let mut factor = [[0.0; 9]; 9];
    let mut smallest = 1.0_f64;
    for row in 0..size {
        for column in 0..=row {
            let mut rest = entry(row, column) / (entry(row, row) * entry(column, column)).sqrt();
            for k in 0..column {
                rest -= factor[row][k] * factor[column][k];
            }
            factor[row][column] = if row == column {
                smallest = smallest.min(rest);
                rest.max(1e-30).sqrt()
            } else {
                rest / factor[column][column]
            };
        }
    }
    smallest
}

fn draw(random: &mut RandomSource, wildness: f64) -> Move {
    let after_us = match random.below(8) {
        0 => 0,
        1 => 1,
        2 => 10_f64.powf(random.uniform(0.0, 9.0)) as u64,
        3 if random.chance(0.1) => random.bits(),
        _ => 100_000,
    };
    Move {
        after_us,
        back: random.chance(0.02),
        coast: random.chance(0.25),
        asks: random.chance(0.05),
        measured: core::array::from_fn(|channel| {
            (!random.chance(0.1)).then(|| sensed(random, channel, wildness))
        }),
        sensor: sensor(random, wildness),
    }
}

/// In the origin, one of two that take turns, on a vehicle, and anywhere at any speed.
fn sensor(random: &mut RandomSource, wildness: f64) -> Sensor {
    let wild = random.unit() * wildness;
    match random.below(4) {
        _ if wild > 0.98 => Sensor {
            position_m: core::array::from_fn(|_| f32::from_bits(random.bits() as u32)),
            velocity_mps: core::array::from_fn(|_| f32::from_bits(random.bits() as u32)),
        },
        _ if wild > 0.8 => {
            let mut anything =
                |most: f64| (random.sign() * most * 10_f64.powf(random.uniform(-8.0, 0.0))) as f32;
            Sensor {
                position_m: core::array::from_fn(|_| anything(1e6)),
                velocity_mps: core::array::from_fn(|_| anything(1e4)),
            }
        }
        0 => Sensor::at([40.0, 0.0, 0.0]),
        1 => Sensor {
            position_m: core::array::from_fn(|_| random.uniform(-20.0, 20.0) as f32),
            velocity_mps: core::array::from_fn(|_| random.uniform(-15.0, 15.0) as f32),
        },
        _ => Sensor::ORIGIN,
    }
}

/// A value and a sigma of a channel: elevation, azimuth, range, range-rate.
fn sensed(random: &mut RandomSource, channel: usize, wildness: f64) -> Sensed {
    // Home, then anything that is taken, then any bits at all.
    let wild = random.unit() * wildness;
    let value = if wild > 0.97 {
        f32::from_bits(random.bits() as u32)
    } else {
        let (centre, spread, most) = [
            (0.4, 0.01, std::f64::consts::PI),
            (0.5, 0.01, 100.0),
            (33.0, 0.2, 1e6),
            (0.0, 1.0, 1e4),
        ][channel];
        if wild > 0.3 {
            (random.sign() * most * 10_f64.powf(random.uniform(-8.0, 0.0))) as f32
        } else {
            (centre + spread * random.normal()) as f32
        }
    };
    let sigma = if wild > 0.98 {
        f32::from_bits(random.bits() as u32)
    } else {
        let (usual, least, most): (f64, f64, f64) = [
            (0.005, 1e-6, 1.0),
            (0.005, 1e-6, 1.0),
            (0.1, 1e-4, 1e5),
            (0.05, 1e-4, 1e4),
        ][channel];
        if random.chance(wildness) {
            random.uniform(least.ln(), most.ln()).exp() as f32
        } else {
            usual as f32
        }
    };
    Sensed { value, sigma }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shipped_blob_survives() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/");
        for name in ["recursive", "recursive-counter-uas", "bnkf", "bnkfe"] {
            let bytes = std::fs::read(format!("{folder}{name}.bnkf")).unwrap();
            let found = attack(Blob::parse(&bytes).unwrap(), 20_000, 3).unwrap();
            assert!(found.passed(), "{name}: {found:?}");
            assert!(found.calls >= 20_000 && found.refused > 0, "{found:?}");
            // The climb gets to where the margin is, and no further.
            assert!(found.worst_pivot > 0.0, "{name}: {found:?}");
        }
    }

    #[test]
    fn a_falsehood_does_not_pass() {
        let clean = Found {
            estimates: 1,
            ..Found::default()
        };
        assert!(clean.passed() && !Found::default().passed());
        for found in [
            Found {
                not_finite: 1,
                ..clean
            },
            Found {
                not_definite: 1,
                ..clean
            },
            Found { untrue: 1, ..clean },
        ] {
            assert!(!found.join(clean).passed());
        }
    }
}
