//! A Rao-Blackwellised particle filter: range by particles, the rest by Kalman filters.
//!
//! At high noise all the curvature is in the range: nothing measures it but the way bearings and
//! range-rates play together over seconds, and a Gaussian is a poor answer to that. Given the
//! range the problem is nearly linear. So each particle is a narrow hypothesis of the range with
//! its own extended Kalman filter over the full state, weighted by the likelihood of the readings
//! (a mixture Kalman filter: Chen and Liu 2000). There is no proposal to get wrong, and few
//! particles suffice; a bootstrap filter over nine dimensions would need millions.
//!
//! Hypotheses are never made narrower than the curvature asks for. Beyond that they buy nothing and
//! cost soundness: a drone that moves more than the model expects drags all weight to the edge of
//! the particles, and what was their spread is then missing from the covariance for good. Where the
//! readings hold the range well, as at low noise, all particles are one Kalman filter.

use bnkf::measurement::Channel;
use bnkf_model_export::radar::reading::Reading;
use bnkf_model_export::random_source::RandomSource;
use bnkf_model_export::seed;
use nalgebra::{SVector, Vector3};

use super::ahead::{Ahead, parts_s, try_forecasts};
use super::clock::Clock;
use super::correction::{Correction, Innovation};
use super::discrete::Discrete;
use super::gaussian::Gaussian;
use super::mixture::{Component, effective_number, moments, nis, normalise, reweigh};
use super::motion::Motion;
use super::prior::{Normal, PopulationPrior};
use super::sensor::Observation;
use super::singer::Singer;
use crate::filter::{Filter, FilterError, Forecasts, HORIZONS_US, Nis, PositionEstimate, Start};

/// Number of particles.
pub const PARTICLES: usize = 40;

/// Standard deviation of a hypothesis of the range, as a part of the range: within it the
/// measurement function is as good as linear. Where the readings hold the range worse, at high
/// noise to a fifth of it, this is still above the distance from one particle to the next.
const LINEAR_PART: f64 = 0.05;

/// The means reach this many of their standard deviations to either side.
const REACH: f64 = 3.5;

/// Resampling starts when the effective number falls below this part of the particles.
const EFFECTIVE_PART_MIN: f64 = 0.25;

/// Largest part of a particle's own standard deviation of the range by which resampled copies move
/// apart. Their covariance shrinks in return, so the mixture's moments stay what they were.
const JITTER_PART_MAX: f64 = 0.5;

/// The filter; its draws depend on the seed alone.
#[derive(Clone, Debug)]
pub struct RaoBlackwell {
    motion: Singer,
    prior: PopulationPrior,
    seed: u64,
    random: RandomSource,
    clock: Option<Clock>,
    particles: Vec<Component<9>>,
    /// Scratch of a step, kept to spare the allocation.
    innovations: Vec<Innovation>,
    resampled: Vec<Component<9>>,
    step: Option<Discrete<9>>,
    ahead: Ahead<9>,
}

impl RaoBlackwell {
    /// A filter that has not been started.
    pub fn new(motion: Singer, prior: PopulationPrior, seed: u64) -> Self {
        Self {
            motion,
            prior,
            seed,
            random: stream(seed),
            clock: None,
            particles: Vec::with_capacity(PARTICLES),
            innovations: Vec::with_capacity(PARTICLES),
            resampled: Vec::with_capacity(PARTICLES),
            step: None,
            ahead: Ahead::default(),
        }
    }

    /// How many equally likely particles the present ones amount to.
    pub fn effective_particles(&self) -> f64 {
        effective_number(&self.particles)
    }

    fn estimate(&self, nis: Option<Nis>) -> Result<PositionEstimate, FilterError> {
        moments(&self.particles, |i| self.particles[i].probability).position_estimate(nis)
    }

    fn correct(&mut self, observation: &Observation) -> Result<Nis, FilterError> {
        self.innovations.clear();
        for particle in &mut self.particles {
            let (after, innovation) = Correction::Extended.apply(&particle.state, observation)?;
            particle.state = after;
            self.innovations.push(innovation);
        }
        let nis = nis(&self.particles, &self.innovations)?;
        reweigh(&mut self.particles, &self.innovations)?;
        if self.effective_particles() < EFFECTIVE_PART_MIN * PARTICLES as f64 {
            self.resample(&observation.position_m)?;
        }
        Ok(nis)
    }

