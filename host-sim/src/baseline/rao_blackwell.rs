//! A Rao-Blackwellised particle filter: range by particles, the rest by Kalman filters.
//!
//! At high noise all the curvature is in the range: nothing measures it but the way bearings and
//! range-rates play together over seconds, and a Gaussian is a poor answer to that. Given the
//! range the problem is nearly linear. So each particle is a narrow hypothesis of the range with
//! its own extended Kalman filter over the full state, weighted by the likelihood of the readings
//! (a mixture Kalman filter: Chen and Liu 2000). There is no proposal to get wrong, and few
//! particles suffice; a bootstrap filter over nine dimensions would need millions.

use bnkf_model_export::random_source::RandomSource;
use bnkf_model_export::reading::Reading;
use bnkf_model_export::seed;
use nalgebra::SVector;

use super::clock::Clock;
use super::correction::{Correction, Innovation};
use super::discrete::Discrete;
use super::gaussian::Gaussian;
use super::mixture::{Component, effective_number, moments, nis, normalise, reweigh};
use super::motion::Motion;
use super::prior::{Normal, PopulationPrior};
use super::sensor::Observation;
use super::singer::Singer;
use crate::filter::{Filter, FilterError, Nis, PositionEstimate, Start};

/// Number of particles.
pub const PARTICLES: usize = 40;

/// Part of the first range's standard deviation that the particles' means carry; a particle keeps
/// sqrt(1 - 0.95^2) = 0.31 of it, twice the distance to its neighbour.
const RANGE_PART: f64 = 0.95;

/// The means reach this many of their standard deviations to either side.
const REACH: f64 = 3.5;

/// Resampling starts when the effective number falls below this part of the particles.
const EFFECTIVE_PART_MIN: f64 = 0.25;

