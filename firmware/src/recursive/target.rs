//! A target as the filter knows it at one time, and what it means to be sound.

use core::slice::{from_mut, from_ref};

use super::correction::GATE_NIS;
use super::factor::Factor;
use super::foresight::{AHEAD_S, Foresight};
use super::hypotheses::{HYPOTHESES, Hypotheses};
use super::interval::Interval;
use super::memory::Memory;
use super::mixture::Mixture;
use super::motion::predict;
use super::population::{Base, Population};
use super::schedule::Schedule;
use super::sight::LineOfSight;
use super::start::{at_rest, place, start};
use super::state::{Covariance, State, position_variance};
use super::steady::Steady;
use crate::cholesky::{cholesky, forward_substitute, make_definite};
use crate::clock::seconds_between;
use crate::ekf::{Corrected, dot, subtract_outer};
use crate::estimate::{Doubt, Estimate, Mode, Motion, NIS_MAX, POSITION_SIGMA_MAX_M};
use crate::measurement::{Channel, Measurement, RANGE_MAX_M, Vectors};
use crate::radar;
use crate::scalar::Scalar;
use crate::step_error::StepError;

/// How much larger the variance of a blind prediction is than that of a measurement which replaces it.
const BLUNTER: f32 = 4.0;
/// How many variances of a prediction must exceed its squared distance from the sensor's vertical axis for azimuths to
/// be far from straight there.
const CLOSE: f32 = 4.0;
/// Cosine of how far beside the expected azimuth a measured one may be for the slope there to mean anything: 37 degrees.
const STRAIGHT: f32 = 0.8;
/// Sigma of an azimuth, rad, of which three are those 37 degrees: a blunter one is far aside by chance.
const SHARP_RAD: f32 = 0.21;
/// The least variance of a prediction that is seen far aside, beside that of the measured place: below, the place says
/// nothing, and single precision would lose the prediction in it.
const SHARPEST: f32 = 0.01;
/// Largest speed, m/s, and acceleration, m/s^2, of a state that means anything: ten times what a
/// measurement can say.
const SPEED_MAX_MPS: f32 = 1e5;
const ACCELERATION_MAX_MPS2: f32 = 1e5;
/// Furthest position that means anything, m.
const POSITION_MAX_M: f32 = 10.0 * RANGE_MAX_M;

/// A target's state at one time.
#[derive(Clone, Copy, Debug)]
pub struct Target {
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
    /// How well its forecasts came true.
    pub foresight: Foresight,
}

impl Target {
    /// None: room for one.
    pub const NONE: Self = Self {
        time_us: 0,
        state: [0.0; 9],
        sensor_m: [0.0; 3],
        covariance: [[0.0; 9]; 9],
        memory: Memory::NONE,
        used: 0,
        foresight: Foresight::START,
    };

    /// Makes a target of its first measurement, here whatever was here before.
    ///
    /// # Errors
    /// [`StepError::Missing`] without an azimuth, [`StepError::Blunt`] if it says too little; what is
    /// here then means nothing.
    pub fn start(
        &mut self,
        measurement: &Measurement,
        population: &Population<f32>,
    ) -> Result<(), StepError> {
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
        (self.state, self.covariance) = start(&still, population);
        self.time_us = measurement.time_us;
        self.sensor_m = sensor.position_m;
        self.memory = Memory::start(population.sigmas_of(&vectors), self.velocity());
        self.used = 1;
        self.foresight = Foresight::START;
        if self.settle() {
            Ok(())
        } else {
            Err(StepError::Blunt)
        }
    }

    /// Becomes another.
    // As a slice of one: an assignment would go by a third one on the stack.
    pub fn copy_from(&mut self, other: &Self) {
        from_mut(self).copy_from_slice(from_ref(other));
    }

    /// Velocity, m/s.
    pub fn velocity(&self) -> [f32; 3] {
        [self.state[3], self.state[4], self.state[5]]
    }

    /// Acceleration, m/s^2.
    pub fn acceleration(&self) -> [f32; 3] {
        [self.state[6], self.state[7], self.state[8]]
    }

    /// Sum of the position's variances, m^2.
    pub fn position_variance(&self) -> f32 {
        position_variance(&self.covariance)
    }

    /// Whether another target's position is further away than `deviations` of both.
    pub fn is_apart(&self, other: &Self, deviations: f32) -> bool {
        let squared = |i: usize| {
            let apart = self.state[i] - other.state[i] - (other.sensor_m[i] - self.sensor_m[i]);
            apart * apart
        };
        let variance = self.position_variance() + other.position_variance();
        (0..3).map(squared).sum::<f32>() >= deviations * deviations * variance
    }

