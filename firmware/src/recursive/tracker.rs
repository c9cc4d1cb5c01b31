//! The filter around the network: start, predict, gate, correct, bound, restart.

use super::correction::{GATE_NIS, correct};
use super::features::{FEATURE_LIMIT, FEATURES, features};
use super::memory::{Memory, NOTES};
use super::motion::{Covariance, State, predict};
use super::population::{Base, Population, read};
use super::schedule::{JERK_OUTPUT, JERK_SCALE, OUTPUTS, SCHEDULE, Schedule};
use super::sight::LineOfSight;
use super::start::start;
use crate::blob::Blob;
use crate::coast::seconds_between;
use crate::estimate::{Estimate, Mode, Motion};
use crate::measurement::Measurement;
use crate::monte_carlo::separate_moments;
use crate::network::{Network, Scratch};
use crate::rng::{Generator, seeded};
use crate::tracker::{Settings, StepError, check_time};

/// Longest time that one schedule is used for, s; longer gaps are predicted in equal parts.
const INTERVAL_MAX_S: f32 = 0.25;
/// After a longer silence the next measurement starts the filter anew, s.
const SILENCE_MAX_S: f32 = 10.0;
/// Measurements in a row outside the gate after which the filter starts anew.
pub const REJECTIONS_MAX: u8 = 3;
/// Speed, m/s, and acceleration, m/s^2, that no target of this kind reaches.
const SPEED_MAX_MPS: f32 = 60.0;
const ACCELERATION_MAX_MPS2: f32 = 80.0;
/// Variance of a position component, m^2, beyond which the filter has lost the target.
const POSITION_VARIANCE_MAX_M2: f32 = 1e6;

/// A nine-state filter over one target, driven by the network of a recursive blob.
pub(crate) struct Recursive<'a> {
    blob: Blob<'a>,
    settings: Settings,
    population: Population<f32>,
    base: Base<f32>,
    rng: Generator,
    scratch: Scratch,
    track: Option<Track>,
}

/// The filter's state at one time.
#[derive(Clone, Copy)]
struct Track {
    time_us: u64,
    state: State<f32>,
    covariance: Covariance<f32>,
    memory: Memory<f32>,
    rejections: u8,
}

/// What one answer of the network means after the prediction.
struct Step {
    interval_s: f32,
    /// For the correction: see [`Schedule::sensor_scale`].
    sensor_scale: [f32; 3],
    /// For the memory, once the velocity after the correction is known.
    notes: [f32; NOTES],
}

impl Track {
    fn remember(&mut self, step: &Step, used: bool) {
        if step.interval_s > 0.0 {
            let velocity = [self.state[3], self.state[4], self.state[5]];
            self.memory.stepped(
                step.interval_s,
                f32::from(u8::from(used)),
                velocity,
                &step.notes,
            );
        }
    }
}

impl<'a> Recursive<'a> {
    /// A tracker that has seen nothing yet; `settings` fit the blob.
    pub fn new(blob: Blob<'a>, settings: Settings) -> Self {
        let (population, base) = read(blob.parameters());
        Self {
            blob,
            settings,
            population,
            base,
            rng: seeded(settings.seed),
            scratch: Scratch::new(),
            track: None,
        }
    }

    /// Forgets the target and starts the random stream again.
    pub fn reset(&mut self) {
        self.rng = seeded(self.settings.seed);
        self.track = None;
    }

    /// The estimate at the time of `measurement`, whose values were checked.
    pub fn step(&mut self, measurement: &Measurement) -> Result<Estimate, StepError> {
        let Some(track) = self.track else {
            return Ok(self.start(measurement, Mode::Started));
        };
        check_time(Some(track.time_us), measurement.time_us)?;
        let dt_s = seconds_between(track.time_us, measurement.time_us);
        if track.memory.coast_s + dt_s > SILENCE_MAX_S {
            return Ok(self.start(measurement, Mode::Started));
        }
        let Some((mut track, step)) = self.predicted(track, measurement.time_us)? else {
            return Ok(self.start(measurement, Mode::Restarted));
        };
        let sigmas = measurement.sigmas.in_order();
        let (corrected, whitened) = correct(
            &track.state,
            &track.covariance,
            &measurement.in_order(),
            &sigmas,
            step.sensor_scale,
        );
        let Ok(corrected) = corrected.checked() else {
            return Ok(self.start(measurement, Mode::Restarted));
        };
        track.memory.measured(whitened, sigmas);
        if corrected.nis >= GATE_NIS as f32 {
            track.rejections += 1;
            if track.rejections >= REJECTIONS_MAX {
                return Ok(self.start(measurement, Mode::Restarted));
            }
            track.remember(&step, false);
            self.track = Some(track);
            return Ok(estimate(&track, corrected.nis, Mode::Rejected));
        }
        track.state = corrected.state;
        track.covariance = corrected.covariance;
        if !within_bounds(&track) {
            return Ok(self.start(measurement, Mode::Restarted));
        }
        track.rejections = 0;
        track.remember(&step, true);
        self.track = Some(track);
        Ok(estimate(&track, corrected.nis, Mode::Tracking))
    }

    /// The estimate at `time_us` without a measurement.
    pub fn coast(&mut self, time_us: u64) -> Result<Estimate, StepError> {
        let track = self.track.ok_or(StepError::NotStarted)?;
        check_time(Some(track.time_us), time_us)?;
        // Out of bounds there is nothing to start from: the last state stands, as it was.
        let track = match self.predicted(track, time_us)? {
            Some((mut predicted, step)) => {
                predicted.memory.missed();
                predicted.remember(&step, false);
                predicted
            }
            None => Track { time_us, ..track },
        };
        self.track = Some(track);
        Ok(estimate(&track, 0.0, Mode::Coasting))
    }

