//! The filter around the network: start, predict, gate, correct, agree, settle.

use super::answer::Answer;
use super::belief::Belief;
use super::candidate::{AGREEING, Candidate, Verdict};
use super::correction::{GATE_NIS, correct_soundly};
use super::envelope::SILENCE_MAX_S;
use super::foresight::AHEAD_S;
use super::interval::Interval;
use super::memory::NOTES;
use super::mixture::{Mixture, SUSPECT};
use super::model::Model;
use super::population::Population;
use super::steady::Steady;
use super::target::Target;
use crate::clock::seconds_between;
use crate::ekf::EkfError;
use crate::estimate::{Doubt, Mode, NIS_MAX, Outcome};
use crate::likelihood::Likelihood;
use crate::measurement::{Measurement, Vectors};
use crate::rng::Generator;
use crate::settings::Settings;
use crate::step_error::StepError;
use crate::workspace::Workspace;

/// Longest time that one schedule is used for, s; longer gaps are predicted in equal parts.
pub(super) const INTERVAL_MAX_S: f32 = 0.25;

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

/// What a measurement and a prediction make of each other.
struct Comparison {
    /// Normalised innovation squared.
    nis: f32,
    /// What the measurement says against the model; `None` if it was not used.
    doubt: Option<Doubt>,
}

impl Step {
    /// Lets a target remember the step.
    // What it needs would lie under the network, which is asked from the same frame.
    #[inline(never)]
    fn remember(&self, target: &mut Target, used: bool) {
        if self.interval.dt_s > 0.0 {
            let used = f32::from(u8::from(used));
            let velocity = target.velocity();
            target
                .memory
                .stepped(self.interval.dt_s, used, velocity, &self.notes);
        } else if used {
            // At the very time of a coast, or of a reading that was rejected: it ends the silence all the same.
            target.memory.coast_s = 0.0;
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
        let Some(Comparison { nis, doubt }) = self.compare(measurement, &step.interval) else {
            return self.start(measurement, Mode::Restarted);
        };
        let target = &mut self.workspace.target;
        if !target.settle() {
            return self.start(measurement, Mode::Restarted);
        }
        if doubt.is_some() {
            target.learn_from_forecast(self.model.parameters.bend);
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

    /// Time before the next interval that nobody looked at the target, s. Where readings were rejected or suspected
    /// somebody looked: among false alarms hypotheses that look back over them follow the alarms.
    fn unseen_s(&self) -> f32 {
        if self.belief.rejections == 0 {
            self.workspace.target.memory.coast_s
        } else {
            0.0
        }
    }

    /// Takes the target that is known along, to be moved.
    pub(super) fn set_out(&mut self) -> Result<(), StepError> {
        let target = self.belief.target.as_ref().ok_or(StepError::NotStarted)?;
        self.workspace.target.copy_from(target);
        Ok(())
    }

    /// Corrects the predicted target with a measurement within the gate, and doubts it otherwise; of one that
    /// it was relocated by, the range-rate alone is left. `None` if both together are beyond the gate: then neither
    /// place nor velocity of the prediction is left, and the measurement cannot be called rejected.
    // The corrections are off the stack before the candidate's turn.
    #[inline(never)]
    fn compare(
        &mut self,
        measurement: &Measurement,
        interval: &Interval<f32>,
    ) -> Option<Comparison> {
        let target = &mut self.workspace.target;
        let mut vectors = Vectors::from(measurement);
        let before_m = self
            .belief
            .target
            .as_ref()
            .map_or([0.0; 3], |held| held.sensor_m);
        let population = &self.model.parameters.population;
        let place_nis = target.relocate(&mut vectors, population, before_m);
        let sensor_mps = measurement.sensor.velocity_mps;
        let hypotheses = &self.model.parameters.hypotheses;
        let odds = hypotheses.odds(&target.memory.counts);
        let beyond = place_nis.is_some_and(|nis| nis >= GATE_NIS as f32);
        let (place_nis, relocated) = (place_nis.unwrap_or(0.0), place_nis.is_some() && !beyond);
        let mut nis = NIS_MAX;
        target.relative_to(sensor_mps);
        let mut mixture = Mixture::new();
        mixture.corrected.begin(&target.state, &target.covariance);
        if beyond {
            // It lies beyond all that the prediction leaves open.
            nis = place_nis;
            target.memory.missed();
        } else if let Some(whitened) =
            target.weighed(&vectors, interval, hypotheses, &odds, &mut mixture)
        {
            nis = mixture.corrected.nis + place_nis;
            // Of a place it was not asked whether it may be wrong.
            let passed = if relocated {
                nis < GATE_NIS as f32
            } else {
                mixture.passes_gate()
            };
            if passed || hypotheses.trust(&target.memory.counts) > 0.0 {
                let whitened = whitened.map(|y| y.clamp(-WHITENED_MAX, WHITENED_MAX));
                target.memory.measured(whitened, &vectors);
            } else {
                target.memory.missed();
            }
            if passed {
                target.take(&mixture.corrected);
                target.over_ground(sensor_mps);
                target.memory.explained(mixture.shares);
                return Some(Comparison {
                    nis,
                    doubt: Some(mixture.doubt()),
                });
            }
        }
        if relocated {
            return None;
        }
        target.over_ground(sensor_mps);
        target.memory.refused();
        target.doubt(interval, hypotheses, &odds);
        Some(Comparison { nis, doubt: None })
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

    /// Writes down where the target, which is at `time_us`, is expected a little later.
    // Its copy must not weigh on the stack of every step.
    #[inline(never)]
    fn foresee(&mut self, time_us: u64, answer: &Answer) {
        let target = &mut self.workspace.target;
        let (mut ahead, mut unmeasured) = (Target::NONE, *answer);
        ahead.copy_from(target);
        self.model.unmeasured(target, &mut unmeasured);
        self.model.advance(&mut ahead, &unmeasured, AHEAD_S);
        let now = Steady::of(&target.state);
        target
            .foresight
            .expect(time_us, &now, &ahead.state, &ahead.covariance);
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
        let passes_gate = mixture.passes_gate();
        Likelihood::new(innovation, &vectors, nis, ln_root, passes_gate).ok_or(spoilt)
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
            interval: answer.interval(target.sight(), interval_s, 0.0),
            notes: answer.notes,
        };
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
            let coast_s = self.unseen_s();
            step.interval = answer.interval(sight, interval_s, coast_s);
            if interval_s <= 0.0 {
                // Nothing moves, and a sensor is as good as it says; but a manoeuvre may have begun just before, which is a
                // multiple of the noise that the network expects.
                step.interval.sensor_scale = [1.0; 3];
                return Ok(step);
            }
            let idle = self.workspace.target.foresight.is_idle();
            if part == 0 && idle && answer.factor.is_some() {
                self.foresee(start_us, &answer);
            }
            let target = &mut self.workspace.target;
            target.go_on(&sight, &answer.schedule, interval_s, p.bend);
            if let Some(factor) = &answer.factor {
                target.fuse(factor, &p.population, interval_s);
            }
        }
        Ok(step)
    }
}

#[cfg(test)]
mod tests;
