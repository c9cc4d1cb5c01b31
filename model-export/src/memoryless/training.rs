//! The training loop: epochs, minibatches, held-out loss, early stopping.
//!
//! Everything random is derived from the seed and the place in the run, so a run that continues
//! from a [`State`] ends with the same bits as one that was never interrupted.

use crate::kernel::{AdamStep, Tier};
use crate::memoryless::gradient::{Batch, Gradient};
use crate::memoryless::member::Member;
use crate::memoryless::rows::Rows;
use crate::memoryless::training_data::TrainingData;
use crate::memoryless::training_settings::{Divergence, TrainingSettings, TrainingSettingsError};
use crate::posterior::gaussian_weights::GaussianWeights;
use crate::random_source::RandomSource;
use crate::seed;

const BETA1: f64 = 0.9;
const BETA2: f64 = 0.999;
const EPSILON: f32 = 1e-8;

/// Where a run is: all that is needed to continue it.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Epochs that are complete.
    pub epoch: u32,
    /// Epochs that were complete when the means were put on the grid, once they are.
    pub grid_start: Option<u32>,
    /// Chunks of the current epoch that are done.
    pub chunk: u32,
    /// Minibatches of the current chunk that are done.
    pub batch: u32,
    /// Rows of the current epoch that are done.
    pub rows: u64,
    /// Their summed data loss.
    pub loss: f64,
    /// Steps of Adam so far.
    pub steps: u64,
    /// Epochs since a held-out loss was the lowest.
    pub stale: u32,
    /// The networks.
    pub members: Vec<Member>,
}

/// What an epoch came to. Units of the losses: see
/// [`super::training_settings::ErrorScale`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EpochReport {
    /// The epoch, from 1.
    pub epoch: u32,
    /// Mean data loss of the training rows, summed over the networks.
    pub training_loss: f64,
    /// Divergence from the prior as it enters the loss, summed over the networks.
    pub divergence: f64,
    /// Mean data loss of the held-out rows, summed over the networks.
    pub validation_loss: f64,
    /// Whether a network reached its lowest held-out loss.
    pub better: bool,
}

/// What the loop tells its observer, who may stop it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// A minibatch is done: the part of the epoch, 0 to 1, and its mean data loss so far.
    Batch {
        /// Part of the epoch that is done.
        done: f64,
        /// Mean data loss over it.
        loss: f64,
    },
    /// An epoch is done.
    Epoch(EpochReport),
}

/// Whether to go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// Go on.
    Continue,
    /// Stop here; the state can be continued later.
    Stop,
}

/// Why the loop ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// All epochs are done.
    Complete,
    /// The held-out loss did not fall for the stated number of epochs.
    Stale,
    /// The observer stopped it.
    Interrupted,
}

/// A loss that is not a number: training cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the loss is not finite in epoch {epoch}: lower --rate")]
pub struct DivergedError {
    /// The epoch, from 1.
    pub epoch: u32,
}

/// A training run.
pub struct Training<'a> {
    settings: &'a TrainingSettings,
    data: &'a TrainingData,
    tier: Tier,
    gradients: Vec<Gradient>,
    /// Where the run is.
    pub state: State,
}

impl State {
    /// The start of a run.
    ///
    /// # Errors
    /// A setting makes no sense.
    pub fn start(settings: &TrainingSettings) -> Result<Self, TrainingSettingsError> {
        settings.check()?;
        let architecture = settings.architecture()?;
        let members = (0..settings.networks()).map(|index| {
            let ids = [seed::name_id("initial weights"), index as u64];
            let mut random = RandomSource::new(settings.seed, &ids);
            let sigma = settings.initial_sigma as f32;
            let weights = GaussianWeights::random(&architecture, sigma, &mut random);
            Member::new(index * architecture.outputs(), weights)
        });
        Ok(Self {
            epoch: 0,
            grid_start: None,
            chunk: 0,
            batch: 0,
            rows: 0,
            loss: 0.0,
            steps: 0,
            stale: 0,
            members: members.collect(),
        })
    }
}

impl<'a> Training<'a> {
    /// Continues from `state`, which belongs to `settings`.
    #[must_use]
    pub fn new(
        settings: &'a TrainingSettings,
        data: &'a TrainingData,
        tier: Tier,
        state: State,
    ) -> Self {
        let gradients = state
            .members
            .iter()
            .map(|m| Gradient::new(tier, &m.weights))
            .collect();
        Self {
            settings,
            data,
            tier,
            gradients,
            state,
        }
    }

    /// Trains until the epochs are done, the held-out loss is stale, or `observe` says stop.
    ///
    /// # Errors
    /// The loss is no longer finite.
    pub fn run(
        &mut self,
        mut observe: impl FnMut(&State, Event) -> Control,
    ) -> Result<End, DivergedError> {
        loop {
            let stale = self.state.stale >= self.settings.patience;
            if self.state.epoch < self.last_epoch() && !stale {
                if self.epoch(&mut observe)? == Control::Stop {
                    return Ok(End::Interrupted);
                }
            } else if self.state.grid_start.is_none() && self.settings.grid_epochs > 0 {
                self.start_grid();
            } else {
                return Ok(if stale { End::Stale } else { End::Complete });
            }
        }
    }

