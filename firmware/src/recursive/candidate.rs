//! A second track beside the first: made of measurements that the first one rejects.
//!
//! One rejected measurement is an outlier; several that agree with each other are a target. The
//! candidate starts from a rejected measurement and takes in those of the following ones that fit
//! it. When enough have, and the first track has had none meanwhile, it takes over. The old track
//! then is the candidate: it may have been right, and it comes back if measurements that the new
//! one rejects agree with it and it has the longer record. So scattered false alarms never steal a
//! track, and a ghost that did does not keep it.
//!
//! A candidate is predicted without the network, so a rejected measurement costs little more than
//! one that is used.

use super::population::{Base, Population};
use super::track::Track;
use crate::clock::seconds_between;
use crate::measurement::{Measurement, Vectors};

/// Measurements that must agree before a candidate takes over, its first one included.
pub const AGREEING: u8 = 3;
/// Normalised innovation squared up to which a measurement agrees with a candidate: by chance
/// (chi-square, four degrees of freedom) a true one exceeds it once in a thousand.
const AGREEMENT_NIS: f32 = 18.5;
/// Measurements in a row that do not agree after which a candidate is given up.
const MISSES_MAX: u8 = 2;
/// Time without agreement after which a candidate is given up, s.
const AGE_MAX_S: f32 = 5.0;
/// Deviations of the population's range that a candidate's position may be unsure by. Beyond it
/// nearly anything would agree with it.
const UNSURE_MAX: f32 = 2.0;

/// A track that may take over.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    track: Track,
    agreeing: u8,
    misses: u8,
}

/// What a rejected measurement did to the candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The candidate is too old, too unsure or too often contradicted to go on with.
    Over,
    /// Nothing is certain yet.
    Wait,
    /// The candidate has had enough agreement.
    Agreed,
}

impl Candidate {
    /// A candidate from its first measurement, if a track can start from it.
    pub fn start(measurement: &Measurement, prior: &Population<f32>) -> Option<Self> {
        Some(Self {
            track: Track::start(measurement, prior).ok()?,
            agreeing: 1,
            misses: 0,
        })
    }

    /// A track that was replaced.
    pub fn deposed(track: Track) -> Self {
        Self {
            track,
            agreeing: 0,
            misses: 0,
        }
    }

    /// The track.
    pub fn track(&self) -> &Track {
        &self.track
    }

    /// Compares a measurement with the candidate, and takes it in if it agrees.
    pub fn meet(
        &mut self,
        measurement: &Measurement,
        base: &Base<f32>,
        population: &Population<f32>,
    ) -> Verdict {
        if seconds_between(self.track.time_us, measurement.time_us) > AGE_MAX_S {
            return Verdict::Over;
        }
        let mut moved = self.track;
        moved.drift(measurement.time_us, base);
        let unsure_max = UNSURE_MAX * population.range_sigma_m;
        if moved.position_variance() > unsure_max * unsure_max {
            return Verdict::Over;
        }
        let vectors = Vectors::from(measurement);
        let agreed = match moved.corrected(&vectors, [1.0; 3]) {
            Some((corrected, whitened)) if corrected.nis < AGREEMENT_NIS => {
                moved.take(&corrected);
                moved.memory.measured(whitened, &vectors);
                moved.settle()
            }
            _ => false,
        };
        if !agreed {
            self.misses += 1;
            return if self.misses < MISSES_MAX {
                Verdict::Wait
            } else {
                Verdict::Over
            };
        }
        self.track = moved;
        self.misses = 0;
        self.agreeing = self.agreeing.saturating_add(1);
        if self.agreeing >= AGREEING {
            Verdict::Agreed
        } else {
            Verdict::Wait
        }
    }
}
