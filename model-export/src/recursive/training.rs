//! Training through the unrolled filter.

use super::batch::Batch;
use super::bends;
use super::checkpoint::{Checkpoint, CheckpointError};
use super::encounter::Encounter;
use super::frequencies;
use super::model::RecursiveModel;
use super::network::Network;
use super::network::anchor::Anchor;
use super::network::gradient::Gradient;
use super::network::sampling::Sampling;
use super::network::weights::Weights;
use super::normalisation::Normalisation;
use super::population::population_of;
use super::recipe::Recipe;
use super::step::{Weighing, advance, features_of};
use super::step_programs::Programs;
use super::tuning::refitted;
use super::unrolled::{Unrolled, WindowLoss};
use crate::autodiff::lanes::LANES;
use crate::flights::data_hash::of_flights;
use crate::flights::flight::Flight;
use crate::kernel::{Aligned, Tier};
use crate::seed::{derive, name_id};
use bnkf::recursive::features::FEATURES;
use bnkf::recursive::parameters::Parameters;
use bnkf::recursive::schedule::OUTPUTS;
use rayon::prelude::*;
use std::borrow::Cow;

/// Batches are cut into this many parts, whose gradients are added in order: the result does not
/// depend on the number of threads.
const SHARDS: usize = 2;
/// Encounters that the features' means and deviations are measured on.
const NORMALISATION_ENCOUNTERS: usize = 192;

/// Encounters with own flights that the hypotheses' frequencies and the bends of forecasts are learned from.
const FREQUENCY_ENCOUNTERS: usize = 96;
/// An episode that training never reaches.
const UNREACHED: u64 = u64::MAX;

/// Why training cannot start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TrainingError {
    /// There are no flights, or none with two samples.
    #[error("no flights to train on")]
    NoFlights,
    /// The number of flights in a batch.
    #[error("{flights} flights in a batch: a positive multiple of {unit} is needed")]
    BatchSize {
        /// Flights asked for.
        flights: usize,
        /// What their number must be a multiple of.
        unit: usize,
    },
}

/// Why training cannot go on from a checkpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ResumeError {
    /// Not a checkpoint, or damaged.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// Its settings differ.
    #[error("the checkpoint was made with other settings")]
    OtherRecipe,
    /// Its flights differ.
    #[error("the checkpoint was made with other flights")]
    OtherFlights,
}

/// A network in training.
#[derive(Debug)]
pub struct Training<'f> {
    /// What is trained, and how.
    pub recipe: Recipe,
    /// What surrounds the network; its population is measured on the flights.
    pub parameters: Parameters<f64>,
    /// The features' normalisation, measured on the base model.
    pub normalisation: Normalisation,
    /// The network.
    pub network: Network,
    /// Episodes done.
    pub episode: u64,
    programs: Programs,
    flights: &'f [Flight],
    own: Option<Own<'f>>,
}

/// What tuning learns from, beside the built-in flights.
#[derive(Debug)]
struct Own<'f> {
    flights: &'f [Flight],
    /// The recipe of their encounters.
    recipe: Recipe,
    /// What tuning set out from.
    shipped: Network,
    /// How far the tuned model goes from there.
    blend: f32,
    anchor: Option<Anchor>,
    /// Weight of the divergence from the anchor: one over the number of positions.
    weight: f32,
}

/// What one episode cost.
#[derive(Clone, Copy, Debug)]
pub struct EpisodeReport {
    /// Mean loss of a step, nats.
    pub surprise: f64,
    /// Largest gradient norm of its updates, before clipping.
    pub norm: f64,
    /// Flights whose state was lost.
    pub lost: usize,
    /// Updates.
    pub updates: usize,
}

impl<'f> Training<'f> {
    /// Measures the population and the features, and makes a new network.
    ///
    /// # Errors
    /// No usable flights, or a batch size that does not fill the lanes.
    pub fn new(recipe: Recipe, flights: &'f [Flight]) -> Result<Self, TrainingError> {
        check_batch(&recipe)?;
        let population = population_of(flights).ok_or(TrainingError::NoFlights)?;
        let parameters = Parameters {
            population,
            bounds: recipe.bounds(),
            ..Parameters::PAPER
        };
        let normalisation = measure_features(&recipe, flights, &parameters);
        Ok(Self {
            programs: Programs::new(&parameters, &normalisation, recipe.weighing),
            network: Network::new(recipe.seed),
            recipe,
            parameters,
            normalisation,
            episode: 0,
            flights,
            own: None,
        })
    }

