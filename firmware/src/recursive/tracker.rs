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
use super::sight::LineOfSight;
use super::track::Track;
use crate::blob::Blob;
use crate::clock::seconds_between;
use crate::ekf::EkfError;
use crate::estimate::{Doubt, Estimate, Mode, NIS_MAX};
use crate::likelihood::Likelihood;
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
/// Part of a forecast that the network is asked about, s: the longest that it knows.
const FORECAST_ASKED_S: f32 = INTERVAL_MAX_S;
/// First part of a forecast, s; every part after it reaches twice as far ahead.
const FORECAST_FIRST_S: f32 = 0.5;
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

/// What a [`Recursive`] knows at one time.
#[derive(Clone)]
pub(crate) struct Snapshot {
    rng: Generator,
    track: Option<Track>,
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

/// What a track moves by.
struct Answer {
    schedule: Schedule<f32>,
    /// What the network says of the state; none where it was not asked.
    factor: Option<Factor<f32>>,
    /// What it notes for itself.
    notes: [f32; NOTES],
}

impl Answer {
    /// A model that no network was asked for.
    fn unasked(schedule: Schedule<f32>) -> Self {
        Self {
            schedule,
            factor: None,
            notes: [0.0; NOTES],
        }
    }

    /// What the step after a prediction of `dt_s` along `sight` must know.
    fn interval(&self, sight: LineOfSight<f32>, dt_s: f32) -> Interval<f32> {
        Interval {
            sight,
            noise: self.schedule.noise,
            sensor_scale: self.schedule.sensor_scale,
            dt_s,
        }
    }
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

