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
use super::start::{at_rest, start};
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
    /// Position, velocity, acceleration. The position counts from the sensor: what is asked of a place
    /// is asked of it from there, and nothing far from the frame's origin loses digits.
    pub state: State<f32>,
    /// Where the sensor of the latest measurement is, m.
    pub sensor_m: [f32; 3],
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
        let sensor = &measurement.sensor;
        // One call: two would not be inlined, and weigh on the stack of every step.
        let still = if sensor.velocity_mps == [0.0; 3] {
            vectors
        } else {
            at_rest(&vectors, sensor.velocity_mps, population)
        };
        let (state, covariance) = start(&still, population);
        let mut track = Self {
            time_us: measurement.time_us,
            state,
            sensor_m: sensor.position_m,
            covariance,
            memory: Memory::start(
                population.sigmas_of(&vectors),
                [state[3], state[4], state[5]],
            ),
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
            let apart = self.state[i] - other.state[i] - (other.sensor_m[i] - self.sensor_m[i]);
            apart * apart
        };
        let variance = self.position_variance() + other.position_variance();
        (0..3).map(squared).sum::<f32>() >= deviations * deviations * variance
    }

    /// Counts the position from this sensor, m.
    pub fn seen_from(&mut self, sensor_m: [f32; 3]) {
        for axis in 0..3 {
            self.state[axis] -= sensor_m[axis] - self.sensor_m[axis];
        }
        self.sensor_m = sensor_m;
    }

    /// Makes the velocity relative to a sensor's (m/s), which is what its measurement is compared with and
    /// corrects; [`Track::over_ground`] makes it what it is everywhere else. In place: a second state
    /// beside a correction would weigh on the stack of every step.
    pub fn relative_to(&mut self, sensor_mps: [f32; 3]) {
        for axis in 0..3 {
            self.state[3 + axis] -= sensor_mps[axis];
        }
    }

    /// Undoes [`Track::relative_to`].
    pub fn over_ground(&mut self, sensor_mps: [f32; 3]) {
        self.relative_to(sensor_mps.map(|v| 0.0 - v));
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
    // The corrections under every hypothesis would weigh on the stack of the prediction before, and
    // need not lie in flash twice.
    #[inline(never)]
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

    /// The track as an estimate, its position in the frame.
    pub fn estimate(&self, nis: f32, mode: Mode, outside: bool, doubt: Doubt) -> Estimate {
        let covariance = &self.covariance;
        Estimate {
            time_us: self.time_us,
            // Subtracting keeps the sign of a zero where the sensor is the origin; adding would not.
            position_m: core::array::from_fn(|i| self.state[i] - (0.0 - self.sensor_m[i])),
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
    use crate::sensor::Sensor;

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
            sensor: Sensor::ORIGIN,
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
        // With all channels it is as sharp as it says.
        let own = self::track().memory.ln_sigmas;
        for (got, sigma) in own.into_iter().zip([0.005, 0.006, 0.1, 0.05]) {
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
        let mut far = track();
        (far.state[1], far.state[3], far.state[7]) = (-9.9e6, 9.9e4, -9.9e4);
        far.covariance[0][0] = 9.9e9;
        assert!(far.settle());
        type Damage = fn(&mut Track);
        let damages: [Damage; 9] = [
            |t| t.state[0] = 1e7,
            |t| t.covariance[2][2] = 1e10,
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

    /// A measurement from a moving sensor elsewhere, as one joint update in f64 with the Jacobian by
    /// differences of a measurement function written again in plain words.
    #[test]
    fn a_correction_from_a_moving_sensor_is_the_textbooks() {
        use nalgebra::{SMatrix, SVector};
        let sensor = Sensor {
            position_m: [12.0, -30.0, 2.5],
            velocity_mps: [-9.0, 12.0, 0.5],
        };
        let mut track = track();
        for i in 0..9 {
            track.covariance[i][i] += 0.02;
        }
        let world: [f64; 9] = track.state.map(f64::from);
        let h = |s: &[f64; 9]| {
            let d: [f64; 3] = core::array::from_fn(|i| s[i] - f64::from(sensor.position_m[i]));
            let v: [f64; 3] =
                core::array::from_fn(|i| s[3 + i] - f64::from(sensor.velocity_mps[i]));
            let range = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
            SVector::<f64, 4>::from([
                libm::asin(d[2] / range),
                libm::atan2(d[1], d[0]),
                range,
                (d[0] * v[0] + d[1] * v[1] + d[2] * v[2]) / range,
            ])
        };
        let jacobian = SMatrix::<f64, 4, 9>::from_fn(|row, column| {
            let step = |size: f64| {
                let mut moved = world;
                moved[column] += size;
                h(&moved)[row]
            };
            (step(1e-5) - step(-1e-5)) / 2e-5
        });
        let away = SVector::<f64, 4>::from([0.004, -0.003, 0.2, 0.1]);
        let measured = h(&world) + away;
        let sigmas = [0.01, 0.008, 0.3, 0.2];
        let vectors = Vectors::whole(core::array::from_fn(|i| measured[i] as f32), sigmas);
        track.seen_from(sensor.position_m);
        let curvature = crate::recursive::curvature::curvature(&track.state, &track.covariance);
        let prior = SMatrix::<f64, 9, 9>::from_fn(|i, j| f64::from(track.covariance[i][j]));
        let noise = SMatrix::<f64, 4, 4>::from_diagonal(&SVector::from_fn(|i, _| {
            f64::from(sigmas[i]).powi(2) + f64::from(curvature[i])
        }));
        let innovation = jacobian * prior * jacobian.transpose() + noise;
        let gain = prior * jacobian.transpose() * innovation.try_inverse().expect("regular");
        let mean = SVector::<f64, 9>::from(world) + gain * away;
        let spread = prior - gain * jacobian * prior;
        track.relative_to(sensor.velocity_mps);
        let corrected = track.corrected(&vectors, [1.0; 3]);
        track.take(&corrected.expect("sound").0);
        track.over_ground(sensor.velocity_mps);
        let estimate = track.estimate(0.0, Mode::Tracking, false, Doubt::NONE);
        let motion = estimate.motion.expect("recursive");
        for i in 0..3 {
            assert!((f64::from(estimate.position_m[i]) - mean[i]).abs() < 1e-4);
            assert!((f64::from(motion.velocity_mps[i]) - mean[3 + i]).abs() < 1e-4);
        }
        for i in 0..9 {
            for j in 0..9 {
                assert!((f64::from(motion.covariance[i][j]) - spread[(i, j)]).abs() < 1e-4);
            }
        }
    }

    /// Galileo: who moves with sensor and target sees the same.
    #[test]
    fn only_the_relative_velocity_counts() {
        let vectors = Vectors::from(&first());
        let own = [3.0, -2.0, 1.0];
        let corrected = |mut track: Track, own: [f32; 3]| {
            track.relative_to(own);
            let (corrected, _) = track.corrected(&vectors, [1.0; 3]).expect("sound");
            track.take(&corrected);
            track.over_ground(own);
            (track.state, corrected.nis)
        };
        let (plain, nis) = corrected(track(), own);
        let mut boosted = track();
        let boost = [16.0, 8.0, -4.0];
        for axis in 0..3 {
            boosted.state[3 + axis] += boost[axis];
        }
        let own = core::array::from_fn(|axis| own[axis] + boost[axis]);
        let (moved, moved_nis) = corrected(boosted, own);
        assert!((nis - moved_nis).abs() < 1e-3 * nis);
        for i in 0..9 {
            let boost = if (3..6).contains(&i) {
                boost[i - 3]
            } else {
                0.0
            };
            assert!((moved[i] - plain[i] - boost).abs() < 1e-5);
        }
    }

    #[test]
    fn a_place_is_the_same_from_every_sensor() {
        let place = |track: &Track| {
            track
                .estimate(0.0, Mode::Tracking, false, Doubt::NONE)
                .position_m
        };
        let mut seen = track();
        seen.seen_from([40.0, -3.0, 1.0]);
        assert!(!track().is_apart(&seen, 1e-3) && !seen.is_apart(&track(), 1e-3));
        for (a, b) in place(&seen).into_iter().zip(place(&track())) {
            assert!((a - b).abs() < 1e-5);
        }
        seen.seen_from([0.0; 3]);
        for axis in 0..3 {
            assert!((seen.state[axis] - track().state[axis]).abs() < 1e-5);
        }
        let mut away = first();
        away.sensor = Sensor::at([100.0, 0.0, 0.0]);
        let away = Track::start(&away, &population()).expect("a track");
        assert_eq!(away.state, track().state);
        assert!((place(&away)[0] - place(&track())[0] - 100.0).abs() < 1e-4);
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

    /// A track's factor and doubt are those of its state and covariance.
    #[test]
    fn a_track_is_fused_and_doubted() {
        let factor = Factor {
            shifts: [1.0; 5],
            weights: [2.0; 5],
        };
        let (before, mut fused) = (track(), track());
        fused.fuse(&factor, &population(), 0.1);
        let (mut state, mut covariance) = (before.state, before.covariance);
        factor.fuse(&mut state, &mut covariance, &population(), 0.1);
        assert_eq!((fused.state, fused.covariance), (state, covariance));
        assert!(state != before.state && covariance != before.covariance);

        let wide = Schedule::wide(&base());
        let interval = Interval {
            sight: before.sight(),
            noise: wide.noise,
            sensor_scale: wide.sensor_scale,
            dt_s: 0.2,
        };
        let (hypotheses, odds) = (Hypotheses::DRONE.known(), [0.7, 0.1, 0.1, 0.1]);
        let mut doubted = track();
        doubted.doubt(&interval, &hypotheses, &odds);
        let mut covariance = before.covariance;
        interval.doubt(&mut covariance, &hypotheses, &odds);
        assert_eq!(doubted.covariance, covariance);
        assert!(covariance[0][0] > before.covariance[0][0]);
    }
}
