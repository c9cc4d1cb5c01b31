//! The filter's state at one time, and what it means to be sound.

use super::correction::correct;
use super::factor::Factor;
use super::hypotheses::{HYPOTHESES, Hypotheses};
use super::interval::Interval;
use super::memory::Memory;
use super::mixture::Mixture;
use super::motion::predict;
use super::population::{Base, Population};
use super::schedule::Schedule;
use super::sight::LineOfSight;
use super::start::start;
use super::state::{Covariance, State};
use crate::cholesky::make_definite;
use crate::clock::seconds_between;
use crate::ekf::Corrected;
use crate::estimate::{Doubt, Estimate, Mode, Motion, NIS_MAX, POSITION_SIGMA_MAX_M};
use crate::measurement::{Channel, Measurement, RANGE_MAX_M, Vectors};
use crate::radar;
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

    /// Whether another track's position is further away than `deviations` of both.
    pub fn is_apart(&self, other: &Self, deviations: f32) -> bool {
        let squared = |i: usize| {
            let apart = self.state[i] - other.state[i];
            apart * apart
        };
        let variance = self.position_variance() + other.position_variance();
        (0..3).map(squared).sum::<f32>() >= deviations * deviations * variance
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

    /// Fuses what the network says of the state with the prediction.
    pub fn fuse(&mut self, factor: &Factor<f32>, population: &Population<f32>, dt_s: f32) {
        factor.fuse(&mut self.state, &mut self.covariance, population, dt_s);
    }

    /// Doubts a prediction that no measurement follows, or none that was used.
    pub fn doubt(
        &mut self,
        interval: &Interval<f32>,
        hypotheses: &Hypotheses<f32>,
        odds: &[f32; HYPOTHESES],
    ) {
        interval.doubt(&mut self.covariance, hypotheses, odds);
    }

    /// What a measurement makes of the prediction over `interval` under all hypotheses, and its
    /// whitened innovations; `None` where single precision overflows, or rounding spoils it.
    pub fn weighed(
        &self,
        vectors: &Vectors<f32>,
        interval: &Interval<f32>,
        hypotheses: &Hypotheses<f32>,
        odds: &[f32; HYPOTHESES],
    ) -> Option<(Mixture<f32>, [f32; 4])> {
        let (mixture, whitened) =
            interval.weigh(&self.state, &self.covariance, vectors, hypotheses, odds);
        mixture.corrected.checked().ok()?;
        Some((mixture, whitened))
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

    /// What was measured less what the state expects: elevation, azimuth, range, range-rate.
    pub fn innovation(&self, vectors: &Vectors<f32>) -> [f32; 4] {
        let [x, y, z, ..] = self.state;
        let expected = radar::predict([x, y, z], self.velocity()).measurement;
        radar::innovations(&vectors.measured, &expected)
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
    pub fn estimate(&self, nis: f32, mode: Mode, outside: bool, doubt: Doubt) -> Estimate {
        let covariance = &self.covariance;
        Estimate {
            time_us: self.time_us,
            position_m: core::array::from_fn(|i| self.state[i]),
            covariance_m2: core::array::from_fn(|i| core::array::from_fn(|j| covariance[i][j])),
            nis: nis.min(NIS_MAX),
            mode,
            outside,
            doubt,
            motion: Some(Motion {
                velocity_mps: self.velocity(),
                acceleration_mps2: core::array::from_fn(|i| self.state[6 + i]),
                covariance: *covariance,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::Sensed;

    fn population() -> Population<f32> {
        Population::PAPER.known()
    }

    fn base() -> Base<f32> {
        Base::DRONE.known()
    }

    fn sensed(value: f32, sigma: f32) -> Option<Sensed> {
        Some(Sensed { value, sigma })
    }

    fn first() -> Measurement {
        Measurement {
            time_us: 7,
            range: sensed(33.0, 0.1),
            elevation: sensed(0.4, 0.005),
            azimuth: sensed(0.5, 0.006),
            range_rate: sensed(1.0, 0.05),
        }
    }

    fn track() -> Track {
        Track::start(&first(), &population()).expect("a track")
    }

    #[test]
    fn a_start_needs_a_direction_that_says_something() {
        let started = |change: fn(&mut Measurement)| {
            let mut measurement = first();
            change(&mut measurement);
            Track::start(&measurement, &population()).map(|track| track.used)
        };
        assert_eq!(started(|_| ()), Ok(1));
        assert_eq!(
            started(|m| m.azimuth = None),
            Err(StepError::Missing(Channel::Azimuth))
        );
        let blunt = started(|m| {
            m.range = sensed(1e6, 0.1);
            m.azimuth = sensed(0.5, 1.0);
        });
        assert_eq!(blunt, Err(StepError::Blunt));
    }

    #[test]
    fn a_sensor_without_a_channel_is_as_blunt_as_the_population() {
        let mut measurement = first();
        (
            measurement.range,
            measurement.range_rate,
            measurement.elevation,
        ) = (None, None, None);
        let track = Track::start(&measurement, &population()).expect("a track");
        for (got, sigma) in track
            .memory
            .ln_sigmas
            .into_iter()
            .zip([0.21, 0.006, 6.0, 1.6])
        {
            assert!((got - f32::ln(sigma)).abs() < 1e-6);
        }
    }

    #[test]
    fn tracks_are_apart_by_their_deviations() {
        let (near, mut far) = (track(), track());
        let reach = 3.0 * (2.0 * near.position_variance()).sqrt();
        far.state[1] += 0.99 * reach;
        assert!(!near.is_apart(&far, 3.0) && near.is_apart(&far, 2.9));
        far.state[1] += 0.02 * reach;
        assert!(near.is_apart(&far, 3.0));
        assert!(near.is_apart(&near, 0.0));
    }

    #[test]
    fn what_means_nothing_does_not_settle() {
        assert!(track().settle());
        type Damage = fn(&mut Track);
        let damages: [Damage; 7] = [
            |t| t.state[0] = f32::NAN,
            |t| t.state[2] = 1.1e7,
            |t| t.state[4] = -1.1e5,
            |t| t.state[8] = 1.1e5,
            |t| t.covariance[3][3] = f32::INFINITY,
            |t| t.covariance[5][5] = 0.0,
            |t| t.covariance[1][1] = 1.1e10,
        ];
        for damage in damages {
            let mut track = track();
            damage(&mut track);
            assert!(!track.settle(), "{track:?}");
        }
        let mut flat = track();
        flat.covariance[0][1] = (flat.covariance[0][0] * flat.covariance[1][1]).sqrt();
        flat.covariance[1][0] = flat.covariance[0][1];
        assert!(flat.settle() && crate::cholesky::is_definite(&flat.covariance));
    }

    #[test]
    fn a_drift_moves_and_doubts() {
        let mut moved = track();
        moved.drift(500_007, &base());
        let before = track();
        assert_eq!(moved.time_us, 500_007);
        for axis in 0..3 {
            let expected = before.state[axis] + 0.5 * before.state[3 + axis];
            assert!((moved.state[axis] - expected).abs() < 1e-3);
            assert!(moved.covariance[axis][axis] > before.covariance[axis][axis]);
        }
        assert!(moved.position_variance() > before.position_variance());
        let mut still = track();
        still.drift(7, &base());
        assert_eq!(
            (still.state, still.covariance),
            (before.state, before.covariance)
        );
    }

    #[test]
    fn a_correction_is_counted_and_an_estimate_is_the_track() {
        let mut track = track();
        let vectors = Vectors::from(&first());
        let (corrected, whitened) = track.corrected(&vectors, [1.0; 3]).expect("sound");
        assert!(whitened.iter().all(|y| y.abs() < 1.0));
        let before = track.covariance[0][0];
        track.take(&corrected);
        assert_eq!(track.used, 2);
        assert!(track.covariance[0][0] < before);
        let estimate = track.estimate(f32::MAX, Mode::Tracking, true, Doubt::OUTLIER);
        assert_eq!(estimate.nis, NIS_MAX);
        assert_eq!(
            (estimate.mode, estimate.outside, estimate.time_us),
            (Mode::Tracking, true, 7)
        );
        assert_eq!(
            estimate.position_m,
            [track.state[0], track.state[1], track.state[2]]
        );
        assert_eq!(estimate.covariance_m2[1][2], track.covariance[1][2]);
        let motion = estimate.motion.expect("recursive");
        assert_eq!(motion.velocity_mps, track.velocity());
        assert_eq!(
            motion.acceleration_mps2,
            [track.state[6], track.state[7], track.state[8]]
        );
        assert_eq!(motion.covariance, track.covariance);
    }

    /// Overflow is no correction.
    #[test]
    fn an_overflow_corrects_nothing() {
        let mut track = track();
        track.covariance[0][0] = f32::INFINITY;
        assert!(
            track
                .corrected(&Vectors::from(&first()), [1.0; 3])
                .is_none()
        );
    }
}
