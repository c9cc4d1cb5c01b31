//! What generated flights of a scenario do.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::generator::{
    GeneratorError, GeneratorSettings, generate, generate_one,
};
use bnkf_model_export::flights::placement::place;
use bnkf_model_export::seed::{derive, name_id};
use rayon::prelude::*;
use serde::Deserialize;

use crate::manoeuvre::bursts::bursts;
use crate::manoeuvre::darts::darts;
use crate::manoeuvre::falls::falls;

/// Factor on the speeds of the fast flights of [`Kind::Agile`], beside the scenario's.
const FAST: f64 = 3.0;
/// Manoeuvres that are drawn for one flight until one fits into the volume.
const ATTEMPTS_MAX: u64 = 20;

/// Which flights a scenario generates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// The generator's own: circles, lemniscates, waypoints.
    #[default]
    Cruise,
    /// By turns the generator's own, three times as fast, darts, three times as fast again, and bursts.
    Agile,
    /// Dashes that turn within a sample, from a cruise's place.
    Darts,
    /// Hovers with bursts of 10 m/s^2.
    Bursts,
    /// Cruises whose motor is cut for half a second or more.
    Falls,
}

impl Kind {
    /// The flights that `settings` describe; flight `i` does not depend on their number.
    ///
    /// # Errors
    /// A setting makes no sense, or flights of this size do not fit the volume.
    pub fn generate(self, settings: &GeneratorSettings) -> Result<Vec<Flight>, GeneratorError> {
        match self {
            Self::Cruise => generate(settings),
            Self::Agile => each(settings, agile),
            Self::Darts => each(settings, |settings, index| {
                manoeuvred(settings, index, darts)
            }),
            Self::Bursts => each(settings, |settings, index| {
                manoeuvred(settings, index, bursts)
            }),
            Self::Falls => each(settings, |settings, index| {
                manoeuvred(settings, index, falls)
            }),
        }
    }

    /// Whether the generator takes `settings` for all of these flights.
    ///
    /// # Errors
    /// The first setting that makes no sense.
    pub fn check(self, settings: &GeneratorSettings) -> Result<(), GeneratorError> {
        settings.check()?;
        match self {
            Self::Agile => fast(settings).check(),
            Self::Cruise | Self::Darts | Self::Bursts | Self::Falls => Ok(()),
        }
    }
}

/// What the fast flights of [`Kind::Agile`] are made of.
fn fast(settings: &GeneratorSettings) -> GeneratorSettings {
    GeneratorSettings {
        speed_scale: FAST * settings.speed_scale,
        ..*settings
    }
}

fn each(
    settings: &GeneratorSettings,
    make: impl Fn(&GeneratorSettings, usize) -> Result<Flight, GeneratorError> + Sync,
) -> Result<Vec<Flight>, GeneratorError> {
    let indices = (0..settings.flights).into_par_iter();
    indices.map(|index| make(settings, index)).collect()
}

fn agile(settings: &GeneratorSettings, index: usize) -> Result<Flight, GeneratorError> {
    let settings = GeneratorSettings {
        // A seed of its own: none of its flights is one of `Cruise`.
        seed: derive(settings.seed, &[name_id("agile")]),
        ..*settings
    };
    match index % 5 {
        0 => generate_one(&settings, index),
        1 | 3 => {
            let mut flight = generate_one(&fast(&settings), index)?;
            flight.name = format!("fast-{}", flight.name);
            Ok(flight)
        }
        2 => manoeuvred(&settings, index, darts),
        _ => manoeuvred(&settings, index, bursts),
    }
}

/// What `make` makes of a flight of the generator, in the volume.
fn manoeuvred(
    settings: &GeneratorSettings,
    index: usize,
    make: fn(&Flight, u64) -> Flight,
) -> Result<Flight, GeneratorError> {
    let from = generate_one(settings, index)?;
    let attempt = |attempt| {
        let seed = derive(settings.seed, &[index as u64, attempt]);
        place(&make(&from, seed), &settings.volume, seed)
    };
    let mut placed = attempt(0);
    for number in 1..ATTEMPTS_MAX {
        if placed.is_ok() {
            break;
        }
        placed = attempt(number);
    }
    placed.map_err(|last| GeneratorError::NoFit { index, last })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use bnkf_model_export::scoring::step_score::StepScore;

    use super::Kind;
    use crate::scenario::Scenario;
    use crate::scoring::binned::binned;

    fn scenario() -> Scenario {
        Scenario::find(Path::new("agile")).unwrap()
    }

    #[test]
    fn agile_flights_fill_the_bins() {
        let scenario = scenario();
        assert!(scenario.count >= 200);
        let flights = scenario.flights(scenario.count, 1).unwrap();
        let motion = flights
            .iter()
            .flat_map(|flight| flight.motion().split_off(1));
        let bins = binned(motion.map(|motion| (motion, StepScore::UNUSABLE)));
        for own in &bins {
            let (bin, steps) = (own.bin, own.means().steps);
            assert!(steps > 2000 || bin.high.is_infinite(), "{bin}: {steps}");
            assert!(steps > 200, "{bin}: {steps}");
        }
    }

    #[test]
    fn every_kind_of_flight_is_in_the_volume_and_none_is_a_cruise() {
        let scenario = scenario();
        let settings = scenario.generator(20, 1);
        let flights = Kind::Agile.generate(&settings).unwrap();
        let beginning = |text: &str| {
            let own = flights
                .iter()
                .filter(|flight| flight.name.starts_with(text));
            own.count()
        };
        assert_eq!(
            [
                beginning("fast-"),
                beginning("darts-"),
                beginning("bursts-")
            ],
            [8, 4, 4]
        );
        let mut names: Vec<_> = flights.iter().map(|flight| &flight.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), 20);
        let cruises = Kind::Cruise.generate(&settings).unwrap();
        for flight in &flights {
            let inside = |s: &bnkf_model_export::flights::flight::Sample| {
                scenario.volume.contains(s.position_m)
            };
            assert!(flight.samples.iter().all(inside), "{}", flight.name);
            assert!(
                cruises
                    .iter()
                    .all(|cruise| cruise.samples != flight.samples)
            );
        }
        let few = scenario.flights(3, 1).unwrap();
        assert_eq!(few, flights[..3]);
        assert_ne!(few, scenario.flights(3, 2).unwrap());
    }
}
