//! The filter around the network: start, predict, gate, correct, agree, settle.

use super::belief::Belief;
use super::candidate::{AGREEING, Candidate, Verdict};
use super::correction::{GATE_NIS, correct_soundly};
use super::factor::Factor;
use super::features::{FEATURE_LIMIT, FEATURES, features};
use super::foresight::AHEAD_S;
use super::hypotheses::{OFTEN_WRONG, OUTLIER};
use super::interval::Interval;
use super::memory::NOTES;
use super::mixture::Mixture;
use super::model::Model;
use super::population::{Base, Population};
use super::schedule::{JERK_OUTPUT, JERK_SCALE, NOTE_OUTPUT, OUTPUTS, SCHEDULE, Schedule};
use super::sight::LineOfSight;
use super::target::Target;
use crate::clock::seconds_between;
use crate::ekf::EkfError;
use crate::estimate::{Doubt, Estimate, Mode, NIS_MAX, Outcome};
use crate::inference::{Inference, Passes};
use crate::likelihood::Likelihood;
use crate::measurement::{Measurement, Vectors};
use crate::network::monte_carlo::separate_moments_into;
use crate::network::{Network, moments};
use crate::part::Part;
use crate::rng::Generator;
use crate::settings::Settings;
use crate::step_error::StepError;
use crate::workspace::Workspace;

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
pub(crate) const WHITENED_MAX: f32 = 1e3;

/// Puts a candidate in the place of another.
// Apart: it goes by the stack.
#[inline(never)]
fn renew(
    place: &mut Option<Candidate>,
    measurement: &Measurement,
    prior: &Population<f32>,
    room: &mut Target,
) {
    *place = Candidate::start(measurement, prior, room);
}

/// A nine-state filter over one target, driven by the network of a recursive blob: what one call of it
/// works with. The target moves in the workspace, so that a call that is refused leaves no trace.
pub(crate) struct Recursive<'r, 'a> {
    pub model: &'r Model<'a>,
    pub settings: &'r Settings,
    pub rng: &'r mut Generator,
    pub belief: &'r mut Belief,
    pub workspace: &'r mut Workspace,
}

/// What one answer of the network means after the prediction.
struct Step {
    /// For the correction.
    interval: Interval<f32>,
    /// For the memory, once the velocity after the correction is known.
    notes: [f32; NOTES],
}

/// What a target moves by.
#[derive(Clone, Copy)]
pub(super) struct Answer {
    pub schedule: Schedule<f32>,
    /// What the network says of the state; none where it was not asked.
    pub factor: Option<Factor<f32>>,
    /// What it notes for itself.
    notes: [f32; NOTES],
}

/// What a measurement and a prediction make of each other.
struct Comparison {
    /// Normalised innovation squared.
    nis: f32,
    /// What the measurement says against the model; `None` if it was not used.
    doubt: Option<Doubt>,
}