    /// Takes its place, as the sensor sees it that its position counts from, from a whole measurement whose angles have
    /// no slope that holds. Either the prediction is blind: unsure by more than its distance from the sensor's vertical
    /// axis, and by more than twice what the measurement and the population leave. Or it is unsure by half that distance
    /// and seen far aside from a place that is further from the latest sensor's (`before_m`, m) than it is unsure: as by a
    /// second radar where the first one's range was a guess. The curvature would outweigh every such measurement, and the
    /// track would never find back. The measurement is then a position (Kalman 1960), which tells of velocity and
    /// acceleration what they have to do with the prediction's, and its range-rate alone is left. Returns the normalised
    /// innovation squared of the place, `None` for any other target; at the gate or beyond nothing was taken.
    // Off the stack before the correction.
    #[inline(never)]
    pub fn relocate(
        &mut self,
        vectors: &mut Vectors<f32>,
        population: &Population<f32>,
        before_m: [f32; 3],
    ) -> Option<f32> {
        let [x_m, y_m] = [self.state[0], self.state[1]];
        let (level_m2, unsure_m2) = (x_m * x_m + y_m * y_m, self.position_variance());
        let [elevation, azimuth, range, _] = vectors.present;
        if elevation * azimuth * range == 0.0 || CLOSE * unsure_m2 <= level_m2 {
            return None;
        }
        let apart_m: [f32; 3] = core::array::from_fn(|axis| self.sensor_m[axis] - before_m[axis]);
        let (sin, cos) = Scalar::sin_cos(vectors.measured[1]);
        // From where it was seen before, a direction far aside is an outlier's.
        let aside = dot(&apart_m, &apart_m) > unsure_m2
            && vectors.sigmas[1] < SHARP_RAD
            && x_m * cos + y_m * sin < STRAIGHT * level_m2.sqrt();
        if !aside && unsure_m2 <= level_m2 {
            return None;
        }
        let (place_m, place_m2) = place(vectors, population);
        let measured_m2 = place_m2[0][0] + place_m2[1][1] + place_m2[2][2];
        let least = if aside { SHARPEST } else { BLUNTER };
        if unsure_m2 <= least * measured_m2 {
            return None;
        }
        let mut both = place_m2;
        let mut apart = place_m;
        for (row, (sum, apart)) in both.iter_mut().zip(&mut apart).enumerate() {
            *apart -= self.state[row];
            for (sum, variance) in sum.iter_mut().zip(self.covariance[row]) {
                *sum += variance;
            }
        }
        let root = cholesky(&both);
        let whitened = forward_substitute(&root, apart);
        let nis = dot(&whitened, &whitened);
        // Not a number would be of a prediction that is none.
        if nis.is_nan() || nis >= GATE_NIS as f32 {
            return Some(nis.max(GATE_NIS as f32));
        }
        for channel in 0..3 {
            vectors.miss(channel);
        }
        // Kalman's step written from the place, which is mostly the surer one and loses fewer digits so; from the
        // prediction's velocity and acceleration the place takes what they have in common.
        let mut taken = [[0.0; 3]; 9];
        for (row, taken) in taken.iter_mut().enumerate() {
            let common = match place_m2.get(row) {
                Some(&variances) => {
                    self.state[row] = place_m[row];
                    variances
                }
                None => [0, 1, 2].map(|column| -self.covariance[row][column]),
            };
            *taken = forward_substitute(&root, common);
            self.state[row] -= dot(taken, &whitened);
        }
        for row in 0..9 {
            for column in 0..=row {
                let left = match place_m2.get(row) {
                    Some(variances) => variances[column],
                    None if column < 3 => 0.0,
                    None => self.covariance[row][column],
                };
                let left = left - dot(&taken[row], &taken[column]);
                self.covariance[row][column] = left;
                self.covariance[column][row] = left;
            }
        }
        Some(nis)
    }

    /// Counts the position from this sensor, m.
    pub fn seen_from(&mut self, sensor_m: [f32; 3]) {
        let shift_m = core::array::from_fn(|axis| sensor_m[axis] - self.sensor_m[axis]);
        for (position, shift) in self.state.iter_mut().zip(shift_m) {
            *position -= shift;
        }
        self.foresight.shift(shift_m);
        self.sensor_m = sensor_m;
    }

    /// Makes the velocity relative to a sensor's (m/s), which is what its measurement is compared with and
    /// corrects; [`Target::over_ground`] makes it what it is everywhere else. In place: a second state
    /// beside a correction would weigh on the stack of every step.
    pub fn relative_to(&mut self, sensor_mps: [f32; 3]) {
        for axis in 0..3 {
            self.state[3 + axis] -= sensor_mps[axis];
        }
    }

    /// Undoes [`Target::relative_to`].
    pub fn over_ground(&mut self, sensor_mps: [f32; 3]) {
        self.relative_to(sensor_mps.map(|v| 0.0 - v));
    }

    /// The line of sight to the position.
    pub fn sight(&self) -> LineOfSight<f32> {
        LineOfSight::to([self.state[0], self.state[1], self.state[2]])
    }

