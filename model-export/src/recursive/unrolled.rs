//! Network and filter unrolled over a window of steps, forwards and back.

use core::ops::Range;

use super::batch::Batch;
use super::carry::CARRY;
use super::network::gradient::Gradient;
use super::network::pass::Pass;
use super::network::shape::OUTPUT_COLUMNS;
use super::network::weights::Weights;
use super::step::{
    ARRIVAL, DEVIATION, DISTANCE, FEATURE_INPUTS, FILTER_INPUTS, FILTER_OUTPUTS, SURPRISE,
};
use super::step_programs::Programs;
use crate::autodiff::lanes::{LANES, Lanes, ZERO};
use crate::autodiff::program::Workspace;
use crate::kernel::Tier;
use crate::scoring::step_score::SURPRISE_MAX_NATS;
use crate::seed::derive;
use bnkf::recursive::features::FEATURES;
use bnkf::recursive::schedule::OUTPUTS;

/// Largest gradient of one flight's loss by one carried number that is handed back a step.
const ADJOINT_LIMIT: f64 = 1e12;

/// Loss of one window over one shard.
#[derive(Clone, Copy, Debug, Default)]
pub struct WindowLoss {
    /// Sum of the scored steps' negative log-likelihoods, each at most [`SURPRISE_MAX_NATS`],
    /// from which a step teaches nothing.
    pub sum: f64,
    /// Scored steps.
    pub steps: f64,
    /// Lanes started anew because their state was lost.
    pub lost: usize,
}

/// A few groups of flights under way.
#[derive(Debug)]
pub struct Unrolled<'p> {
    programs: &'p Programs,
    tier: Tier,
    feature_workspace: Workspace,
    filter_workspace: Workspace,
    passes: Vec<Pass>,
    /// The carry before every step of the window, per step and group; one more for the end.
    carries: Vec<Vec<Vec<Lanes>>>,
    /// Weight of the distance, in its standard deviations, beside the negative log-likelihood.
    distance_weight: f64,
    /// Weight of every step's loss in the gradient.
    seeds: Vec<Vec<Lanes>>,
    /// Lanes that were lost are scored no more.
    alive: Vec<Lanes>,
}

impl<'p> Unrolled<'p> {
    /// Room for `groups` groups (an even number fills the kernels' blocks) and `window` steps.
    /// Gradients are those of the likelihood plus `distance_weight` times the distance over its
    /// standard deviation, the latter taken as a fixed number.
    pub fn new(programs: &'p Programs, groups: usize, window: usize, distance_weight: f64) -> Self {
        Self {
            programs,
            tier: Tier::detect(),
            feature_workspace: programs.features.workspace(),
            filter_workspace: programs.filter.workspace(),
            passes: (0..window).map(|_| Pass::new(groups * LANES)).collect(),
            carries: vec![vec![vec![ZERO; CARRY]; groups]; window + 1],
            distance_weight,
            seeds: vec![vec![ZERO; groups]; window],
            alive: vec![[1.0; LANES]; groups],
        }
    }

    /// Puts every flight at its start.
    pub fn begin(&mut self, batches: &[Batch]) {
        for (group, batch) in batches.iter().enumerate() {
            self.carries[0][group].copy_from_slice(&batch.start);
            self.alive[group] = [1.0; LANES];
        }
    }

    /// The carry of a group after the last [`Self::forward`], before step `at` of its window.
    pub fn carry(&self, at: usize, group: usize) -> &[Lanes] {
        &self.carries[at][group]
    }

    /// Inputs of the network at step `at` of the last window, [`FEATURES`] a row.
    pub fn features(&mut self, at: usize) -> &[f32] {
        self.passes[at].features_mut()
    }

    /// Outputs of the network at step `at` of the last window, [`OUTPUT_COLUMNS`] a row.
    pub fn outputs(&self, at: usize) -> &[f32] {
        self.passes[at].outputs()
    }