    fn epoch(
        &mut self,
        observe: &mut impl FnMut(&State, Event) -> Control,
    ) -> Result<Control, DivergedError> {
        let epoch = self.state.epoch;
        let chunks = self.data.chunks() as u32;
        while self.state.chunk < chunks {
            let rows = self.data.chunk(epoch, self.state.chunk as usize);
            let order = self.order(&rows);
            let batches = rows.len().div_ceil(self.settings.batch) as u32;
            while self.state.batch < batches {
                let bound =
                    |b: u32| (u64::from(b) * order.len() as u64 / u64::from(batches)) as usize;
                let done = |b: u32| {
                    let chunk = f64::from(b) / f64::from(batches);
                    (f64::from(self.state.chunk) + chunk) / f64::from(chunks)
                };
                let batch = self.state.batch;
                let (before, after) = (done(batch), done(batch + 1));
                self.batch(&rows, &order[bound(batch)..bound(batch + 1)], before);
                let loss = self.state.loss / self.state.rows as f64;
                if !loss.is_finite() {
                    return Err(DivergedError { epoch: epoch + 1 });
                }
                // After the last minibatch the epoch is closed first: its end is the better place.
                let event = Event::Batch { done: after, loss };
                if after < 1.0 && observe(&self.state, event) == Control::Stop {
                    return Ok(Control::Stop);
                }
            }
            self.state.chunk += 1;
            self.state.batch = 0;
        }
        let report = self.close_epoch();
        if !report.validation_loss.is_finite() {
            return Err(DivergedError { epoch: epoch + 1 });
        }
        Ok(observe(&self.state, Event::Epoch(report)))
    }

    /// Epochs that will be complete when the current part of the run is.
    fn last_epoch(&self) -> u32 {
        match self.state.grid_start {
            None => self.settings.epochs,
            Some(start) => start + self.settings.grid_epochs,
        }
    }

    fn start_grid(&mut self) {
        let state = &mut self.state;
        state.grid_start = Some(state.epoch);
        // Adam starts anew too.
        (state.steps, state.stale) = (0, 0);
        for member in &mut state.members {
            member.start_grid();
        }
    }

    fn order(&self, rows: &Rows) -> Vec<u32> {
        let mut order: Vec<u32> = (0..rows.len() as u32).collect();
        let ids = [
            seed::name_id("order of rows"),
            u64::from(self.state.epoch),
            u64::from(self.state.chunk),
        ];
        RandomSource::new(self.settings.seed, &ids).shuffle(&mut order);
        order
    }

    /// One step of every network, `part` of the epoch being done.
    fn batch(&mut self, rows: &Rows, order: &[u32], part: f64) {
        let state = &mut self.state;
        state.steps += 1;
        let (rate, start, epochs) = match state.grid_start {
            None => (self.settings.rate, 0, self.settings.epochs),
            Some(start) => (self.settings.grid_rate, start, self.settings.grid_epochs),
        };
        let progress = (f64::from(state.epoch - start) + part) / f64::from(epochs);
        let step = AdamStep {
            kl_weight: kl_weight(self.settings, self.data.positions) as f32,
            prior_precision: self.settings.prior_sigma.powi(-2) as f32,
            ..adam_step(rate, state.steps, progress)
        };
        let members = state
            .members
            .iter_mut()
            .zip(&mut self.gradients)
            .enumerate();
        for (index, (member, gradient)) in members {
            let ids = [
                seed::name_id("weight noise"),
                u64::from(state.epoch),
                u64::from(state.chunk),
                u64::from(state.batch),
                index as u64,
            ];
            let noise_seed = Some(seed::derive(self.settings.seed, &ids));
            let batch = Batch {
                rows,
                order,
                first_target: member.first_target,
                noise_seed,
            };
            gradient.load(self.tier, &member.effective());
            state.loss += gradient.loss_and_gradient(batch);
            member.step(self.tier, step, gradient);
        }
        state.rows += order.len() as u64;
        state.batch += 1;
    }

    fn close_epoch(&mut self) -> EpochReport {
        let state = &mut self.state;
        state.epoch += 1;
        let noise_seed = seed::derive(self.settings.seed, &[seed::name_id("validation weights")]);
        let rows = &self.data.validation;
        let order: Vec<u32> = (0..rows.len() as u32).collect();
        let (mut validation_loss, mut divergence, mut better) = (0.0, 0.0, false);
        for (member, gradient) in state.members.iter_mut().zip(&mut self.gradients) {
            let batch = Batch {
                rows,
                order: &order,
                first_target: member.first_target,
                noise_seed: Some(noise_seed),
            };
            gradient.load(self.tier, &member.effective());
            let loss = gradient.loss(batch) / rows.len() as f64;
            better |= member.note(loss, state.epoch);
            validation_loss += loss;
            divergence += member.weights.divergence(self.settings.prior_sigma)
                * kl_weight(self.settings, self.data.positions);
        }
        state.stale = if better { 0 } else { state.stale + 1 };
        let report = EpochReport {
            epoch: state.epoch,
            training_loss: state.loss / state.rows as f64,
            divergence,
            validation_loss,
            better,
        };
        (state.chunk, state.rows, state.loss) = (0, 0, 0.0);
        report
    }
}

/// Factor of the divergence in the loss of one row.
fn kl_weight(settings: &TrainingSettings, positions: usize) -> f64 {
    match settings.divergence {
        Divergence::PerRow => settings.kl_weight / positions as f64,
        Divergence::Paper => settings.kl_weight,
    }
}

/// Adam's constants at step `steps`, from 1, with `progress` of the steps done; no divergence.
fn adam_step(rate: f64, steps: u64, progress: f64) -> AdamStep {
    let correction = |beta: f64| 1.0 / (1.0 - libm::pow(beta, steps as f64));
    let cosine = 0.5 * (1.0 + libm::cos(std::f64::consts::PI * progress));
    AdamStep {
        rate: (rate * cosine) as f32,
        beta1: BETA1 as f32,
        beta2: BETA2 as f32,
        epsilon: EPSILON,
        correction1: correction(BETA1) as f32,
        correction2: correction(BETA2) as f32,
        kl_weight: 0.0,
        prior_precision: 0.0,
    }
}