    fn start(&mut self, measurement: &Measurement, mode: Mode) -> Estimate {
        let (state, covariance) = start(
            measurement.in_order(),
            measurement.sigmas.in_order(),
            &self.population,
        );
        let velocity = [state[3], state[4], state[5]];
        let track = Track {
            time_us: measurement.time_us,
            state,
            covariance,
            memory: Memory::start(measurement.sigmas.in_order(), velocity),
            rejections: 0,
        };
        self.track = Some(track);
        estimate(&track, 0.0, mode)
    }

    /// The track at `time_us` before any correction, with what is still to be remembered of the
    /// last part of the way; `None` when it left its bounds.
    fn predicted(
        &mut self,
        mut track: Track,
        time_us: u64,
    ) -> Result<Option<(Track, Step)>, StepError> {
        let dt_s = seconds_between(track.time_us, time_us);
        track.time_us = time_us;
        let mut parts = 1_u16;
        while dt_s > INTERVAL_MAX_S * f32::from(parts) && dt_s <= SILENCE_MAX_S {
            parts += 1;
        }
        let interval_s = dt_s / f32::from(parts);
        let mut step = Step {
            interval_s,
            sensor_scale: [1.0; 3],
            notes: [0.0; NOTES],
        };
        if interval_s <= 0.0 {
            return Ok(Some((track, step)));
        }
        for part in 0..parts {
            if part > 0 {
                track.memory.missed();
                track.remember(&step, false);
            }
            let sight = LineOfSight::to([track.state[0], track.state[1], track.state[2]]);
            let inputs = features(
                &track.state,
                &track.covariance,
                &track.memory,
                &sight,
                interval_s,
            );
            let (outputs, jerk_variance) = self.infer(inputs);
            if !outputs
                .iter()
                .chain(&jerk_variance)
                .all(|value| value.is_finite())
            {
                return Err(StepError::NetworkNotFinite);
            }
            let mut schedule = Schedule::read(&outputs, &self.base);
            for (noise, variance) in schedule.jerk_noise.iter_mut().zip(jerk_variance) {
                // A constant jerk of unknown size over the interval weighs like white jerk of this
                // density.
                *noise += variance * interval_s;
            }
            let (state, covariance) = predict(
                &track.state,
                &track.covariance,
                &sight,
                &schedule,
                interval_s,
            );
            track.state = state;
            track.covariance = covariance;
            step.sensor_scale = schedule.sensor_scale;
            step.notes.copy_from_slice(&outputs[SCHEDULE..]);
        }
        Ok(within_bounds(&track).then_some((track, step)))
    }

    /// The network's outputs, and the variance of the mean jerk over passes, (m/s^3)^2.
    fn infer(&mut self, mut inputs: [f32; FEATURES]) -> ([f32; OUTPUTS], [f32; 3]) {
        let pairs = self.blob.input_normalisation();
        for (i, input) in inputs.iter_mut().enumerate() {
            let normalised = (*input - pairs.get(2 * i)) * pairs.get(2 * i + 1);
            *input = normalised.clamp(-FEATURE_LIMIT as f32, FEATURE_LIMIT as f32);
        }
        let mut outputs = [0.0; OUTPUTS];
        let mut variances = [0.0; OUTPUTS];
        for view in self.blob.networks() {
            let network = Network::new(view);
            if self.settings.passes == 1 {
                network.mean_pass(&inputs, &mut outputs);
            } else {
                (outputs, variances) = separate_moments(
                    &network,
                    &inputs,
                    self.settings.passes,
                    &mut self.rng,
                    &mut self.scratch,
                );
            }
        }
        let pairs = self.blob.output_normalisation();
        let scale = |i: usize| pairs.get(2 * i + 1);
        let jerk_variance = core::array::from_fn(|axis| {
            let output = JERK_OUTPUT + axis;
            (JERK_SCALE * JERK_SCALE) as f32 * scale(output) * scale(output) * variances[output]
        });
        for (i, output) in outputs.iter_mut().enumerate() {
            *output = pairs.get(2 * i) + scale(i) * *output;
        }
        (outputs, jerk_variance)
    }
}

/// Whether everything is finite and the motion is one that a target of this kind can have.
fn within_bounds(track: &Track) -> bool {
    let (state, covariance) = (&track.state, &track.covariance);
    let squared = |from: usize| {
        state[from] * state[from]
            + state[from + 1] * state[from + 1]
            + state[from + 2] * state[from + 2]
    };
    squared(3) < SPEED_MAX_MPS * SPEED_MAX_MPS
        && squared(6) < ACCELERATION_MAX_MPS2 * ACCELERATION_MAX_MPS2
        && squared(0).is_finite()
        && covariance
            .as_flattened()
            .iter()
            .all(|value| value.is_finite())
        && (0..9).all(|i| covariance[i][i] > 0.0)
        && (0..3).all(|i| covariance[i][i] < POSITION_VARIANCE_MAX_M2)
}

fn estimate(track: &Track, nis: f32, mode: Mode) -> Estimate {
    let (state, covariance) = (&track.state, &track.covariance);
    Estimate {
        time_us: track.time_us,
        position_m: core::array::from_fn(|i| state[i]),
        covariance_m2: core::array::from_fn(|i| core::array::from_fn(|j| covariance[i][j])),
        nis,
        mode,
        motion: Some(Motion {
            velocity_mps: core::array::from_fn(|i| state[3 + i]),
            acceleration_mps2: core::array::from_fn(|i| state[6 + i]),
            covariance: *covariance,
        }),
    }
}
