//! The filter around the network: start, predict, gate, correct, agree, settle.

use super::candidate::{AGREEING, Candidate, Verdict};
use super::correction::GATE_NIS;
use super::envelope::Envelope;
use super::factor::Factor;
use super::features::{FEATURE_LIMIT, FEATURES, features};
use super::hypotheses::{OFTEN_WRONG, OUTLIER};
use super::interval::Interval;
use super::memory::NOTES;
use super::mixture::Mixture;
use super::parameters::Parameters;
use super::population::Population;
use super::schedule::{JERK_OUTPUT, JERK_SCALE, NOTE_OUTPUT, OUTPUTS, SCHEDULE, Schedule};
use super::track::Track;
use crate::blob::Blob;
use crate::clock::seconds_between;
use crate::estimate::{Doubt, Estimate, Mode, NIS_MAX};
use crate::measurement::{Measurement, Vectors};
use crate::network::monte_carlo::separate_moments;
use crate::network::{Network, Scratch};
use crate::rng::{Generator, seeded};
use crate::settings::Settings;
use crate::step_error::StepError;

/// Longest time that one schedule is used for, s; longer gaps are predicted in equal parts.
const INTERVAL_MAX_S: f32 = 0.25;
/// After a longer silence the network is not asked any more, and the next measurement starts the
/// filter anew, s. With [`INTERVAL_MAX_S`] it bounds the network's work in one call.
const SILENCE_MAX_S: f32 = 10.0;
/// Probability of being wrong from which a measurement that is used counts as one that is not.
const SUSPECT: f32 = 0.5;

/// Deviations that a candidate made of measurements that were used must be away from the track to take
/// over: nearer than that it is the same target, under a sensor that is worse than it says.
const APART: f32 = 3.0;
/// Whitened innovations of rejected measurements are remembered within this many deviations.
const WHITENED_MAX: f32 = 1e3;

/// A nine-state filter over one target, driven by the network of a recursive blob.
pub(crate) struct Recursive<'a> {
    blob: Blob<'a>,
    settings: Settings,
    parameters: Parameters<f32>,
    envelope: Envelope,
    rng: Generator,
    scratch: Scratch,
    track: Option<Track>,
    /// Measurements in a row that the track rejected or suspected.
    rejections: u8,
    candidate: Option<Candidate>,
}

/// What one answer of the network means after the prediction.
struct Step {
    /// For the correction.
    interval: Interval<f32>,
    /// For the memory, once the velocity after the correction is known.
    notes: [f32; NOTES],
}

impl Step {
    /// Lets a track remember the step.
    fn remember(&self, track: &mut Track, used: bool) {
        if self.interval.dt_s > 0.0 {
            let used = f32::from(u8::from(used));
            let velocity = track.velocity();
            track
                .memory
                .stepped(self.interval.dt_s, used, velocity, &self.notes);
        }
    }
}

impl<'a> Recursive<'a> {
    /// A tracker that has seen nothing yet; `settings` fit the blob.
    pub fn new(blob: Blob<'a>, settings: Settings) -> Self {
        let parameters = Parameters::read(blob.parameters());
        Self {
            blob,
            settings,
            envelope: Envelope::of(&parameters.bounds, &parameters.population),
            parameters,
            rng: seeded(settings.seed),
            scratch: Scratch::new(),
            track: None,
            rejections: 0,
            candidate: None,
        }
    }

    /// Forgets the target and starts the random stream again.
    pub fn reset(&mut self) {
        self.rng = seeded(self.settings.seed);
        self.forget();
    }

    fn forget(&mut self) {
        self.track = None;
        self.rejections = 0;
        self.candidate = None;
    }