impl Answer {
    /// Before anything was asked.
    fn of(base: &Base<f32>) -> Self {
        Self {
            schedule: Schedule::wide(base),
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
    /// Lets a target remember the step.
    fn remember(&self, target: &mut Target, used: bool) {
        if self.interval.dt_s > 0.0 {
            let used = f32::from(u8::from(used));
            let velocity = target.velocity();
            target
                .memory
                .stepped(self.interval.dt_s, used, velocity, &self.notes);
        }
    }
}

impl Recursive<'_, '_> {
    /// Takes in a measurement, whose values and time were checked; `anew` when its time does not follow
    /// the ones before.
    // Apart from its callers: what they hold would add up with what this calls.
    #[inline(never)]
    pub fn step(&mut self, measurement: &Measurement, anew: bool) -> Result<Outcome, StepError> {
        let silent_s = match &self.belief.target {
            Some(target) if !anew => {
                target.memory.coast_s + seconds_between(target.time_us, measurement.time_us)
            }
            _ => f32::INFINITY,
        };
        if silent_s > SILENCE_MAX_S {
            return self.start(measurement, Mode::Started);
        }
        self.set_out()?;
        self.workspace
            .target
            .seen_from(measurement.sensor.position_m);
        let step = self.predict(measurement.time_us)?;
        let Comparison { nis, doubt } = self.compare(measurement, &step.interval);
        let target = &mut self.workspace.target;
        if !target.settle() {
            return self.start(measurement, Mode::Restarted);
        }
        if doubt.is_some() {
            let Target {
                time_us,
                state,
                covariance,
                foresight,
                ..
            } = target;
            foresight.compare(*time_us, state, covariance);
        }
        step.remember(target, doubt.is_some());
        self.belief.hold(target);
        let (mode, doubt, apart) = match doubt {
            Some(doubt) if doubt.outlier < SUSPECT => {
                self.belief.rejections = 0;
                let mode = Mode::Tracking;
                return Ok(Outcome { nis, mode, doubt });
            }
            // It hardly moved the track, and may be another target: the candidate sees it as well.
            Some(doubt) => (Mode::Tracking, doubt, APART),
            None => (Mode::Rejected, Doubt::OUTLIER, 0.0),
        };
        if self.is_suspected(measurement, apart) {
            // The measurement is the new track's own.
            let (mode, doubt) = (Mode::Restarted, Doubt::NONE);
            return Ok(Outcome { nis, mode, doubt });
        }
        Ok(Outcome { nis, mode, doubt })
    }

    /// Takes the target that is known along, to be moved.
    fn set_out(&mut self) -> Result<(), StepError> {
        let target = self.belief.target.as_ref().ok_or(StepError::NotStarted)?;
        self.workspace.target.copy_from(target);
        Ok(())
    }

    /// Corrects the predicted target with a measurement within the gate, and doubts it otherwise.
    // The corrections are off the stack before the candidate's turn.
    #[inline(never)]
    fn compare(&mut self, measurement: &Measurement, interval: &Interval<f32>) -> Comparison {
        let target = &mut self.workspace.target;
        let vectors = Vectors::from(measurement);
        let sensor_mps = measurement.sensor.velocity_mps;
        let hypotheses = &self.model.parameters.hypotheses;
        let odds = hypotheses.odds(&target.memory.counts);
        let mut nis = NIS_MAX;
        target.relative_to(sensor_mps);
        let mut mixture = Mixture::new();
        mixture.corrected.begin(&target.state, &target.covariance);
        if let Some(whitened) = target.weighed(&vectors, interval, hypotheses, &odds, &mut mixture)
        {
            nis = mixture.corrected.nis;
            if nis < GATE_NIS as f32 || odds[OUTLIER] < OFTEN_WRONG as f32 {
                let whitened = whitened.map(|y| y.clamp(-WHITENED_MAX, WHITENED_MAX));
                target.memory.measured(whitened, &vectors);
            } else {
                target.memory.missed();
            }
            if nis < GATE_NIS as f32 {
                target.take(&mixture.corrected);
                target.over_ground(sensor_mps);
                target.memory.explained(mixture.shares);
                return Comparison {
                    nis,
                    doubt: Some(mixture.doubt()),
                };
            }
        }
        target.over_ground(sensor_mps);
        target.memory.refused();
        target.doubt(interval, hypotheses, &odds);
        Comparison { nis, doubt: None }
    }

    /// Goes on to `time_us` without a measurement, as the sensor of the latest one sees it.
    pub fn coast(&mut self, time_us: u64) -> Result<Outcome, StepError> {
        self.set_out()?;
        let step = self.predict(time_us)?;
        let target = &mut self.workspace.target;
        let hypotheses = &self.model.parameters.hypotheses;
        let odds = hypotheses.odds(&target.memory.counts);
        target.doubt(&step.interval, hypotheses, &odds);
        if !target.settle() {
            self.belief.forget();
            return Err(StepError::Lost);
        }
        target.memory.missed();
        step.remember(target, false);
        self.belief.hold(target);
        Ok(Outcome::uncorrected(Mode::Coasting))
    }

    /// Gives estimates at times that lie in order and not before the target's to `each`, one by one with
    /// its place. The track stays as it is.
    ///
    /// A copy of the target moves by one answer of the network, along a grid whose parts double: half a
    /// second, one, two, four; times between are reached from the grid. So a forecast does not depend
    /// on what else is asked for, and costs little more than its furthest time.
    pub fn forecast_each(
        &mut self,
        times_us: &[u64],
        each: &mut dyn FnMut(usize, &Estimate),
    ) -> Result<(), StepError> {
        self.set_out()?;
        let mut answer = Answer::of(&self.model.parameters.base);
        self.ask_ahead(&mut answer)?;
        self.follow(&answer, times_us, each)
    }

    /// How the target moves if nothing more is measured.
    // Apart from what follows it: the network's stack and that of the estimates take turns.
    #[inline(never)]
    fn ask_ahead(&mut self, answer: &mut Answer) -> Result<(), StepError> {
        let rng = self.rng.clone();
        let asked = self.ask(&self.workspace.target.sight(), FORECAST_ASKED_S, answer);
        *self.rng = rng;
        asked?;
        self.model.unmeasured(&self.workspace.target, answer);
        Ok(())
    }

    /// The estimates of a target that moves by an answer.
    #[inline(never)]
    fn follow(
        &mut self,
        answer: &Answer,
        times_us: &[u64],
        each: &mut dyn FnMut(usize, &Estimate),
    ) -> Result<(), StepError> {
        let ahead = &mut self.workspace.target;
        let (start_us, before_m2) = (ahead.time_us, ahead.position_variance());
        let coasted = Outcome::uncorrected(Mode::Coasting);
        let mut there = Target::NONE;
        let (mut from_s, mut to_s) = (0.0, FORECAST_FIRST_S);
        for (place, &time_us) in times_us.iter().enumerate() {
            let time_s = seconds_between(start_us, time_us);
            while time_s >= to_s {
                self.model.advance(ahead, answer, to_s - from_s);
                (from_s, to_s) = (to_s, 2.0 * to_s);
            }
            there.copy_from(ahead);
            there.time_us = time_us;
            self.model.advance(&mut there, answer, time_s - from_s);
            there.foresight.widen(&mut there.covariance, before_m2);
            if !there.settle() {
                return Err(StepError::Lost);
            }
            each(place, &self.model.estimate(&there, coasted));
        }
        Ok(())
    }

    /// Writes down where the target, which is at `time_us`, is expected a little later.
    // Its copy must not weigh on the stack of every step.
    #[inline(never)]
    fn foresee(&mut self, time_us: u64, answer: &Answer) {
        let target = &mut self.workspace.target;
        let (mut ahead, mut unmeasured) = (Target::NONE, *answer);
        ahead.copy_from(target);
        self.model.unmeasured(target, &mut unmeasured);
        self.model.advance(&mut ahead, &unmeasured, AHEAD_S);
        target
            .foresight
            .expect(time_us, &ahead.state, &ahead.covariance);
    }

    /// What the track, which stays as it is, says of a measurement whose values were checked and that
    /// does not lie before it.
    pub fn likelihood(&mut self, measurement: &Measurement) -> Result<Likelihood, StepError> {
        self.set_out()?;
        let target = &mut self.workspace.target;
        target.seen_from(measurement.sensor.position_m);
        target.foresight.close();
        let rng = self.rng.clone();
        let step = self.predict(measurement.time_us);
        *self.rng = rng;
        self.fit(measurement, &step?.interval)
    }

    /// How well a measurement fits the predicted target.
    // The network's stack and that of the corrections take turns.
    #[inline(never)]
    fn fit(
        &mut self,
        measurement: &Measurement,
        interval: &Interval<f32>,
    ) -> Result<Likelihood, StepError> {
        let target = &mut self.workspace.target;
        target.relative_to(measurement.sensor.velocity_mps);
        let vectors = Vectors::from(measurement);
        let hypotheses = &self.model.parameters.hypotheses;
        let odds = hypotheses.odds(&target.memory.counts);
        let spoilt = StepError::Correction(EkfError::NotFinite);
        let mut mixture = Mixture::new();
        mixture.corrected.begin(&target.state, &target.covariance);
        correct_soundly(&mut mixture.corrected, &vectors, interval.sensor_scale).ok_or(spoilt)?;
        let (nis, ln_root) = (mixture.corrected.nis, mixture.corrected.ln_root);
        mixture.corrected.begin(&target.state, &target.covariance);
        target
            .weighed(&vectors, interval, hypotheses, &odds, &mut mixture)
            .ok_or(spoilt)?;
        let innovation = target.innovation(&vectors);
        let gate_nis = mixture.corrected.nis;
        Likelihood::new(innovation, &vectors, nis, ln_root, gate_nis).ok_or(spoilt)
    }

    fn start(&mut self, measurement: &Measurement, mode: Mode) -> Result<Outcome, StepError> {
        let target = &mut self.workspace.target;
        target.start(measurement, &self.model.parameters.population)?;
        self.belief.forget();
        self.belief.hold(target);
        Ok(Outcome::uncorrected(mode))
    }

    /// Shows the candidate a measurement that the track does not explain; true when the candidate
    /// took over, which it does only where it is `apart` deviations away.
    // Rare, and its correction would weigh on the stack of every step.
    #[inline(never)]
    fn is_suspected(&mut self, measurement: &Measurement, apart: f32) -> bool {
        let p = &self.model.parameters;
        let room = &mut self.workspace.target;
        let Belief {
            target,
            rejections,
            candidate,
        } = &mut *self.belief;
        *rejections = rejections.saturating_add(1);
        let verdict = match candidate {
            Some(candidate) => candidate.meet(measurement, &p.base, &p.population, room),
            None => Verdict::Over,
        };
        if verdict == Verdict::Over {
            renew(candidate, measurement, &self.model.suspected(), room);
        }
        let (Verdict::Agreed, Some(target), Some(candidate)) = (verdict, target, candidate) else {
            return false;
        };
        let longer = candidate.target().used > target.used;
        let enough = *rejections >= AGREEING || longer;
        if !enough || !target.is_apart(candidate.target(), apart) {
            return false;
        }
        candidate.depose(target);
        *rejections = 0;
        true
    }

    /// Moves the target to `time_us`, before any correction and not settled yet; returns what is still
    /// to be remembered of the last part of the way.
    #[inline(never)]
    fn predict(&mut self, time_us: u64) -> Result<Step, StepError> {
        let target = &mut self.workspace.target;
        let start_us = target.time_us;
        let dt_s = seconds_between(start_us, time_us);
        target.time_us = time_us;
        let mut parts = 1_u16;
        while dt_s > INTERVAL_MAX_S * f32::from(parts) {
            parts += 1;
        }
        let interval_s = dt_s / f32::from(parts);
        let p = &self.model.parameters;
        let mut answer = Answer::of(&p.base);
        let mut step = Step {
            interval: answer.interval(target.sight(), interval_s),
            notes: answer.notes,
        };
        if interval_s <= 0.0 {
            return Ok(step);
        }
        for part in 0..parts {
            let target = &mut self.workspace.target;
            if part > 0 {
                let odds = p.hypotheses.odds(&target.memory.counts);
                target.doubt(&step.interval, &p.hypotheses, &odds);
                target.memory.missed();
                step.remember(target, false);
            }
            let sight = target.sight();
            self.ask(&sight, interval_s, &mut answer)?;
            step.notes = answer.notes;
            step.interval = answer.interval(sight, interval_s);
            let idle = self.workspace.target.foresight.is_idle();
            if part == 0 && idle && answer.factor.is_some() {
                self.foresee(start_us, &answer);
            }
            let target = &mut self.workspace.target;
            target.predict(&sight, &answer.schedule, interval_s);
            if let Some(factor) = &answer.factor {
                target.fuse(factor, &p.population, interval_s);
            }
        }
        Ok(step)
    }

    /// How the target, which is seen along `sight`, moves during `interval_s`: what the network answers,
    /// or a model that needs none where it was not trained.
    #[inline(never)]
    fn ask(
        &mut self,
        sight: &LineOfSight<f32>,
        interval_s: f32,
        answer: &mut Answer,
    ) -> Result<(), StepError> {
        let Model {
            parameters,
            envelope,
            ..
        } = self.model;
        let base = &parameters.base;
        let target = &self.workspace.target;
        answer.factor = None;
        answer.notes = [0.0; NOTES];
        if !envelope.holds_motion(&target.state) {
            answer.schedule = Schedule::wide(base);
            return Ok(());
        }
        if target.memory.coast_s > SILENCE_MAX_S
            || !envelope.holds_place(&target.state, &target.covariance)
        {
            answer.schedule = Schedule::read(&[0.0; OUTPUTS], base);
            return Ok(());
        }
        let mut inputs = features(
            &target.state,
            &target.covariance,
            &target.memory,
            sight,
            interval_s,
        );
        let mut outputs = [0.0; OUTPUTS];
        let jerk_variance = self.infer(&mut inputs, &mut outputs);
        if !outputs
            .iter()
            .chain(&jerk_variance)
            .all(|value| value.is_finite())
        {
            return Err(StepError::NetworkNotFinite);
        }
        answer.schedule = Schedule::read(&outputs, base);
        answer.factor = Some(Factor::read(&outputs[SCHEDULE..NOTE_OUTPUT]));
        answer.notes.copy_from_slice(&outputs[NOTE_OUTPUT..]);
        for (noise, variance) in answer.schedule.noise.jerk.iter_mut().zip(jerk_variance) {
            // A constant jerk of unknown size over the interval weighs like white jerk of this
            // density.
            *noise += variance * interval_s;
        }
        Ok(())
    }

    /// Writes the network's outputs; returns the variance of the mean jerk, (m/s^3)^2.
    fn infer(&mut self, inputs: &mut [f32; FEATURES], outputs: &mut [f32; OUTPUTS]) -> [f32; 3] {
        let pairs = self.model.blob.input_normalisation().pairs();
        for (input, [mean, inverse]) in inputs.iter_mut().zip(pairs) {
            let normalised = (*input - mean) * inverse;
            *input = normalised.clamp(-FEATURE_LIMIT as f32, FEATURE_LIMIT as f32);
        }
        let mut jerk_variance = [0.0; 3];
        for view in self.model.blob.networks() {
            let network = Network::new(view);
            match self.settings.inference {
                Inference::Passes(passes) if Part::Passes.is_built() => {
                    jerk_variance = self.draw(&network, passes, inputs, outputs);
                }
                Inference::Moments if Part::Moments.is_built() => {
                    let scratch = &mut self.workspace.scratch;
                    let [[x, _, _], [_, y, _], [_, _, z]] =
                        moments::outputs(&network, inputs, outputs, JERK_OUTPUT, scratch);
                    jerk_variance = [x, y, z];
                }
                // No settings were accepted for what is left out.
                Inference::Mean | Inference::Passes(_) | Inference::Moments => {
                    network.mean_pass_in(&mut self.workspace.scratch, inputs, outputs);
                }
            }
        }
        let pairs = self.model.blob.output_normalisation();
        let scale = |i: usize| pairs.get(2 * i + 1);
        for (axis, variance) in jerk_variance.iter_mut().enumerate() {
            let output = JERK_OUTPUT + axis;
            *variance *= (JERK_SCALE * JERK_SCALE) as f32 * scale(output) * scale(output);
        }
        for (output, [mean, scale]) in outputs.iter_mut().zip(pairs.pairs()) {
            *output = mean + scale * *output;
        }
        jerk_variance
    }

    /// The mean of the network's outputs over passes; returns the variance of those that are a mean
    /// jerk.
    // Sums over passes would weigh on the stack of a mean pass.
    #[inline(never)]
    fn draw(
        &mut self,
        network: &Network<'_>,
        passes: Passes,
        inputs: &[f32; FEATURES],
        outputs: &mut [f32; OUTPUTS],
    ) -> [f32; 3] {
        let mut variances = [0.0; OUTPUTS];
        separate_moments_into(
            network,
            inputs,
            passes.count(),
            passes.spread(),
            self.rng,
            &mut self.workspace.scratch,
            (outputs, &mut variances),
        );
        core::array::from_fn(|axis| variances[JERK_OUTPUT + axis])
    }
}

#[cfg(test)]
mod tests;
