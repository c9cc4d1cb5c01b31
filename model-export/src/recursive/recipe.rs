//! Everything that decides what a training run makes.

use super::augmentation::Augmentation;
use super::elsewhere::Elsewhere;
use super::encounter::Encounter;
use super::network::sampling::Sampling;
use super::sensor::{Family, Sensor};
use super::step::Weighing;
use super::tuning::{EPISODES, RATE, Tuning};
use crate::flights::flight::Flight;
use crate::flights::volume::Volume;
use crate::radar::reading::Reading;
use crate::random_source::RandomSource;
use crate::seed::name_id;
use bnkf::recursive::envelope::Bounds;
use bnkf::recursive::population::Population;
use serde::{Deserialize, Serialize};

/// Time between two samples of a training flight, seconds.
pub const INTERVAL_S: f64 = 0.1;

/// A training run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Seed of everything random.
    pub seed: u64,
    /// Batches of new flights.
    pub episodes: u64,
    /// Flights in a batch.
    pub flights: usize,
    /// Steps between two updates, which gradients are carried back over.
    pub window: usize,
    /// Adam's highest learning rate; it rises at first and then falls with half a cosine.
    pub rate: f64,
    /// Largest Euclidean norm of a gradient.
    pub clip: f64,
    /// Weight of the divergence from the prior beside the mean loss of a step.
    pub kl_weight: f64,
    /// Weight of the distance in standard deviations beside the negative log-likelihood. Where the
    /// truth is not Gaussian the two disagree, and users judge by distance.
    pub distance_weight: f64,
    /// Which weights are distributions.
    pub sampling: Sampling,
    /// Samples of a training flight.
    pub samples: usize,
    /// What measures the flights.
    pub sensor: Sensor,
    /// How flights are changed.
    pub augmentation: Augmentation,
    /// Where they are put.
    pub volume: Volume,
    /// Which hypotheses the trained filter weighs.
    pub weighing: Weighing,
    /// How a shipped model is tuned; `None` trains a new one.
    pub tuning: Option<Tuning>,
}

impl Recipe {
    /// The shipped model's.
    pub const DEFAULT: Self = Self {
        seed: 1,
        episodes: 8000,
        flights: 160,
        window: 50,
        rate: 2e-3,
        clip: 1.0,
        kl_weight: 1e-6,
        distance_weight: 2.0,
        sampling: Sampling::EveryLayer,
        samples: 150,
        sensor: Sensor::PAPER,
        augmentation: Augmentation::DEFAULT,
        volume: Volume::PAPER,
        weighing: Weighing::Nominal,
        tuning: None,
    };

    /// The shipped counter-UAS model's: drones of up to 25 m/s at 0.3 to 3 km.
    pub const COUNTER_UAS: Self = Self {
        samples: 300,
        episodes: 1000,
        sensor: Sensor::COUNTER_UAS,
        augmentation: Augmentation {
            stretch_max: 1.5,
            // These drones are as fast and agile as any; the volume is all that the radar sees.
            agile_share: 0.1,
            haste_share: 0.0,
            elsewhere_share: 0.05,
            elsewhere: Elsewhere {
                range_m: [150.0, 3500.0],
                elevation_deg: [-5.0, 60.0],
            },
            ..Augmentation::DEFAULT
        },
        volume: Volume::COUNTER_UAS,
        ..Self::DEFAULT
    };

    /// The same recipe for tuning a model on own flights.
    pub fn tuned(self, tuning: Tuning) -> Self {
        Self {
            episodes: EPISODES,
            rate: RATE,
            tuning: Some(tuning),
            ..self
        }
    }

    /// What the model is said to be trained for.
    pub fn bounds(&self) -> Bounds<f64> {
        match self.sensor.family {
            Family::Paper => Bounds::PAPER,
            Family::CounterUas => Bounds::COUNTER_UAS,
        }
    }

    /// Learning rate of the update at this share (0 to 1) of the run.
    pub fn rate_at(&self, update: f64, share: f64) -> f64 {
        let rise = (update / 30.0 + 0.05).min(1.0);
        let fall = 0.5 * (1.0 + (core::f64::consts::PI * share).cos()) + 0.01;
        self.rate * rise * fall
    }

    /// The encounter that `lane` of `episode` trains on: any flight, changed, under any noise,
    /// rate and gap phase.
    pub fn encounter(
        &self,
        flights: &[Flight],
        population: &Population<f64>,
        episode: u64,
        lane: usize,
    ) -> Option<Encounter> {
        let (changed, readings) = self.meeting(flights, episode, lane);
        Encounter::new(&changed.samples, &readings, population)
    }

    /// The flight of an encounter, as it was changed, and what the sensor reads of it.
    pub fn meeting(
        &self,
        flights: &[Flight],
        episode: u64,
        lane: usize,
    ) -> (Flight, Vec<Option<Reading>>) {
        let mut random =
            RandomSource::new(self.seed, &[name_id("encounter"), episode, lane as u64]);
        let flight = &flights[random.below(flights.len())];
        let samples =
            self.augmentation
                .draw(flight, &self.volume, self.samples, INTERVAL_S, &mut random);
        let changed = Flight {
            name: format!("{episode}/{lane}"),
            source: flight.source.clone(),
            samples,
        };
        let readings = self.sensor.readings(&changed, self.seed, &mut random);
        (changed, readings)
    }
}