    /// The estimate at the time of `measurement`, whose values and time were checked; `anew` when its
    /// time does not follow the ones before.
    pub fn step(&mut self, measurement: &Measurement, anew: bool) -> Result<Estimate, StepError> {
        let Some(mut track) = self.track.filter(|_| !anew) else {
            return self.start(measurement, Mode::Started);
        };
        let dt_s = seconds_between(track.time_us, measurement.time_us);
        if track.memory.coast_s + dt_s > SILENCE_MAX_S {
            return self.start(measurement, Mode::Started);
        }
        let step = self.predict(&mut track, measurement.time_us)?;
        let vectors = Vectors::from(measurement);
        let hypotheses = &self.parameters.hypotheses;
        let odds = hypotheses.odds(&track.memory.counts);
        let mut nis = NIS_MAX;
        // Not named before: a second mixture would lie on the stack.
        if let Some((mixture, whitened)) =
            track.weighed(&vectors, &step.interval, hypotheses, &odds)
        {
            nis = mixture.corrected.nis;
            if nis < GATE_NIS as f32 || odds[OUTLIER] < OFTEN_WRONG as f32 {
                let whitened = whitened.map(|y| y.clamp(-WHITENED_MAX, WHITENED_MAX));
                track.memory.measured(whitened, &vectors);
            } else {
                track.memory.missed();
            }
            if nis < GATE_NIS as f32 {
                track.take(&mixture.corrected);
                track.memory.explained(mixture.shares);
                if !track.settle() {
                    return self.start(measurement, Mode::Restarted);
                }
                step.remember(&mut track, true);
                self.track = Some(track);
                return self.used(measurement, &mixture);
            }
        }
        track.memory.refused();
        track.doubt(&step.interval, hypotheses, &odds);
        if !track.settle() {
            return self.start(measurement, Mode::Restarted);
        }
        step.remember(&mut track, false);
        self.track = Some(track);
        if self.is_suspected(measurement, 0.0) {
            // The measurement is the new track's own.
            self.estimate(nis, Mode::Restarted, Doubt::NONE)
        } else {
            self.estimate(nis, Mode::Rejected, Doubt::OUTLIER)
        }
    }

    /// The estimate from a measurement that the track took in. One that is probably wrong hardly
    /// moved the track, and may be another target: the candidate sees it as well.
    fn used(
        &mut self,
        measurement: &Measurement,
        mixture: &Mixture<f32>,
    ) -> Result<Estimate, StepError> {
        let (nis, doubt) = (mixture.corrected.nis, mixture.doubt());
        if doubt.outlier < SUSPECT {
            self.rejections = 0;
        } else if self.is_suspected(measurement, APART) {
            return self.estimate(nis, Mode::Restarted, Doubt::NONE);
        }
        self.estimate(nis, Mode::Tracking, doubt)
    }

    /// The estimate at `time_us` without a measurement.
    pub fn coast(&mut self, time_us: u64) -> Result<Estimate, StepError> {
        let mut track = self.track.ok_or(StepError::NotStarted)?;
        let step = self.predict(&mut track, time_us)?;
        let hypotheses = &self.parameters.hypotheses;
        let odds = hypotheses.odds(&track.memory.counts);
        track.doubt(&step.interval, hypotheses, &odds);
        if !track.settle() {
            self.forget();
            return Err(StepError::Lost);
        }
        track.memory.missed();
        step.remember(&mut track, false);
        self.track = Some(track);
        self.estimate(0.0, Mode::Coasting, Doubt::NONE)
    }

    fn start(&mut self, measurement: &Measurement, mode: Mode) -> Result<Estimate, StepError> {
        let track = Track::start(measurement, &self.parameters.population)?;
        self.forget();
        self.track = Some(track);
        self.estimate(0.0, mode, Doubt::NONE)
    }

    /// Shows the candidate a measurement that the track does not explain; true when the candidate
    /// took over, which it does only where it is `apart` deviations away.
    // Rare, and its second track would weigh on the stack of every step.
    #[inline(never)]
    fn is_suspected(&mut self, measurement: &Measurement, apart: f32) -> bool {
        self.rejections = self.rejections.saturating_add(1);
        let verdict = match &mut self.candidate {
            Some(candidate) => {
                let p = &self.parameters;
                candidate.meet(measurement, &p.base, &p.population)
            }
            None => Verdict::Over,
        };
        if verdict == Verdict::Over {
            self.candidate = Candidate::start(measurement, &self.suspected());
        }
        let (Verdict::Agreed, Some(track), Some(candidate)) = (verdict, self.track, self.candidate)
        else {
            return false;
        };
        let longer = candidate.track().used > track.used;
        let enough = self.rejections >= AGREEING || longer;
        if !enough || !track.is_apart(candidate.track(), apart) {
            return false;
        }
        self.track = Some(*candidate.track());
        self.candidate = Some(Candidate::deposed(track));
        self.rejections = 0;
        true
    }

    /// What is known of a target that the track does not explain: the population's place, and any
    /// motion within the envelope.
    fn suspected(&self) -> Population<f32> {
        Population {
            horizontal_sigma_mps: self.envelope.speed_max_mps,
            vertical_sigma_mps: self.envelope.speed_max_mps,
            acceleration_sigma_mps2: 0.5 * self.envelope.acceleration_max_mps2,
            ..self.parameters.population
        }
    }