    /// Goes on training `model`, whose population and normalisation stay what they are, with new batches.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn going_on(
        recipe: Recipe,
        flights: &'f [Flight],
        model: &RecursiveModel,
    ) -> Result<Self, TrainingError> {
        check_batch(&recipe)?;
        if flights.is_empty() {
            return Err(TrainingError::NoFlights);
        }
        Ok(Self {
            programs: Programs::new(&model.parameters, &model.normalisation, recipe.weighing),
            network: model.network.clone(),
            recipe,
            parameters: model.parameters,
            normalisation: model.normalisation.clone(),
            episode: 0,
            flights,
            own: None,
        })
    }

    /// Goes on training `model` on `own` flights and on built-in `flights`, as `recipe.tuning` says.
    ///
    /// # Errors
    /// As [`Self::new`]; without `own` flights or tuning in the recipe there are no flights.
    pub fn tune(
        recipe: Recipe,
        flights: &'f [Flight],
        own: &'f [Flight],
        model: &RecursiveModel,
    ) -> Result<Self, TrainingError> {
        let tuning = recipe.tuning.clone().ok_or(TrainingError::NoFlights)?;
        let augmentation = tuning.augmentation(own, &model.parameters.population);
        if own.is_empty() {
            return Err(TrainingError::NoFlights);
        }
        let positions: usize = own.iter().map(|flight| flight.samples.len()).sum();
        let own = Own {
            flights: own,
            recipe: Recipe {
                augmentation,
                ..recipe.clone()
            },
            shipped: model.network.clone(),
            blend: tuning.blend as f32,
            anchor: tuning.anchor(&model.network),
            weight: 1.0 / positions as f32,
        };
        let model = refitted(model, own.flights, tuning.place);
        Ok(Self {
            own: Some(own),
            ..Self::going_on(recipe, flights, &model)?
        })
    }

    /// Takes up a checkpoint of the same training, to the same result as without the break.
    ///
    /// # Errors
    /// The checkpoint is damaged or of another recipe or other flights.
    pub fn resumed(mut self, checkpoint: &[u8]) -> Result<Self, ResumeError> {
        let checkpoint = Checkpoint::parse(checkpoint)?;
        if checkpoint.recipe != self.recipe {
            return Err(ResumeError::OtherRecipe);
        }
        if checkpoint.flights_hash != of_flights(self.flights) {
            return Err(ResumeError::OtherFlights);
        }
        self.network = checkpoint.network;
        self.episode = checkpoint.episode;
        Ok(self)
    }

    /// Everything that [`Self::resumed`] needs, as bytes.
    pub fn checkpoint(&self) -> Vec<u8> {
        Checkpoint {
            recipe: self.recipe.clone(),
            flights_hash: of_flights(self.flights),
            episode: self.episode,
            network: self.network.clone(),
        }
        .to_bytes()
    }

    /// What the training has come to. One that is tuned goes a part of the way, and takes manoeuvres to be
    /// as frequent, and accelerations to last as long, as in the own flights.
    pub fn model(&self) -> RecursiveModel {
        let network = match &self.own {
            Some(own) => own.shipped.blended(&self.network, own.blend),
            None => {
                let mut network = self.network.clone();
                network.means = self.means().into_owned();
                network
            }
        };
        let mut model = RecursiveModel {
            parameters: self.parameters,
            normalisation: self.normalisation.clone(),
            network,
            sampling: self.recipe.sampling,
        };
        let Some(own) = &self.own else {
            // Only now: the features of a new network are measured under those of any drone.
            model.parameters.hypotheses = self.recipe.hypotheses();
            return model;
        };
        let recipe = Recipe {
            sensor: own.recipe.sensor.faultless(),
            ..own.recipe.clone()
        };
        let meetings: Vec<_> = (0..FREQUENCY_ENCOUNTERS)
            .into_par_iter()
            .map(|lane| recipe.meeting(own.flights, UNREACHED, lane))
            .collect();
        let population = &self.parameters.population;
        let encounters: Vec<Encounter> = meetings
            .iter()
            .filter_map(|(flight, readings)| Encounter::new(&flight.samples, readings, population))
            .collect();
        model.parameters.hypotheses = frequencies::learned(&model, &encounters);
        let duration_s = own.flights.iter().map(Flight::duration_s).sum();
        let bend = bends::learned(&model, &meetings, duration_s);
        model.parameters.bend += f64::from(own.blend) * (bend - model.parameters.bend);
        model
    }

    /// The weight means that loss and gradient are computed of; the gradient then moves the unrounded ones.
    fn means(&self) -> Cow<'_, Aligned> {
        if self.recipe.on_grid {
            Cow::Owned(self.network.rounded_means())
        } else {
            Cow::Borrowed(&self.network.means)
        }
    }

    /// The recorded step.
    pub fn programs(&self) -> &Programs {
        &self.programs
    }

    /// What one lane of the present episode trains on.
    fn encounter(&self, lane: usize) -> Option<Encounter> {
        let population = &self.parameters.population;
        // Lanes by turns, so that every group of lanes has both kinds.
        if let (Some(own), Some(tuning)) = (&self.own, &self.recipe.tuning) {
            let before = tuning.rehearsal * lane as f64;
            if (before + tuning.rehearsal) as usize == before as usize {
                return own
                    .recipe
                    .encounter(own.flights, population, self.episode, lane);
            }
        }
        self.recipe
            .encounter(self.flights, population, self.episode, lane)
    }

    /// Trains on one batch of new flights, updating after every window.
    pub fn episode(&mut self) -> EpisodeReport {
        let encounters: Vec<Encounter> = (0..self.recipe.flights)
            .into_par_iter()
            .filter_map(|lane| self.encounter(lane))
            .collect();
        let batches = Batch::groups(&encounters);
        let shard_groups = batches.len().div_ceil(SHARDS);
        let steps = batches.iter().map(Batch::steps).min().unwrap_or(0);
        let windows = steps.div_ceil(self.recipe.window);
        let mut shards: Vec<(Unrolled<'_>, &[Batch], Gradient)> = batches
            .chunks(shard_groups)
            .map(|part| {
                let mut run = Unrolled::new(
                    &self.programs,
                    part.len(),
                    self.recipe.window,
                    self.recipe.distance_weight,
                );
                run.begin(part);
                (run, part, Gradient::zeros())
            })
            .collect();
        let mut report = EpisodeReport {
            surprise: 0.0,
            norm: 0.0,
            lost: 0,
            updates: 0,
        };
        let mut total = WindowLoss::default();
        for window in 0..windows {
            let from = window * self.recipe.window;
            let range = from..steps.min(from + self.recipe.window);
            let tier = Tier::detect();
            let weights = Weights::new(
                tier,
                &self.means(),
                &self.network.log_sigmas,
                self.recipe.sampling,
            );
            let seed = derive(
                self.recipe.seed,
                &[name_id("window"), self.episode, window as u64],
            );
            let scale = 1.0 / (self.recipe.flights * range.len()) as f64;
            let losses: Vec<WindowLoss> = shards
                .par_iter_mut()
                .enumerate()
                .map(|(shard, (run, part, gradient))| {
                    *gradient = Gradient::zeros();
                    let seed = derive(seed, &[shard as u64]);
                    let loss = run.forward(&weights, part, range.clone(), seed);
                    run.backward(&weights, part, range.clone(), scale, gradient);
                    run.roll(range.len());
                    loss
                })
                .collect();
            for loss in losses {
                total.sum += loss.sum;
                total.steps += loss.steps;
                report.lost += loss.lost;
            }
            let mut gradient = Gradient::zeros();
            for (_, _, part) in &shards {
                gradient.add(part);
            }
            let update = (self.episode * windows as u64 + window as u64) as f64;
            let share = update / (self.recipe.episodes * windows as u64) as f64;
            if let Some(own) = &self.own
                && let Some(anchor) = &own.anchor
            {
                anchor.pull(&self.network, own.weight, &mut gradient);
            }
            let norm = self.network.update(
                tier,
                self.recipe.rate_at(update, share) as f32,
                if self.recipe.sampling == Sampling::Nothing || self.own.is_some() {
                    0.0
                } else {
                    self.recipe.kl_weight as f32
                },
                self.recipe.clip as f32,
                &mut gradient,
            );
            report.norm = report.norm.max(f64::from(norm));
            report.updates += 1;
        }
        self.episode += 1;
        report.surprise = total.sum / total.steps;
        report
    }
}