    /// Runs `steps` of every flight, going on from where the last call ended (`begin` first).
    pub fn forward(
        &mut self,
        weights: &Weights,
        batches: &[Batch],
        steps: Range<usize>,
        seed: u64,
    ) -> WindowLoss {
        let mut loss = WindowLoss::default();
        let mut inputs = vec![ZERO; FILTER_INPUTS];
        let mut outputs = vec![ZERO; FILTER_OUTPUTS];
        for (at, step) in steps.enumerate() {
            for (group, batch) in batches.iter().enumerate() {
                self.write_features(at, group, &batch.arrivals[step][0]);
            }
            self.passes[at].forward(self.tier, weights, derive(seed, &[at as u64]));
            for (group, batch) in batches.iter().enumerate() {
                self.filter_inputs(at, group, batch, step, &mut inputs);
                self.programs
                    .filter
                    .forward(&mut self.filter_workspace, &inputs, &mut outputs);
                loss.lost += self.rescue(group, batch, &mut outputs);
                self.carries[at + 1][group].copy_from_slice(&outputs[..CARRY]);
                for lane in 0..LANES {
                    let weight = batch.weights[step][lane] * self.alive[group][lane];
                    let surprise = outputs[SURPRISE][lane];
                    let taught = surprise < SURPRISE_MAX_NATS;
                    if weight > 0.0 {
                        loss.sum += if taught { surprise } else { SURPRISE_MAX_NATS };
                        loss.steps += 1.0;
                    }
                    self.seeds[at][group][lane] = if taught { weight } else { 0.0 };
                }
            }
        }
        loss
    }

    /// Runs every flight from its start to its end, window by window, and calls `visit` after every step with
    /// its place in the window and in the flight. The batches are equally long ([`Batch::groups_alike`]).
    pub fn whole(
        &mut self,
        weights: &Weights,
        batches: &[Batch],
        mut visit: impl FnMut(&Self, usize, usize),
    ) -> WindowLoss {
        self.begin(batches);
        let steps = batches.iter().map(Batch::steps).max().unwrap_or(0);
        let mut total = WindowLoss::default();
        let mut from = 0;
        while from < steps {
            let to = steps.min(from + self.passes.len());
            let loss = self.forward(weights, batches, from..to, from as u64);
            total.sum += loss.sum;
            total.steps += loss.steps;
            total.lost += loss.lost;
            for step in from..to {
                visit(self, step - from, step);
            }
            self.roll(to - from);
            from = to;
        }
        total
    }

    /// Makes the end of the last window, of `length` steps, the start of the next.
    pub fn roll(&mut self, length: usize) {
        self.carries.swap(0, length);
    }

    /// Adds the gradient of the last window's summed loss, and of its distances, times `scale`, to
    /// `gradient`.
    pub fn backward(
        &mut self,
        weights: &Weights,
        batches: &[Batch],
        steps: Range<usize>,
        scale: f64,
        gradient: &mut Gradient,
    ) {
        let rows = batches.len() * LANES;
        let mut inputs = vec![ZERO; FILTER_INPUTS];
        let mut outputs = vec![ZERO; FILTER_OUTPUTS];
        let mut input_adjoints = vec![ZERO; FILTER_INPUTS];
        let mut carry_adjoints = vec![vec![ZERO; CARRY]; batches.len()];
        let mut output_rows = vec![0.0_f32; rows * OUTPUT_COLUMNS];
        let mut feature_rows = vec![0.0_f32; rows * FEATURES];
        let mut seeds = vec![ZERO; FILTER_OUTPUTS];
        for (at, step) in steps.enumerate().rev() {
            for (group, batch) in batches.iter().enumerate() {
                // Values are computed again: they fit the cache, a window's worth would not.
                self.filter_inputs(at, group, batch, step, &mut inputs);
                self.programs
                    .filter
                    .forward(&mut self.filter_workspace, &inputs, &mut outputs);
                seeds[..CARRY].copy_from_slice(&carry_adjoints[group]);
                seeds[SURPRISE] = self.seeds[at][group].map(|seed| seed * scale);
                for lane in 0..LANES {
                    // A lost lane's deviation may be no number.
                    let by_distance = self.distance_weight / outputs[DEVIATION][lane];
                    seeds[DISTANCE][lane] = if seeds[SURPRISE][lane] > 0.0 {
                        seeds[SURPRISE][lane] * by_distance
                    } else {
                        0.0
                    };
                }
                self.programs.filter.backward(
                    &mut self.filter_workspace,
                    &seeds,
                    &mut input_adjoints,
                );
                bound(&mut input_adjoints[..CARRY + OUTPUTS], scale);
                carry_adjoints[group].copy_from_slice(&input_adjoints[..CARRY]);
                for lane in 0..LANES {
                    let row = &mut output_rows[(group * LANES + lane) * OUTPUT_COLUMNS..];
                    for output in 0..OUTPUTS {
                        row[output] = input_adjoints[CARRY + output][lane] as f32;
                    }
                }
            }
            self.passes[at].backward(
                self.tier,
                weights,
                &output_rows,
                gradient,
                &mut feature_rows,
            );
            for (group, batch) in batches.iter().enumerate() {
                self.pull_features(
                    at,
                    group,
                    &batch.arrivals[step][0],
                    &feature_rows,
                    &mut carry_adjoints[group],
                );
                bound(&mut carry_adjoints[group], scale);
            }
        }
    }