    /// The present track as an estimate; there is one.
    fn estimate(&self, nis: f32, mode: Mode, doubt: Doubt) -> Result<Estimate, StepError> {
        let track = self.track.as_ref().ok_or(StepError::NotStarted)?;
        let held = self.envelope.holds_motion(&track.state)
            && self.envelope.holds_place(&track.state, &track.covariance);
        Ok(track.estimate(nis, mode, !held, doubt))
    }

    /// Moves the track to `time_us`, before any correction and not settled yet; returns what is still
    /// to be remembered of the last part of the way.
    fn predict(&mut self, track: &mut Track, time_us: u64) -> Result<Step, StepError> {
        let dt_s = seconds_between(track.time_us, time_us);
        track.time_us = time_us;
        let mut parts = 1_u16;
        while dt_s > INTERVAL_MAX_S * f32::from(parts) {
            parts += 1;
        }
        let interval_s = dt_s / f32::from(parts);
        let p = self.parameters;
        let wide = Schedule::wide(&p.base);
        let mut step = Step {
            interval: Interval {
                sight: track.sight(),
                noise: wide.noise,
                sensor_scale: wide.sensor_scale,
                dt_s: interval_s,
            },
            notes: [0.0; NOTES],
        };
        if interval_s <= 0.0 {
            return Ok(step);
        }
        for part in 0..parts {
            if part > 0 {
                let odds = p.hypotheses.odds(&track.memory.counts);
                track.doubt(&step.interval, &p.hypotheses, &odds);
                track.memory.missed();
                step.remember(track, false);
            }
            let sight = track.sight();
            let mut factor = None;
            step.notes = [0.0; NOTES];
            let schedule = if !self.envelope.holds_motion(&track.state) {
                wide
            } else if track.memory.coast_s > SILENCE_MAX_S
                || !self.envelope.holds_place(&track.state, &track.covariance)
            {
                Schedule::read(&[0.0; OUTPUTS], &p.base)
            } else {
                let mut inputs = features(
                    &track.state,
                    &track.covariance,
                    &track.memory,
                    &sight,
                    interval_s,
                );
                let (outputs, jerk_variance) = self.infer(&mut inputs);
                if !outputs
                    .iter()
                    .chain(&jerk_variance)
                    .all(|value| value.is_finite())
                {
                    return Err(StepError::NetworkNotFinite);
                }
                step.notes.copy_from_slice(&outputs[NOTE_OUTPUT..]);
                factor = Some(Factor::read(&outputs[SCHEDULE..NOTE_OUTPUT]));
                let mut schedule = Schedule::read(&outputs, &p.base);
                for (noise, variance) in schedule.noise.jerk.iter_mut().zip(jerk_variance) {
                    // A constant jerk of unknown size over the interval weighs like white jerk of
                    // this density.
                    *noise += variance * interval_s;
                }
                schedule
            };
            step.interval = Interval {
                sight,
                noise: schedule.noise,
                sensor_scale: schedule.sensor_scale,
                dt_s: interval_s,
            };
            track.predict(&sight, &schedule, interval_s);
            if let Some(factor) = factor {
                track.fuse(&factor, &p.population, interval_s);
            }
        }
        Ok(step)
    }

    /// The network's outputs, and the variance of the mean jerk over passes, (m/s^3)^2.
    fn infer(&mut self, inputs: &mut [f32; FEATURES]) -> ([f32; OUTPUTS], [f32; 3]) {
        let pairs = self.blob.input_normalisation().pairs();
        for (input, [mean, inverse]) in inputs.iter_mut().zip(pairs) {
            let normalised = (*input - mean) * inverse;
            *input = normalised.clamp(-FEATURE_LIMIT as f32, FEATURE_LIMIT as f32);
        }
        let mut outputs = [0.0; OUTPUTS];
        let mut variances = [0.0; OUTPUTS];
        for view in self.blob.networks() {
            let network = Network::new(view);
            if self.settings.passes == 1 {
                network.mean_pass(inputs, &mut outputs);
            } else {
                (outputs, variances) = separate_moments(
                    &network,
                    inputs,
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
        for (output, [mean, scale]) in outputs.iter_mut().zip(pairs.pairs()) {
            *output = mean + scale * *output;
        }
        (outputs, jerk_variance)
    }
}

#[cfg(test)]
mod tests;
