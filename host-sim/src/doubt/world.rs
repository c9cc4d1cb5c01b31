//! Flights that are like those of the training, and flights that are not.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::generator::{GeneratorError, GeneratorSettings, generate};

use crate::manoeuvre::bursts::bursts;
use crate::manoeuvre::darts::darts;
use crate::manoeuvre::falls::falls;

/// Seed of the built-in flights; no training and no held-out set uses it.
const SEED: u64 = 9101;

/// Flights of one kind.
#[derive(Clone, Debug)]
pub struct World {
    /// What kind.
    pub name: String,
    /// The flights.
    pub flights: Vec<Flight>,
}

impl World {
    /// The built-in worlds, of `count` flights each: as those of the training mostly are, two and a half times as fast, bursts
    /// and falls, of which a training that has agile flights shows some like them, and darts, which none shows.
    ///
    /// # Errors
    /// The generator refuses the settings.
    pub fn built_in(count: usize) -> Result<Vec<Self>, GeneratorError> {
        let flights = |speed_scale, size_scale| {
            generate(&GeneratorSettings {
                flights: count,
                seed: SEED,
                speed_scale,
                size_scale,
                ..GeneratorSettings::default()
            })
        };
        let familiar = flights(1.0, 1.0)?;
        let made = |make: fn(&Flight, u64) -> Flight| {
            let flights = familiar.iter().map(|flight| make(flight, SEED));
            flights.collect::<Vec<_>>()
        };
        let (darting, bursting, falling) = (made(darts), made(bursts), made(falls));
        let world = |name: &str, flights| Self {
            name: name.to_owned(),
            flights,
        };
        Ok(vec![
            world("as trained", familiar),
            world("2.5 x speed", flights(2.5, 1.0)?),
            world("darts", darting),
            world("bursts", bursting),
            world("falls", falling),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::World;

    #[test]
    fn every_world_has_flights_of_its_own() {
        let worlds = World::built_in(2).unwrap();
        let names: Vec<&str> = worlds.iter().map(|world| world.name.as_str()).collect();
        let expected = ["as trained", "2.5 x speed", "darts", "bursts", "falls"];
        assert_eq!(names, expected);
        for (index, world) in worlds.iter().enumerate() {
            assert_eq!(world.flights.len(), 2);
            for other in &worlds[..index] {
                assert_ne!(world.flights[0].samples, other.flights[0].samples);
            }
        }
    }
}