    fn write_features(&mut self, at: usize, group: usize, dt_s: &Lanes) {
        let mut inputs = self.carries[at][group].clone();
        inputs.push(*dt_s);
        let mut features = vec![ZERO; FEATURES];
        self.programs
            .features
            .forward(&mut self.feature_workspace, &inputs, &mut features);
        let rows = &mut self.passes[at].features_mut()[group * LANES * FEATURES..];
        for lane in 0..LANES {
            for feature in 0..FEATURES {
                rows[lane * FEATURES + feature] = features[feature][lane] as f32;
            }
        }
    }

    fn pull_features(
        &mut self,
        at: usize,
        group: usize,
        dt_s: &Lanes,
        feature_rows: &[f32],
        carry_adjoints: &mut [Lanes],
    ) {
        let mut inputs = self.carries[at][group].clone();
        inputs.push(*dt_s);
        let mut features = vec![ZERO; FEATURES];
        self.programs
            .features
            .forward(&mut self.feature_workspace, &inputs, &mut features);
        for (feature, lanes) in features.iter_mut().enumerate() {
            for lane in 0..LANES {
                lanes[lane] = f64::from(feature_rows[(group * LANES + lane) * FEATURES + feature]);
            }
        }
        let mut adjoints = vec![ZERO; FEATURE_INPUTS];
        self.programs
            .features
            .backward(&mut self.feature_workspace, &features, &mut adjoints);
        for (sum, term) in carry_adjoints.iter_mut().zip(&adjoints) {
            for lane in 0..LANES {
                sum[lane] += term[lane];
            }
        }
    }

    fn filter_inputs(
        &self,
        at: usize,
        group: usize,
        batch: &Batch,
        step: usize,
        inputs: &mut [Lanes],
    ) {
        inputs[..CARRY].copy_from_slice(&self.carries[at][group]);
        let rows = &self.passes[at].outputs()[group * LANES * OUTPUT_COLUMNS..];
        for output in 0..OUTPUTS {
            for lane in 0..LANES {
                inputs[CARRY + output][lane] = f64::from(rows[lane * OUTPUT_COLUMNS + output]);
            }
        }
        let arrival = CARRY + OUTPUTS;
        inputs[arrival..arrival + ARRIVAL].copy_from_slice(&batch.arrivals[step]);
        inputs[arrival + ARRIVAL..].copy_from_slice(&batch.truths_m[step]);
    }

    /// Puts lanes whose state is no longer finite back to their start, scored no more.
    fn rescue(&mut self, group: usize, batch: &Batch, outputs: &mut [Lanes]) -> usize {
        let mut lost = 0;
        for lane in 0..LANES {
            if outputs[..CARRY]
                .iter()
                .all(|number| number[lane].is_finite())
            {
                continue;
            }
            for (number, start) in outputs.iter_mut().zip(&batch.start) {
                number[lane] = start[lane];
            }
            outputs[SURPRISE][lane] = SURPRISE_MAX_NATS;
            self.alive[group][lane] = 0.0;
            lost += 1;
        }
        lost
    }
}

/// Clears the lanes whose adjoints have blown up: one lost flight must not spoil the batch.
fn bound(adjoints: &mut [Lanes], scale: f64) {
    for lane in 0..LANES {
        let limit = ADJOINT_LIMIT * scale;
        if !adjoints.iter().all(|number| number[lane].abs() < limit) {
            for number in adjoints.iter_mut() {
                number[lane] = 0.0;
            }
        }
    }
}

#[cfg(test)]
pub(super) mod tests;
