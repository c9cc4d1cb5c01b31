//! The filter's state at one time, and what it means to be sound.

use super::correction::correct;
use super::memory::Memory;
use super::motion::{Covariance, State, predict};
use super::population::{Base, Population};
use super::schedule::Schedule;
use super::sight::LineOfSight;
use super::start::start;
use crate::cholesky::make_definite;
use crate::clock::seconds_between;
use crate::ekf::Corrected;
use crate::estimate::{Estimate, Mode, Motion, NIS_MAX, POSITION_SIGMA_MAX_M};
use crate::measurement::{Channel, Measurement, RANGE_MAX_M, Vectors};
use crate::step_error::StepError;

/// Largest speed, m/s, and acceleration, m/s^2, of a state that means anything: ten times what a
/// measurement can say.
const SPEED_MAX_MPS: f32 = 1e5;
const ACCELERATION_MAX_MPS2: f32 = 1e5;
/// Furthest position that means anything, m.
const POSITION_MAX_M: f32 = 10.0 * RANGE_MAX_M;

/// A target's state at one time.
#[derive(Clone, Copy, Debug)]
pub struct Track {
    /// Microseconds.
    pub time_us: u64,
    /// Position, velocity, acceleration.
    pub state: State<f32>,
    /// Its covariance.
    pub covariance: Covariance<f32>,
    /// What the network reads beside them.
    pub memory: Memory<f32>,
    /// Measurements that it was corrected with, the first one included.
    pub used: u16,
}

impl Track {
    /// A track from its first measurement.
    ///
    /// # Errors
    /// [`StepError::Missing`] without an azimuth, [`StepError::Blunt`] if it says too little.
    pub fn start(
        measurement: &Measurement,
        population: &Population<f32>,
    ) -> Result<Self, StepError> {
        if measurement.azimuth.is_none() {
            return Err(StepError::Missing(Channel::Azimuth));
        }
        let vectors = Vectors::from(measurement);
        let (state, covariance) = start(&vectors, population);
        // A sensor without a channel is as blunt there as the population is.
        let blunt = [
            population.elevation_sigma_rad,
            vectors.sigmas[1],
            population.range_sigma_m,
            population.horizontal_sigma_mps,
        ];
        let sigmas = core::array::from_fn(|i| {
            if vectors.present[i] > 0.0 {
                vectors.sigmas[i]
            } else {
                blunt[i]
            }
        });
        let mut track = Self {
            time_us: measurement.time_us,
            state,
            covariance,
            memory: Memory::start(sigmas, [state[3], state[4], state[5]]),
            used: 1,
        };
        if track.settle() {
            Ok(track)
        } else {
            Err(StepError::Blunt)
        }
    }

    /// Velocity, m/s.
    pub fn velocity(&self) -> [f32; 3] {
        [self.state[3], self.state[4], self.state[5]]
    }

    /// Sum of the position's variances, m^2.
    pub fn position_variance(&self) -> f32 {
        (0..3).map(|i| self.covariance[i][i]).sum()
    }

    /// The line of sight to the position.
    pub fn sight(&self) -> LineOfSight<f32> {
        LineOfSight::to([self.state[0], self.state[1], self.state[2]])
    }

    /// Moves the state and its covariance ahead.
    pub fn predict(&mut self, sight: &LineOfSight<f32>, schedule: &Schedule<f32>, dt_s: f32) {
        (self.state, self.covariance) =
            predict(&self.state, &self.covariance, sight, schedule, dt_s);
    }

    /// Moves the track to `time_us` in one part under the model for motion that none was trained
    /// for.
    pub fn drift(&mut self, time_us: u64, base: &Base<f32>) {
        let dt_s = seconds_between(self.time_us, time_us);
        self.time_us = time_us;
        if dt_s > 0.0 {
            self.predict(&self.sight(), &Schedule::wide(base), dt_s);
        }
    }

    /// What a measurement makes of the state, and its whitened innovations; `None` where single
    /// precision overflows, or rounding spoils it.
    pub fn corrected(
        &self,
        vectors: &Vectors<f32>,
        scale: [f32; 3],
    ) -> Option<(Corrected<f32, 9>, [f32; 4])> {
        let (corrected, whitened) = correct(&self.state, &self.covariance, vectors, scale);
        Some((corrected.checked().ok()?, whitened))
    }

    /// Takes a correction.
    pub fn take(&mut self, corrected: &Corrected<f32, 9>) {
        self.state = corrected.state;
        self.covariance = corrected.covariance;
        self.used = self.used.saturating_add(1);
    }

    /// Makes the covariance positive definite for sure; false when what is left means nothing.
    #[must_use]
    pub fn settle(&mut self) -> bool {
        let within =
            |from: usize, most: f32| self.state[from..from + 3].iter().all(|x| x.abs() < most);
        within(0, POSITION_MAX_M)
            && within(3, SPEED_MAX_MPS)
            && within(6, ACCELERATION_MAX_MPS2)
            && make_definite(&mut self.covariance).is_ok()
            && (0..3).all(|i| self.covariance[i][i] < POSITION_SIGMA_MAX_M * POSITION_SIGMA_MAX_M)
    }

    /// The track as an estimate.
    pub fn estimate(&self, nis: f32, mode: Mode, outside: bool) -> Estimate {
        let covariance = &self.covariance;
        Estimate {
            time_us: self.time_us,
            position_m: core::array::from_fn(|i| self.state[i]),
            covariance_m2: core::array::from_fn(|i| core::array::from_fn(|j| covariance[i][j])),
            nis: nis.min(NIS_MAX),
            mode,
            outside,
            motion: Some(Motion {
                velocity_mps: self.velocity(),
                acceleration_mps2: core::array::from_fn(|i| self.state[6 + i]),
                covariance: *covariance,
            }),
        }
    }
}
