//! Flights that are like those of the training, and flights that are not.

use bnkf_model_export::flights::flight::{Flight, Sample};
use bnkf_model_export::flights::generator::{GeneratorError, GeneratorSettings, generate};
use bnkf_model_export::random_source::RandomSource;
use bnkf_model_export::seed::name_id;

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
    /// The built-in worlds, of `count` flights each: as trained, faster than any flight of the
    /// training, and flying in darts, which no flight of the training does.
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
        let darting = familiar.iter().map(darts).collect();
        let world = |name: &str, flights| Self {
            name: name.to_owned(),
            flights,
        };
        Ok(vec![
            world("as trained", familiar),
            world("2.5 x speed", flights(2.5, 1.0)?),
            world("darts", darting),
        ])
    }
}

/// A flight from the same place that rests or dashes in a straight line for half a second to two,
/// and changes its velocity within a sample: accelerations that the training never shows.
fn darts(flight: &Flight) -> Flight {
    let mut random = RandomSource::new(SEED, &[name_id("darts"), name_id(&flight.name)]);
    let centre = flight.samples[0].position_m;
    let mut position_m = centre;
    let mut velocity_mps = [0.0; 3];
    let mut until_s = 0.0;
    let mut samples: Vec<Sample> = Vec::with_capacity(flight.samples.len());
    for sample in &flight.samples {
        if let Some(last) = samples.last() {
            let dt_s = sample.time_s - last.time_s;
            position_m = core::array::from_fn(|i| position_m[i] + dt_s * velocity_mps[i]);
        }
        if sample.time_s >= until_s {
            until_s = sample.time_s + random.uniform(0.5, 2.0);
            let speed = if random.chance(0.25) {
                0.0
            } else {
                random.uniform(2.0, 8.0)
            };
            // Back towards where it began when it has gone far.
            let away = [position_m[0] - centre[0], position_m[1] - centre[1]];
            let angle = if away[0].hypot(away[1]) > 6.0 {
                (-away[1]).atan2(-away[0]) + random.uniform(-0.7, 0.7)
            } else {
                random.uniform(0.0, core::f64::consts::TAU)
            };
            let climb = (centre[2] - position_m[2]).clamp(-1.0, 1.0) + random.uniform(-0.5, 0.5);
            velocity_mps = [speed * angle.cos(), speed * angle.sin(), climb];
        }
        samples.push(Sample {
            position_m,
            velocity_mps,
            ..*sample
        });
    }
    Flight {
        name: format!("darts-{}", flight.name),
        source: flight.source.clone(),
        samples,
    }
}

#[cfg(test)]
mod tests {
    use super::World;

    #[test]
    fn darts_are_straight_and_turn_at_once() {
        let worlds = World::built_in(2).unwrap();
        let names: Vec<&str> = worlds.iter().map(|world| world.name.as_str()).collect();
        assert_eq!(names, ["as trained", "2.5 x speed", "darts"]);
        let jump = |world: &World| {
            let flights = world.flights.iter();
            let pairs = flights.flat_map(|flight| flight.samples.windows(2));
            let jump = |pair: &[bnkf_model_export::flights::flight::Sample]| {
                let between = |i| pair[1].velocity_mps[i] - pair[0].velocity_mps[i];
                f64::hypot(between(0), between(1))
            };
            pairs.map(jump).fold(0.0, f64::max)
        };
        assert!(jump(&worlds[0]) < 1.5, "{}", jump(&worlds[0]));
        assert!(jump(&worlds[2]) > 3.0, "{}", jump(&worlds[2]));
        for flight in &worlds[2].flights {
            for pair in flight.samples.windows(2) {
                for i in 0..3 {
                    let step = pair[1].position_m[i] - pair[0].position_m[i];
                    let dt_s = pair[1].time_s - pair[0].time_s;
                    assert!((step - dt_s * pair[0].velocity_mps[i]).abs() < 1e-9);
                }
            }
        }
    }
}
