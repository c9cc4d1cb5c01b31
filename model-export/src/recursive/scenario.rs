//! What a recursive model is trained for: flights, radar and recipe that belong together.

use super::recipe::Recipe;
use super::trial::Cell;
use crate::flights::flight::Flight;
use crate::flights::generator::GeneratorSettings;
use crate::radar::errors::Errors;
use crate::radar::gaps::SamplingRate;
use crate::radar::noise::{COUNTER_UAS_ANGLES_DEG, NoiseLevel, NoiseSigmas, NoiseTable};
use crate::radar::sampling::{RadarSettings, sample_radar};
use crate::random_source::RandomSource;
use crate::seed::name_id;
use bnkf::recursive::envelope::Bounds;
use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Samples from one scan of the counter-UAS radar to the next: 10, 5 and 1 Hz.
pub const COUNTER_UAS_STRIDES: [usize; 3] = [1, 2, 10];
/// Share of the counter-UAS radar's scans that miss the target.
pub const COUNTER_UAS_MISSED: f64 = 0.1;

/// Targets and radar.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scenario {
    /// Small drones within 50 m of a short-range radar
    Paper,
    /// Drones of up to 25 m/s at 0.3 to 3 km, scanned at 10 to 1 Hz
    CounterUas,
}

impl Scenario {
    /// The scenario whose models have these bounds.
    pub fn of(bounds: &Bounds<f64>) -> Option<Self> {
        let alike = |scenario: &Self| scenario.recipe().bounds().single() == bounds.single();
        [Self::Paper, Self::CounterUas].into_iter().find(alike)
    }

    /// How its shipped model is trained.
    pub fn recipe(self) -> Recipe {
        match self {
            Self::Paper => Recipe::DEFAULT,
            Self::CounterUas => Recipe::COUNTER_UAS,
        }
    }

    /// Built-in flights to learn from. They are longer than a training flight, which is cut from
    /// them anywhere.
    pub fn training_flights(self) -> GeneratorSettings {
        let paper = GeneratorSettings {
            flights: 1500,
            seed: 77,
            duration_s: 24.0,
            ..GeneratorSettings::default()
        };
        match self {
            Self::Paper => paper,
            Self::CounterUas => GeneratorSettings {
                flights: 500,
                duration_s: 60.0,
                ..self.moved(paper)
            },
        }
    }

    /// Built-in flights to judge by, which no training sees.
    pub fn held_out_flights(self) -> GeneratorSettings {
        let paper = GeneratorSettings {
            flights: 128,
            seed: 9001,
            ..GeneratorSettings::default()
        };
        match self {
            Self::Paper => paper,
            Self::CounterUas => GeneratorSettings {
                flights: 64,
                duration_s: 30.0,
                ..self.moved(paper)
            },
        }
    }

    /// The same number of flights where and how this scenario has them.
    fn moved(self, settings: GeneratorSettings) -> GeneratorSettings {
        GeneratorSettings {
            speed_scale: 4.0,
            size_scale: 16.0,
            volume: self.recipe().volume,
            ..settings
        }
    }

    /// `flights` under every noise and rate that the scenario is judged by.
    pub fn cells(self, flights: &[Flight], seed: u64) -> Vec<Cell> {
        match self {
            Self::Paper => NoiseLevel::ALL
                .into_iter()
                .flat_map(|level| SamplingRate::ALL.map(|rate| (level, rate)))
                .map(|(level, rate)| {
                    let settings = RadarSettings::paper(level, NoiseTable::Radians, rate, seed);
                    Cell::new(format!("{level} {rate}"), flights, |flight| {
                        sample_radar(flight, &settings)
                    })
                })
                .collect(),
            Self::CounterUas => COUNTER_UAS_ANGLES_DEG
                .into_iter()
                .flat_map(|angle_deg| COUNTER_UAS_STRIDES.map(|stride| (angle_deg, stride)))
                .map(|(angle_deg, stride)| scan_cell(flights, angle_deg, stride, seed))
                .collect(),
        }
    }
}

/// Every `stride`-th sample with this error of both angles, some missed.
fn scan_cell(flights: &[Flight], angle_deg: f64, stride: usize, seed: u64) -> Cell {
    let noise = NoiseSigmas::counter_uas(angle_deg);
    let settings = RadarSettings {
        gap_phase: 0,
        noise,
        errors: Errors::Gaussian,
        stated: noise,
        rate: SamplingRate::FULL,
        seed,
    };
    let name = format!("{angle_deg} deg, {:.0} Hz", 10.0 / stride as f64);
    Cell::new(name, flights, |flight| {
        let ids = [name_id("missed"), name_id(&flight.name), stride as u64];
        let mut random = RandomSource::new(seed, &ids);
        let mut readings = sample_radar(flight, &settings);
        for (index, reading) in readings.iter_mut().enumerate().skip(1) {
            if index % stride != 0 || random.chance(COUNTER_UAS_MISSED) {
                *reading = None;
            }
        }
        readings
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flights::generator::generate;

    #[test]
    fn every_cell_measures_what_its_name_says() {
        for (scenario, cells) in [(Scenario::Paper, 9), (Scenario::CounterUas, 9)] {
            let settings = GeneratorSettings {
                flights: 2,
                ..scenario.held_out_flights()
            };
            let flights = generate(&settings).unwrap();
            let found = scenario.cells(&flights, 1);
            assert_eq!(found.len(), cells);
            assert!(found.iter().all(|cell| cell.trials.len() == 2));
            let measured = |cell: &Cell| cell.trials[0].readings.iter().flatten().count();
            assert!(measured(&found[0]) > measured(&found[2]));
            assert!(
                found
                    .iter()
                    .all(|cell| cell.trials[1].readings[0].is_some())
            );
        }
    }

    #[test]
    fn no_flight_is_both_learned_and_judged() {
        for scenario in [Scenario::Paper, Scenario::CounterUas] {
            let (a, b) = (scenario.training_flights(), scenario.held_out_flights());
            assert_ne!(a.seed, b.seed);
        }
    }
}
