//! What the network answers about the coming interval, and how it is asked.

use super::factor::Factor;
use super::features::{FEATURE_LIMIT, FEATURES, features};
use super::interval::Interval;
use super::memory::NOTES;
use super::population::Base;
use super::schedule::{JERK_OUTPUT, JERK_SCALE, NOTE_OUTPUT, OUTPUTS, SCHEDULE, Schedule};
use super::sight::LineOfSight;
use super::target::Target;
use super::tracker::Recursive;
use crate::inference::{Inference, Passes};
use crate::network::monte_carlo::separate_moments_into;
use crate::network::repeats::Repeats;
use crate::network::{Network, moments};
use crate::part::Part;
use crate::step_error::StepError;

/// What a target moves by.
#[derive(Clone, Copy)]
pub(super) struct Answer {
    pub schedule: Schedule<f32>,
    /// What the network says of the state; none where it was not asked.
    pub factor: Option<Factor<f32>>,
    /// What it notes for itself.
    pub notes: [f32; NOTES],
}

impl Answer {
    /// Before anything was asked.
    pub fn of(base: &Base<f32>) -> Self {
        Self {
            schedule: Schedule::wide(base),
            factor: None,
            notes: [0.0; NOTES],
        }
    }

    /// What the step after a prediction of `dt_s` along `sight` must know, which began `coast_s` after the
    /// last measurement.
    pub fn interval(&self, sight: LineOfSight<f32>, dt_s: f32, coast_s: f32) -> Interval<f32> {
        Interval {
            sight,
            noise: self.schedule.noise,
            sensor_scale: self.schedule.sensor_scale,
            dt_s,
            coast_s,
        }
    }
}

/// What the network is asked with.
// What it takes to compute it would lie under the network.
#[inline(never)]
fn observed(target: &Target, sight: &LineOfSight<f32>, interval_s: f32) -> [f32; FEATURES] {
    features(
        &target.state,
        &target.covariance,
        &target.memory,
        sight,
        interval_s,
    )
}

impl Recursive<'_, '_> {
    /// How the target, which is seen along `sight`, moves during `interval_s`: what the network answers,
    /// or a model that needs none far from where it was trained.
    #[inline(never)]
    pub(super) fn ask(
        &mut self,
        sight: &LineOfSight<f32>,
        interval_s: f32,
        answer: &mut Answer,
    ) -> Result<(), StepError> {
        let base = &self.model.parameters.base;
        let target = &self.workspace.target;
        answer.factor = None;
        answer.notes = [0.0; NOTES];
        if let Some(schedule) = self.model.unasked(target, target.memory.coast_s) {
            answer.schedule = schedule;
            return Ok(());
        }
        let mut inputs = observed(target, sight, interval_s);
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
    pub(super) fn infer(
        &mut self,
        inputs: &mut [f32; FEATURES],
        outputs: &mut [f32; OUTPUTS],
    ) -> [f32; 3] {
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
                    // Training leaves no unit of such a network unused.
                    let repeats = &Repeats::NONE;
                    let [[x, _, _], [_, y, _], [_, _, z]] =
                        moments::outputs(&network, repeats, inputs, outputs, JERK_OUTPUT, scratch);
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