    /// Moves the state and its covariance ahead.
    pub fn predict(&mut self, sight: &LineOfSight<f32>, schedule: &Schedule<f32>, dt_s: f32) {
        predict(&mut self.state, &mut self.covariance, sight, schedule, dt_s);
    }

    /// [`Target::predict`] for a track, of whose bends `prior` is known beforehand: what lies more than [`AHEAD_S`] after the
    /// last measurement bends as a forecast does.
    // Off the stack before the network is asked again.
    #[inline(never)]
    pub fn go_on(
        &mut self,
        sight: &LineOfSight<f32>,
        schedule: &Schedule<f32>,
        dt_s: f32,
        prior: f32,
    ) {
        let before = Steady::of(&self.state);
        self.predict(sight, schedule, dt_s);
        let late_s = self.memory.coast_s + 0.5 * dt_s - AHEAD_S;
        if late_s > 0.0 {
            // What is open of a bend is the same all the way: its variance grows with the square of the time.
            let kept_mps2 = self.acceleration();
            self.bend((&before, dt_s), kept_mps2, prior, 2.0 * late_s / dt_s);
        }
    }

    /// Fuses what the network says of the state with the prediction.
    pub fn fuse(&mut self, factor: &Factor<f32>, population: &Population<f32>, dt_s: f32) {
        factor.fuse(&mut self.state, &mut self.covariance, population, dt_s);
    }

    /// Bends where it is said to be `time_s` after it was at `before` by as much as its earlier forecasts came true with, of
    /// which `prior` is known beforehand, and adds `open` times the variance of that along the bend. Of its acceleration
    /// `kept_mps2` does not bend.
    // Called for forecasts and for gaps: once in flash.
    #[inline(never)]
    pub fn bend(
        &mut self,
        (before, time_s): (&Steady, f32),
        kept_mps2: [f32; 3],
        prior: f32,
        open: f32,
    ) {
        let bend = self.foresight.bend(prior);
        let straight_m = before.after(time_s);
        let mut bent = [0.0; 9];
        for axis in 0..3 {
            let steady = [straight_m[axis], before.velocity_mps[axis], kept_mps2[axis]];
            for (i, steady) in [axis, 3 + axis, 6 + axis].into_iter().zip(steady) {
                bent[i] = self.state[i] - steady;
                self.state[i] = steady + bend * bent[i];
            }
        }
        if open > 0.0 {
            let variance = open * self.foresight.bend_variance();
            let taken = bent.map(|bent| -variance * bent);
            subtract_outer(&mut self.covariance, &taken, &bent);
        }
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

    /// What a measurement makes of the prediction over `interval` under all hypotheses, in `mixture`,
    /// which is [`Mixture::before`] of it; returns its whitened innovations, or `None` where single precision overflows, or rounding
    /// spoils it.
    // The corrections under every hypothesis would weigh on the stack of the prediction before, and
    // need not lie in flash twice.
    #[inline(never)]
    pub fn weighed(
        &self,
        vectors: &Vectors<f32>,
        interval: &Interval<f32>,
        hypotheses: &Hypotheses<f32>,
        odds: &[f32; HYPOTHESES],
        mixture: &mut Mixture<f32>,
    ) -> Option<[f32; 4]> {
        let (state, covariance) = (&self.state, &self.covariance);
        let whitened = interval.weigh(state, covariance, vectors, hypotheses, odds, mixture);
        mixture.corrected.check().ok()?;
        Some(whitened)
    }

    /// Moves it to `time_us` in one part under the model for motion that none was trained
    /// for.
    pub fn drift(&mut self, time_us: u64, base: &Base<f32>) {
        let dt_s = seconds_between(self.time_us, time_us);
        self.time_us = time_us;
        if dt_s > 0.0 {
            self.predict(&self.sight(), &Schedule::wide(base), dt_s);
        }
    }

    /// What was measured less what the state expects: elevation, azimuth, range, range-rate.
    pub fn innovation(&self, vectors: &Vectors<f32>) -> [f32; 4] {
        let [x, y, z, ..] = self.state;
        let expected = radar::predict([x, y, z], self.velocity()).measurement;
        radar::innovations(vectors, &expected)
    }

    /// Takes a correction.
    pub fn take(&mut self, corrected: &Corrected<f32, 9>) {
        self.state.copy_from_slice(&corrected.state);
        self.covariance.copy_from_slice(&corrected.covariance);
        self.used = self.used.saturating_add(1);
    }

    /// Learns from a forecast that is due, after a measurement was used; `bend` is how much of one is known to
    /// come true.
    pub fn learn_from_forecast(&mut self, bend: f32) {
        self.foresight
            .compare(self.time_us, &self.state, &self.covariance, bend);
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

    /// It as an estimate, its position in the frame.
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
                acceleration_mps2: self.acceleration(),
                covariance: *covariance,
            }),
        }
    }
}

#[cfg(test)]
mod tests;