/// Part of a particle's own standard deviation by which resampled copies move apart. Their
/// covariance shrinks in return, so the mixture's moments stay what they were.
const JITTER_PART: f64 = 0.5;

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
            self.resample()?;
        }
        Ok(nis)
    }

    /// Systematic resampling; copies of a particle are drawn from its own Gaussian.
    fn resample(&mut self) -> Result<(), FilterError> {
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
            let covariance = particle.state.covariance;
            let root = covariance
                .cholesky()
                .ok_or(FilterError::NotPositiveDefinite)?
                .unpack();
            // The last one takes what rounding left over.
            while marked < PARTICLES && (last || mark < reached) {
                let draw = SVector::<f64, 9>::from_fn(|_, _| self.random.normal());
                let state = Gaussian {
                    mean: particle.state.mean + root * draw * JITTER_PART,
                    covariance: covariance * (1.0 - JITTER_PART * JITTER_PART),
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

fn stream(seed: u64) -> RandomSource {
    RandomSource::new(seed, &[seed::name_id("rao-blackwell")])
}

impl Filter for RaoBlackwell {
    /// Places the particles evenly over the range, weighted by its density.
    fn start(&mut self, start: &Start<'_>) -> Result<PositionEstimate, FilterError> {
        let observation = Observation::from(start.reading);
        let range = self.prior.fused_range(&observation);
        let spread = RANGE_PART * range.sigma;
        let own = (1.0 - RANGE_PART * RANGE_PART).sqrt() * range.sigma;
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
                let nis = self.correct(&Observation::from(reading))?;
                self.estimate(Some(nis))
            }
            None => self.estimate(None),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baseline::prior::tests::PRIOR;
    use crate::baseline::sensor::{cartesian, expected, residual};
    use nalgebra::{Matrix3, Vector3, Vector4};

    const MOTION: Singer = Singer {
        acceleration_sigma_mps2: 1.5,
        correlation_time_s: 1.0,
        damping_per_s: 0.5,
        q_m2_s3: 0.3,
    };

    fn reading(k: u64, z: &Vector4<f64>, sigma: &Vector4<f64>) -> Reading {
        Reading {
            time_us: k * 200_000,
            elevation_rad: z[0],
            azimuth_rad: z[1],
            range_m: z[2],
            range_rate_mps: z[3],
            sigma_elevation_rad: sigma[0],
            sigma_azimuth_rad: sigma[1],
            sigma_range_m: sigma[2],
            sigma_range_rate_mps: sigma[3],
        }
    }

    fn started(first: &Reading) -> RaoBlackwell {
        let (p, v) = (Vector3::zeros(), Vector3::zeros());
        let start = Start {
            reading: first,
            true_position_m: p,
            true_velocity_mps: v,
        };
        let mut filter = RaoBlackwell::new(MOTION, PRIOR, 5);
        assert!(filter.start(&start).is_ok());
        filter
    }

    /// The same posterior by brute force: trajectories drawn from population and motion, weighted
    /// by every reading. High noise, fast crossing target, 1 s.
    #[test]
    fn equals_importance_sampling_of_whole_trajectories() {
        let sigma = Vector4::new(0.1, 0.1, 100.0, 0.5);
        let mut random = RandomSource::new(21, &[]);
        let readings: Vec<Reading> = (0..=5)
            .map(|k| {
                let p =
                    Vector3::new(20.0, -14.0, 13.0) + Vector3::new(1.5, 3.0, 0.3) * 0.2 * k as f64;
                let z = expected(&p, &Vector3::new(1.5, 3.0, 0.3));
                reading(k, &(z + sigma.map(|s| s * random.normal())), &sigma)
            })
            .collect();

        let mut filter = started(&readings[0]);
        let mut estimate = None;
        for reading in &readings[1..] {
            estimate = filter.step(reading.time_us, Some(reading)).ok();
        }
        let estimate = estimate.unwrap();

        let draws = 200_000;
        let step = Discrete::new(&MOTION, 0.2);
        let root = step.noise.cholesky().unwrap().unpack();
        let first = Observation::from(&readings[0]);
        let range = PRIOR.fused_range(&first);
        let elevation = PRIOR.elevation_rad.fused(first.z[0], sigma[0]);
        let (mut total, mut squares) = (0.0, 0.0);
        let (mut mean, mut second) = (Vector3::zeros(), Matrix3::zeros());
        for _ in 0..draws {
            // The first reading has done its part: only its range-rate is left to weigh.
            let p = cartesian(
                elevation.mean + elevation.sigma * random.normal(),
                first.z[1] + sigma[1] * random.normal(),
                range.mean + range.sigma * random.normal(),
            );
            let mut x = SVector::<f64, 9>::from_fn(|_, _| random.normal());
            x.fixed_rows_mut::<3>(0).copy_from(&p);
            for (axis, scale) in [1.7, 1.7, 0.6, 1.5, 1.5, 1.5].into_iter().enumerate() {
                x[3 + axis] *= scale;
            }
            let log_density = |x: &SVector<f64, 9>, reading: &Reading| {
                let h = expected(&x.fixed_rows::<3>(0).into(), &x.fixed_rows::<3>(3).into());
                let e = residual(&Observation::from(reading).z, &h).component_div(&sigma);
                -0.5 * (e.norm_squared() - e[2] * e[2])
            };
            let v = x.fixed_rows::<3>(3).into();
            let rate = (first.z[3] - expected(&p, &v)[3]) / sigma[3];
            let mut log_weight = -0.5 * rate * rate;
            for reading in &readings[1..] {
                x = step.transition * x + root * SVector::<f64, 9>::from_fn(|_, _| random.normal());
                log_weight += log_density(&x, reading);
            }
            let weight = log_weight.exp();
            let p = x.fixed_rows::<3>(0).into_owned();
            total += weight;
            squares += weight * weight;
            mean += p * weight;
            second += p * p.transpose() * weight;
        }
        let mean = mean / total;
        let covariance = second / total - mean * mean.transpose();
        // Standard error of a mean over as many equal weights as these are worth.
        let worth = total * total / squares;
        assert!(
            worth > 1000.0,
            "the brute force itself degenerated: {worth}"
        );
        for axis in 0..3 {
            let sd = covariance[(axis, axis)].sqrt();
            let off = (estimate.position_m[axis] - mean[axis]) / sd;
            assert!(
                off.abs() < 4.0 / worth.sqrt() + 0.02,
                "axis {axis}: off by {off} sd"
            );
            let ratio = estimate.covariance_m2[(axis, axis)].sqrt() / sd;
            assert!(
                (ratio - 1.0).abs() < 3.0 / worth.sqrt() + 0.03,
                "axis {axis}: {ratio}"
            );
        }
    }

    #[test]
    fn resampling_keeps_the_moments_and_the_seed_decides() {
        let sigma = Vector4::new(0.1, 0.1, 100.0, 1.0);
        let z = expected(&Vector3::new(20.0, -14.0, 13.0), &Vector3::zeros());
        let mut filter = started(&reading(0, &z, &sigma));
        let before = filter.estimate(None).unwrap();
        let mut twin = filter.clone();
        assert!(filter.resample().is_ok() && twin.resample().is_ok());
        assert_eq!(filter.particles, twin.particles);
        assert!((filter.effective_particles() - PARTICLES as f64).abs() < 1e-9);
        let after = filter.estimate(None).unwrap();
        // Forty draws: a standard error of 0.08 sd in a mean, 0.11 in a standard deviation.
        for axis in 0..3 {
            let sd = before.covariance_m2[(axis, axis)].sqrt();
            assert!((after.position_m[axis] - before.position_m[axis]).abs() < 0.3 * sd);
            let ratio = after.covariance_m2[(axis, axis)].sqrt() / sd;
            assert!((ratio - 1.0).abs() < 0.35, "{ratio}");
        }
    }

    #[test]
    fn it_must_be_started() {
        let mut filter = RaoBlackwell::new(MOTION, PRIOR, 1);
        assert_eq!(filter.step(0, None), Err(FilterError::NotStarted));
    }
}
