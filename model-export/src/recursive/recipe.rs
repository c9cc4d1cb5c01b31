//! Everything that decides what a training run makes.

use super::augmentation::Augmentation;
use super::encounter::Encounter;
use super::start::Population;
use crate::flight::Flight;
use crate::gaps::SamplingRate;
use crate::noise::{NoiseLevel, NoiseSigmas, NoiseTable};
use crate::radar_sampling::{RadarSettings, sample_radar};
use crate::random_source::RandomSource;
use crate::reading::Reading;
use crate::seed::name_id;
use crate::volume::Volume;
use serde::{Deserialize, Serialize};

/// Samples of a training flight.
pub const SAMPLES: usize = 150;
/// Time between two of them, seconds.
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
    /// Whether weights are sampled: false trains a deterministic twin.
    pub sampled: bool,
    /// Share of flights whose sensor states sigmas that are not its own.
    pub misstated_share: f64,
    /// Share of flights with outliers.
    pub outlier_share: f64,
    /// How flights are changed.
    pub augmentation: Augmentation,
    /// Where they are put.
    pub volume: Volume,
}

impl Recipe {
    /// The shipped model's.
    pub const DEFAULT: Self = Self {
        seed: 1,
        episodes: 600,
        flights: 160,
        window: 50,
        rate: 2e-3,
        clip: 1.0,
        kl_weight: 1e-6,
        sampled: true,
        misstated_share: 0.1,
        outlier_share: 0.08,
        augmentation: Augmentation::DEFAULT,
        volume: Volume::PAPER,
    };

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
        population: &Population,
        episode: u64,
        lane: usize,
    ) -> Option<Encounter> {
        let mut random =
            RandomSource::new(self.seed, &[name_id("encounter"), episode, lane as u64]);
        let flight = &flights[random.below(flights.len())];
        let samples =
            self.augmentation
                .draw(flight, &self.volume, SAMPLES, INTERVAL_S, &mut random);
        let noise = draw_noise(&mut random);
        let rate = SamplingRate::ALL[random.below(3)];
        let changed = Flight {
            name: format!("{episode}/{lane}"),
            source: flight.source.clone(),
            samples,
        };
        // Some sensors are better or worse than they say.
        let stated = if random.chance(self.misstated_share) {
            noise.scaled((0.4 * random.normal()).exp())
        } else {
            noise
        };
        let settings = RadarSettings {
            noise,
            stated,
            rate,
            gap_phase: if random.chance(0.5) {
                random.below(15)
            } else {
                0
            },
            seed: self.seed,
        };
        let mut readings = sample_radar(&changed, &settings);
        if random.chance(0.1) {
            // A silence of up to five seconds somewhere after the first one.
            let silence = 10 + random.below(40);
            let from = 10 + random.below(readings.len() - 10);
            for reading in readings.iter_mut().skip(from).take(silence) {
                *reading = None;
            }
        }
        if random.chance(self.outlier_share) {
            let often = random.uniform(0.005, 0.05);
            for reading in readings.iter_mut().skip(1).flatten() {
                if random.chance(often) {
                    spoil(reading, &mut random);
                }
            }
        }
        Encounter::new(&changed.samples, &readings, population)
    }
}

/// Moves one value of a reading by 5 to 50 of its standard deviations.
fn spoil(reading: &mut Reading, random: &mut RandomSource) {
    let sigmas = random.sign() * random.uniform(5.0, 50.0);
    match random.below(4) {
        0 => reading.range_m += sigmas * reading.sigma_range_m,
        1 => reading.elevation_rad += sigmas * reading.sigma_elevation_rad,
        2 => reading.azimuth_rad += sigmas * reading.sigma_azimuth_rad,
        _ => reading.range_rate_mps += sigmas * reading.sigma_range_rate_mps,
    }
}

/// One of the paper's levels by either table, a little off, or any sensor at all.
fn draw_noise(random: &mut RandomSource) -> NoiseSigmas {
    let level = NoiseLevel::ALL[random.below(3)];
    let kind = random.unit();
    if kind < 0.15 {
        let between = |random: &mut RandomSource, low: f64, high: f64| {
            random.uniform(low.ln(), high.ln()).exp()
        };
        let angle = between(random, 1e-4, 0.12);
        return NoiseSigmas {
            range_m: between(random, 0.5, 120.0),
            elevation_rad: angle,
            azimuth_rad: angle * between(random, 0.5, 2.0),
            range_rate_mps: between(random, 0.008, 1.2),
        };
    }
    let table = if kind < 0.3 {
        NoiseTable::Printed
    } else {
        NoiseTable::Radians
    };
    level.sigmas(table).scaled((0.15 * random.normal()).exp())
}