    /// Systematic resampling; copies of a particle move apart along the range.
    fn resample(&mut self, radar_m: &Vector3<f64>) -> Result<(), FilterError> {
        self.resampled.clear();
        let share = 1.0 / PARTICLES as f64;
        let mut mark = share * self.random.unit();
        let mut reached = 0.0;
        let mut marked = 0;
        for (i, particle) in self.particles.iter().enumerate() {
            reached += particle.probability;
            let last = i + 1 == self.particles.len();
            if !(last || mark < reached) {
                continue;
            }
            let (core, apart) = split(&particle.state, radar_m);
            // The last one takes what rounding left over.
            while marked < PARTICLES && (last || mark < reached) {
                let state = Gaussian {
                    mean: core.mean + apart * self.random.normal(),
                    covariance: core.covariance,
                };
                self.resampled.push(Component {
                    probability: share,
                    state,
                });
                mark += share;
                marked += 1;
            }
        }
        core::mem::swap(&mut self.particles, &mut self.resampled);
        Ok(())
    }
}

/// A belief as a narrower one whose mean moves by a standard normal number times a vector: the
/// range from the radar is split, and the rest follows it by its covariance with the range.
fn split(belief: &Gaussian<9>, radar_m: &Vector3<f64>) -> (Gaussian<9>, SVector<f64, 9>) {
    let p = belief.position_m() - radar_m;
    let range_m = p.norm();
    let cross = belief.covariance.fixed_columns::<3>(0) * p / range_m.max(f64::MIN_POSITIVE);
    let variance = cross.fixed_rows::<3>(0).dot(&p) / range_m.max(f64::MIN_POSITIVE);
    let kept = (LINEAR_PART * range_m).powi(2);
    let part = (1.0 - kept / variance).min(JITTER_PART_MAX * JITTER_PART_MAX);
    // Not so for a variance of zero, whose part is not a number.
    if part > 0.0 {
        let apart = cross * (part / variance).sqrt();
        let covariance = belief.covariance - apart * apart.transpose();
        return (
            Gaussian {
                covariance,
                ..*belief
            },
            apart,
        );
    }
    (*belief, SVector::zeros())
}

fn stream(seed: u64) -> RandomSource {
    RandomSource::new(seed, &[seed::name_id("rao-blackwell")])
}

impl Filter for RaoBlackwell {
    /// Places the particles evenly over the range, weighted by its density.
    fn start(&mut self, start: &Start<'_>) -> Result<PositionEstimate, FilterError> {
        let observation = Observation::from(start.reading);
        observation.requires(&[Channel::Azimuth])?;
        let range = self.prior.fused_range(&observation);
        let own = range.sigma.min(LINEAR_PART * range.mean.abs());
        let spread = (range.sigma.powi(2) - own.powi(2)).sqrt();
        self.random = stream(self.seed);
        self.particles.clear();
        for i in 0..PARTICLES {
            let deviation = REACH * (2.0 * i as f64 / (PARTICLES - 1) as f64 - 1.0);
            let hypothesis = Normal {
                mean: range.mean + deviation * spread,
                sigma: own,
            };
            // A target is in front of the radar.
            if hypothesis.mean > 0.0 {
                let kinematic = self.prior.belief_at_range(&observation, &hypothesis);
                self.particles.push(Component {
                    probability: (-0.5 * deviation * deviation).exp(),
                    state: self.motion.initial(&kinematic),
                });
            }
        }
        normalise(&mut self.particles)?;
        self.clock = Some(Clock::new(start.reading.time_us));
        self.estimate(None)
    }

    fn step(
        &mut self,
        time_us: u64,
        reading: Option<&Reading>,
    ) -> Result<PositionEstimate, FilterError> {
        let clock = self.clock.as_mut().ok_or(FilterError::NotStarted)?;
        let step = Discrete::kept(&mut self.step, &self.motion, clock.advance_s(time_us)?);
        for particle in &mut self.particles {
            particle.state = particle.state.predicted(step);
        }
        match reading {
            Some(reading) => {
                let nis = self.correct(&Observation::from(reading).clear_of_the_zenith())?;
                self.estimate(Some(nis))
            }
            None => self.estimate(None),
        }
    }

    /// The model is linear, so the particles' moments move as each of them would.
    fn forecast(&mut self, times_us: &[u64; HORIZONS_US.len()]) -> Result<Forecasts, FilterError> {
        let clock = self.clock.ok_or(FilterError::NotStarted)?;
        let parts_s = parts_s(clock, times_us)?;
        let mut state = moments(&self.particles, |i| self.particles[i].probability);
        try_forecasts(|horizon| {
            state = state.predicted(self.ahead.step(horizon, &self.motion, parts_s[horizon]));
            state.position_estimate(None)
        })
    }
}

#[cfg(test)]
mod tests;
