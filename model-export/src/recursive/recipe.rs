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
use bnkf::recursive::hypotheses::Hypotheses;
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
    /// Whether loss and gradient are those of the int8 grid's means ([`crate::blob::grid`]).
    #[serde(default, skip_serializing_if = "is_false")]
    pub on_grid: bool,
    /// SHA-256 of the blob whose training goes on; `None` begins with new weights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
}

fn is_false(flag: &bool) -> bool {
    !flag
}

/// Batches of a training that goes on.
const END_BATCHES: u64 = 600;
/// Learning rate of a training that goes on.
const END_RATE: f64 = 1e-3;

impl Recipe {
    /// The shipped model's.
    pub const DEFAULT: Self = Self {
        seed: 1,
        episodes: 32_000,
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
        on_grid: false,
        from: None,
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

    /// The same recipe for tuning a model on own flights; what is rehearsed is what training ends with.
    pub fn tuned(self, tuning: Tuning) -> Self {
        Self {
            episodes: EPISODES,
            rate: RATE,
            tuning: Some(tuning),
            ..self.ending()
        }
    }

    /// The same recipe for going on with the training of the blob with this SHA-256.
    ///
    /// A network that has met many sensors which are worse than they say, and targets that are far from home, hedges
    /// against both for ever after; an end with fewer of them gives most of the caution back.
    pub fn going_on(self, blob_sha256: String) -> Self {
        Self {
            episodes: END_BATCHES,
            rate: END_RATE,
            on_grid: true,
            from: Some(blob_sha256),
            ..self.ending()
        }
    }

    /// The same recipe with what training ends with.
    fn ending(self) -> Self {
        match self.sensor.family {
            Family::Paper => Self {
                sensor: Sensor::PAPER_END,
                augmentation: Augmentation::END,
                ..self
            },
            Family::CounterUas => self,
        }
    }

    /// What the model is said to be trained for.
    pub fn bounds(&self) -> Bounds<f64> {
        match self.sensor.family {
            Family::Paper => Bounds::PAPER,
            Family::CounterUas => Bounds::COUNTER_UAS,
        }
    }

    /// How targets of the trained model may differ from what it expects of them.
    pub fn hypotheses(&self) -> Hypotheses<f64> {
        match self.sensor.family {
            Family::Paper => Hypotheses::PAPER,
            Family::CounterUas => Hypotheses::DRONE,
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
        let draw = |augmentation: &Augmentation, random: &mut RandomSource| {
            augmentation.draw(flight, &self.volume, self.samples, INTERVAL_S, random)
        };
        // A sensor that must be known before the flight has a stream of its own: those of other trainings stay what they
        // were.
        let (samples, noise) = if self.augmentation.asks_for_noise() {
            let parts = [name_id("sensor"), episode, lane as u64];
            let mut sensed = RandomSource::new(self.seed, &parts);
            let noise = self.sensor.draw_noise(&mut sensed);
            let samples = draw(&self.augmentation.under(&noise), &mut random);
            random = sensed;
            (samples, noise)
        } else {
            let samples = draw(&self.augmentation, &mut random);
            (samples, self.sensor.draw_noise(&mut random))
        };
        let changed = Flight {
            name: format!("{episode}/{lane}"),
            source: flight.source.clone(),
            samples,
        };
        let readings = self
            .sensor
            .readings(noise, &changed, self.seed, &mut random);
        (changed, readings)
    }
}

#[cfg(test)]
mod tests {
    use super::super::augmentation::BLUNT_RANGE_RATE_MPS;
    use super::*;
    use crate::flights::flight::Sample;
    use crate::flights::generator::{GeneratorSettings, generate};

    /// What goes on and what is tuned meets what training ends with; a counter-UAS model what it always met.
    #[test]
    fn trainings_that_go_on_meet_sensors_that_are_what_they_say() {
        let on = Recipe::DEFAULT.going_on("sum".to_owned());
        let tuned = Recipe::DEFAULT.tuned(Tuning::new("sum".to_owned(), &[], false));
        for recipe in [&on, &tuned] {
            assert_eq!(recipe.sensor, Sensor::PAPER_END);
            assert_eq!(recipe.augmentation, Augmentation::END);
        }
        assert_eq!((on.episodes, on.rate), (600, 1e-3));
        assert_eq!(on.from.as_deref(), Some("sum"));
        assert_eq!(tuned.from, None);
        // A tuned model lies between two networks, on no grid.
        assert!(on.on_grid && !tuned.on_grid);
        let other = Recipe::COUNTER_UAS.going_on("sum".to_owned());
        assert_eq!(other.sensor, Sensor::COUNTER_UAS);
        assert_eq!(other.augmentation, Recipe::COUNTER_UAS.augmentation);
    }

    /// Under a factor of zero blunt sensors meet no agile flight; others meet nothing else.
    #[test]
    fn blunt_sensors_meet_calmer_flights() {
        let flights = generate(&GeneratorSettings {
            flights: 3,
            ..GeneratorSettings::default()
        })
        .unwrap();
        let recipe = Recipe {
            augmentation: Augmentation {
                agile_share: 1.0,
                under_blunt: 0.0,
                ..Augmentation::STILL
            },
            sensor: Sensor::PAPER.faultless(),
            ..Recipe::DEFAULT
        };
        let hardest = |flight: &Flight| {
            let change = |pair: &[Sample]| {
                let dt_s = pair[1].time_s - pair[0].time_s;
                let change =
                    |axis| (pair[1].velocity_mps[axis] - pair[0].velocity_mps[axis]) / dt_s;
                [0, 1, 2]
                    .map(change)
                    .map(f64::abs)
                    .into_iter()
                    .fold(0.0, f64::max)
            };
            flight.samples.windows(2).map(change).fold(0.0, f64::max)
        };
        let (mut calm, mut agile): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
        for lane in 0..60 {
            let (flight, readings) = recipe.meeting(&flights, 1, lane);
            let sigma = readings[0].expect("a first one").sigma_range_rate_mps;
            let of = if sigma > BLUNT_RANGE_RATE_MPS {
                &mut calm
            } else {
                &mut agile
            };
            of.push(hardest(&flight));
        }
        assert!(calm.len() > 10 && agile.len() > 20);
        let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
        assert!(mean(&agile) > 2.0 * mean(&calm), "{agile:?} {calm:?}");
    }

    #[test]
    fn a_recipe_comes_back() {
        let recipe = Recipe::DEFAULT.going_on("sum".to_owned());
        let text = serde_json::to_string(&recipe).unwrap();
        assert_eq!(serde_json::from_str::<Recipe>(&text).unwrap(), recipe);
    }

    /// Recipes of before, which name no blob, are read.
    #[test]
    fn a_recipe_without_a_blob_to_go_on_from_says_nothing_of_it() {
        let text = serde_json::to_string(&Recipe::DEFAULT).unwrap();
        assert!(!text.contains("from") && !text.contains("blunt") && !text.contains("grid"));
        assert_eq!(
            serde_json::from_str::<Recipe>(&text).unwrap(),
            Recipe::DEFAULT
        );
    }
}
