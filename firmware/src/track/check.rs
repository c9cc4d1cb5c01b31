//! Whether a track can have become so by itself.

use super::{State, Track, TrackField};
use crate::blob::Kind;
use crate::memoryless::Fix;
use crate::recursive::WHITENED_MAX;
use crate::recursive::candidate::MISSES_MAX;
use crate::recursive::target::Target;
use crate::sensor::Sensor;
use crate::settings::Correction;

/// Where single precision stops to count.
const COUNT_MAX: f32 = 16_777_216.0;
/// More seconds, and more metres per second, than any track has.
const VAST: f32 = 1e9;

impl Track {
    /// Whether a track can be so.
    pub(super) fn check(&self) -> Result<(), TrackField> {
        let correct =
            self.settings.correction == Correction::Polar || self.kind() == Kind::Memoryless;
        if !correct || self.settings.left_out(self.kind()).is_some() {
            return Err(TrackField::Settings);
        }
        if self.rng.state() == [0; 4] {
            return Err(TrackField::Generator);
        }
        let latest_us = self.clock.latest_us();
        let follows = |time_us: u64| latest_us.is_some_and(|latest_us| time_us <= latest_us);
        if let Some(latest) = &self.latest {
            let canonical = latest.canonical() == *latest;
            if latest.check().is_err() || !canonical || !follows(latest.time_us) {
                return Err(TrackField::Measurement);
            }
        }
        match &self.state {
            State::Memoryless(past) => {
                let [latest, before] = [past.latest, past.before];
                let fixes = [latest, before].into_iter().flatten();
                if !fixes.clone().all(|fix| fix.is_sound()) {
                    return Err(TrackField::Fix);
                }
                let in_order = match (latest, before) {
                    (Some(latest), Some(before)) => before.time_us <= latest.time_us,
                    (None, Some(_)) => false,
                    _ => true,
                };
                if !(in_order && fixes.clone().all(|fix| follows(fix.time_us))) {
                    return Err(TrackField::Clock);
                }
            }
            State::Recursive(belief) => {
                let target = belief.target.iter();
                let candidate = belief.candidate.iter().map(|c| &c.target);
                for target in target.clone().chain(candidate) {
                    target.check()?;
                    if !follows(target.time_us) {
                        return Err(TrackField::Clock);
                    }
                }
                if target.clone().any(|t| Some(t.time_us) != latest_us) {
                    return Err(TrackField::Clock);
                }
                let candidate = belief.candidate.as_ref();
                if candidate.is_some_and(|c| c.misses >= MISSES_MAX) {
                    return Err(TrackField::Candidate);
                }
            }
        }
        Ok(())
    }
}

impl Fix {
    /// Whether a step or a coast can have left it.
    fn is_sound(&self) -> bool {
        let c = |i: usize, j: usize| self.covariance[(i, j)];
        let lower = core::array::from_fn(|i| core::array::from_fn(|j| c(i.max(j), i.min(j))));
        let symmetric = |i: usize, j: usize| {
            let scale = crate::kernel::sqrt(c(i, i)) * crate::kernel::sqrt(c(j, j));
            (c(i, j) - c(j, i)).abs() <= 1e-5 * scale
        };
        self.position.iter().all(|x| x.is_finite())
            && crate::cholesky::is_definite::<3>(&lower)
            && symmetric(0, 1)
            && symmetric(0, 2)
            && symmetric(1, 2)
    }
}

impl Target {
    /// Whether a step or a coast can have left it.
    fn check(&self) -> Result<(), TrackField> {
        let mut settled = *self;
        let settles = settled.settle() && settled.covariance == self.covariance;
        if !settles || Sensor::at(self.sensor_m).check().is_err() {
            return Err(TrackField::Target);
        }
        let m = &self.memory;
        let within = |values: &[f32], least: f32, most: f32| {
            values.iter().all(|value| (least..=most).contains(value))
        };
        let remembered = within(&m.innovation, -WHITENED_MAX, WHITENED_MAX)
            && within(&m.drift, -6.0, 6.0)
            && within(&m.squares, 0.0, 30.0)
            && within(&m.ln_sigmas, -40.0, 40.0)
            && within(&[m.coast_s, m.age_s], 0.0, VAST)
            && within(m.velocity_means.as_flattened(), -VAST, VAST)
            && within(&m.notes, -1.01, 1.01)
            && within(&m.counts, 0.0, COUNT_MAX)
            && self.foresight.is_sound(self.time_us);
        remembered.then_some(()).ok_or(TrackField::Memory)
    }
}