fn check_batch(recipe: &Recipe) -> Result<(), TrainingError> {
    let unit = SHARDS * LANES;
    if recipe.flights == 0 || !recipe.flights.is_multiple_of(unit) {
        return Err(TrainingError::BatchSize {
            flights: recipe.flights,
            unit,
        });
    }
    Ok(())
}

/// Mean and inverse deviation of every feature under the base model.
fn measure_features(
    recipe: &Recipe,
    flights: &[Flight],
    parameters: &Parameters<f64>,
) -> Normalisation {
    let lists: Vec<Vec<[f64; FEATURES]>> = (0..NORMALISATION_ENCOUNTERS)
        .into_par_iter()
        .filter_map(|lane| {
            let encounter = recipe.encounter(flights, &parameters.population, UNREACHED, lane)?;
            let mut carry = encounter.start;
            let mut list = Vec::with_capacity(encounter.arrivals.len());
            for arrival in &encounter.arrivals {
                list.push(features_of(&carry, arrival.dt_s));
                carry = advance(&carry, &[0.0; OUTPUTS], arrival, parameters, Weighing::All);
            }
            Some(list)
        })
        .collect();
    let mut normalisation = Normalisation::IDENTITY;
    // The network's own memory is bounded already, and silent under the base model.
    for feature in 0..FEATURES - bnkf::recursive::memory::NOTES {
        let values = || {
            lists
                .iter()
                .flatten()
                .map(|list| list[feature])
                .filter(|x| x.is_finite())
        };
        let count = values().count().max(1) as f64;
        let mean = values().sum::<f64>() / count;
        let variance = values().map(|x| (x - mean) * (x - mean)).sum::<f64>() / count;
        normalisation.offset[feature] = mean;
        normalisation.gain[feature] = 1.0 / variance.sqrt().max(0.05);
    }
    normalisation
}

#[cfg(test)]
mod tests;