    /// A copy of what it knows.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            rng: self.rng.clone(),
            track: self.track,
            rejections: self.rejections,
            candidate: self.candidate,
        }
    }

    /// Goes back to what it knew when `snapshot` was taken.
    pub fn restore(&mut self, snapshot: &Snapshot) {
        self.rng = snapshot.rng.clone();
        self.track = snapshot.track;
        self.rejections = snapshot.rejections;
        self.candidate = snapshot.candidate;
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
        track.seen_from(measurement.sensor.position_m);
        let step = self.predict(&mut track, measurement.time_us)?;
        let vectors = Vectors::from(measurement);
        let sensor_mps = measurement.sensor.velocity_mps;
        let hypotheses = &self.parameters.hypotheses;
        let odds = hypotheses.odds(&track.memory.counts);
        let mut nis = NIS_MAX;
        track.relative_to(sensor_mps);
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
                track.over_ground(sensor_mps);
                track.memory.explained(mixture.shares);
                if !track.settle() {
                    return self.start(measurement, Mode::Restarted);
                }
                step.remember(&mut track, true);
                self.track = Some(track);
                return self.used(measurement, &mixture);
            }
        }
        track.over_ground(sensor_mps);
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

    /// The estimate at `time_us` without a measurement, as the sensor of the latest one sees it.
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

    /// Estimates at times that lie in order and not before the track's. The track stays as it is.
    ///
    /// A copy of it moves by one answer of the network, along a grid whose parts double: half a
    /// second, one, two, four; times between are reached from the grid. So a forecast does not depend
    /// on what else is asked for, and costs little more than its furthest time.
    pub fn forecasts<const N: usize>(
        &mut self,
        times_us: &[u64; N],
    ) -> Result<[Estimate; N], StepError> {
        let answer = self.ask_ahead()?;
        self.follow(&answer, times_us)
    }

    /// How the track moves if nothing more is measured.
    // Apart from what follows it: the network's stack and that of the estimates take turns.
    #[inline(never)]
    fn ask_ahead(&mut self) -> Result<Answer, StepError> {
        let track = self.track.ok_or(StepError::NotStarted)?;
        let rng = self.rng.clone();
        let answer = self.ask(&track, &track.sight(), FORECAST_ASKED_S);
        self.rng = rng;
        let mut answer = answer?;
        let hypotheses = &self.parameters.hypotheses;
        let odds = hypotheses.odds(&track.memory.counts);
        // As in a gap, but at once: noise adds up, and nothing is counted on the way.
        let nominal = answer.schedule.noise;
        answer.schedule.noise = nominal.plus(&hypotheses.expected(&odds, &nominal));
        Ok(answer)
    }

    /// The estimates of a copy of the track that moves by an answer.
    fn follow<const N: usize>(
        &self,
        answer: &Answer,
        times_us: &[u64; N],
    ) -> Result<[Estimate; N], StepError> {
        let mut ahead = self.track.ok_or(StepError::NotStarted)?;
        let start_us = ahead.time_us;
        let mut forecasts = [self.estimate_of(&ahead, 0.0, Mode::Coasting, Doubt::NONE); N];
        let (mut from_s, mut to_s) = (0.0, FORECAST_FIRST_S);
        for (forecast, &time_us) in forecasts.iter_mut().zip(times_us) {
            let time_s = seconds_between(start_us, time_us);
            while time_s >= to_s {
                self.advance(&mut ahead, answer, to_s - from_s);
                (from_s, to_s) = (to_s, 2.0 * to_s);
            }
            let mut there = ahead;
            there.time_us = time_us;
            self.advance(&mut there, answer, time_s - from_s);
            if !there.settle() {
                return Err(StepError::Lost);
            }
            *forecast = self.estimate_of(&there, 0.0, Mode::Coasting, Doubt::NONE);
        }
        Ok(forecasts)
    }

    /// Moves a track ahead by an answer, with nothing remembered and not settled yet.
    fn advance(&self, track: &mut Track, answer: &Answer, dt_s: f32) {
        if dt_s <= 0.0 {
            return;
        }
        track.predict(&track.sight(), &answer.schedule, dt_s);
        if let Some(factor) = answer.factor {
            track.fuse(&factor, &self.parameters.population, dt_s);
        }
    }

    /// What the track, which stays as it is, says of a measurement whose values were checked and that
    /// does not lie before it.
    #[inline(never)]
    pub fn likelihood(&mut self, measurement: &Measurement) -> Result<Likelihood, StepError> {
        let mut track = self.track.ok_or(StepError::NotStarted)?;
        track.seen_from(measurement.sensor.position_m);
        let rng = self.rng.clone();
        let step = self.predict(&mut track, measurement.time_us);
        self.rng = rng;
        let interval = step?.interval;
        track.relative_to(measurement.sensor.velocity_mps);
        let vectors = Vectors::from(measurement);
        let hypotheses = &self.parameters.hypotheses;
        let odds = hypotheses.odds(&track.memory.counts);
        let spoilt = StepError::Correction(EkfError::NotFinite);
        let (nominal, _) = track
            .corrected(&vectors, interval.sensor_scale)
            .ok_or(spoilt)?;
        let (mixture, _) = track
            .weighed(&vectors, &interval, hypotheses, &odds)
            .ok_or(spoilt)?;
        let innovation = track.innovation(&vectors);
        Likelihood::new(innovation, &vectors, &nominal, mixture.corrected.nis).ok_or(spoilt)
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
        Ok(self.estimate_of(track, nis, mode, doubt))
    }

    /// A track as an estimate.
    fn estimate_of(&self, track: &Track, nis: f32, mode: Mode, doubt: Doubt) -> Estimate {
        let held = self.envelope.holds_motion(&track.state)
            && self.envelope.holds_place(&track.state, &track.covariance);
        track.estimate(nis, mode, !held, doubt)
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
            let answer = self.ask(track, &sight, interval_s)?;
            step.notes = answer.notes;
            step.interval = answer.interval(sight, interval_s);
            track.predict(&sight, &answer.schedule, interval_s);
            if let Some(factor) = answer.factor {
                track.fuse(&factor, &p.population, interval_s);
            }
        }
        Ok(step)
    }

    /// How a track that is seen along `sight` moves during `interval_s`: what the network answers, or
    /// a model that needs none where it was not trained.
    // In its caller's frame: one of its own would cost half a kilobyte of stack.
    #[inline(always)]
    fn ask(
        &mut self,
        track: &Track,
        sight: &LineOfSight<f32>,
        interval_s: f32,
    ) -> Result<Answer, StepError> {
        let base = self.parameters.base;
        if !self.envelope.holds_motion(&track.state) {
            return Ok(Answer::unasked(Schedule::wide(&base)));
        }
        if track.memory.coast_s > SILENCE_MAX_S
            || !self.envelope.holds_place(&track.state, &track.covariance)
        {
            return Ok(Answer::unasked(Schedule::read(&[0.0; OUTPUTS], &base)));
        }
        let mut inputs = features(
            &track.state,
            &track.covariance,
            &track.memory,
            sight,
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
        let mut answer = Answer {
            schedule: Schedule::read(&outputs, &base),
            factor: Some(Factor::read(&outputs[SCHEDULE..NOTE_OUTPUT])),
            notes: [0.0; NOTES],
        };
        answer.notes.copy_from_slice(&outputs[NOTE_OUTPUT..]);
        for (noise, variance) in answer.schedule.noise.jerk.iter_mut().zip(jerk_variance) {
            // A constant jerk of unknown size over the interval weighs like white jerk of this
            // density.
            *noise += variance * interval_s;
        }
        Ok(answer)
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
                    self.settings.spread,
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
