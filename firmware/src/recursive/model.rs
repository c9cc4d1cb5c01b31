//! A recursive blob as filters run it.

use super::answer::Answer;
use super::envelope::{Envelope, Predictor};
use super::parameters::Parameters;
use super::population::Population;
use super::schedule::{OUTPUTS, Schedule};
use super::target::Target;
use crate::blob::Blob;
use crate::estimate::{Estimate, Outcome};

/// A recursive blob, and what of it is asked at every step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Model<'a> {
    pub(crate) blob: Blob<'a>,
    pub(super) parameters: Parameters<f32>,
    pub(super) envelope: Envelope,
}

impl<'a> Model<'a> {
    /// Reads what surrounds the network.
    pub fn new(blob: Blob<'a>) -> Self {
        let parameters = Parameters::read(blob.parameters());
        Self {
            blob,
            envelope: Envelope::of(&parameters.bounds, &parameters.population),
            parameters,
        }
    }

    /// What is known of a target that the track does not explain: the population's place, and any
    /// motion of the training.
    pub(super) fn suspected(&self) -> Population<f32> {
        Population {
            horizontal_sigma_mps: self.envelope.speed_max_mps,
            vertical_sigma_mps: self.envelope.speed_max_mps,
            acceleration_sigma_mps2: 0.5 * self.envelope.acceleration_max_mps2,
            ..self.parameters.population
        }
    }

    /// How a target moves about which the network is not asked, `coast_s` after the last measurement; `None` where it
    /// is.
    #[inline]
    pub(super) fn unasked(&self, target: &Target, coast_s: f32) -> Option<Schedule<f32>> {
        let base = &self.parameters.base;
        let (state, covariance) = (&target.state, &target.covariance);
        match self.envelope.predictor(state, covariance, coast_s) {
            Predictor::Wide => Some(Schedule::wide(base)),
            Predictor::Base => Some(Schedule::read(&[0.0; OUTPUTS], base)),
            Predictor::Network => None,
        }
    }

    /// Makes an answer one for a target of which nothing more is measured.
    pub(super) fn unmeasured(&self, target: &Target, answer: &mut Answer) {
        let hypotheses = &self.parameters.hypotheses;
        let odds = hypotheses.odds(&target.memory.counts);
        // As in a gap, but at once: noise adds up, and nothing is counted on the way.
        let nominal = answer.schedule.noise;
        answer.schedule.noise = nominal.plus(&hypotheses.expected(&odds, &nominal));
    }

    /// Moves a target ahead by an answer, with nothing remembered and not settled yet.
    pub(super) fn advance(&self, target: &mut Target, answer: &Answer, dt_s: f32) {
        if dt_s <= 0.0 {
            return;
        }
        // Damping acts as of the part's beginning: in a long one more of it would turn the motion round.
        let damping_max_hz2 = 2.0 / (dt_s * dt_s);
        let damping_hz2 = answer.schedule.damping_hz2;
        let schedule = Schedule {
            damping_hz2: damping_hz2.map(|damping| damping.min(damping_max_hz2)),
            ..answer.schedule
        };
        target.predict(&target.sight(), &schedule, dt_s);
        if let Some(factor) = &answer.factor {
            target.fuse(factor, &self.parameters.population, dt_s);
        }
    }

    /// A target as an estimate.
    pub fn estimate(&self, target: &Target, outcome: Outcome) -> Estimate {
        let Outcome { nis, mode, doubt } = outcome;
        let held = self.envelope.holds(&target.state);
        target.estimate(nis, mode, !held, doubt)
    }
}
