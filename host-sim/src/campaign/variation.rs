//! Worlds that differ from the one that models were fitted to, one thing at a time.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::generator::{GeneratorError, GeneratorSettings};
use bnkf_model_export::seed;

use crate::scenario::Scenario;
use crate::scenario::radar::Radar;

/// A world that is like the scenario's but for one thing.
#[derive(Clone, Debug, PartialEq)]
pub struct Variation {
    /// What differs.
    pub name: &'static str,
    /// Position of the radar in the flights' frame, as parts of the volume's mean range.
    radar_parts: [f64; 3],
    /// Factor on the ranges of the volume.
    range: f64,
    /// Factor on the speeds.
    speed: f64,
    /// Samples per second, if not the scenario's.
    rate_hz: Option<f64>,
    /// Standard deviations that readings state, over the true ones.
    stated: f64,
}

const SAME: Variation = Variation {
    name: "as trained",
    radar_parts: [0.0; 3],
    range: 1.0,
    speed: 1.0,
    rate_hz: None,
    stated: 1.0,
};

impl Variation {
    /// The unchanged world, then thirteen others.
    pub const ALL: [Self; 14] = [
        SAME,
        Self {
            name: "radar east",
            radar_parts: [0.25, 0.0, 0.0],
            ..SAME
        },
        Self {
            name: "radar west",
            radar_parts: [-0.25, 0.0, 0.0],
            ..SAME
        },
        Self {
            name: "radar north",
            radar_parts: [0.0, 0.25, 0.0],
            ..SAME
        },
        Self {
            name: "radar south",
            radar_parts: [0.0, -0.25, 0.0],
            ..SAME
        },
        Self {
            name: "radar up",
            radar_parts: [0.0, 0.0, 0.1],
            ..SAME
        },
        Self {
            name: "nearer",
            range: 0.75,
            ..SAME
        },
        Self {
            name: "farther",
            range: 1.5,
            ..SAME
        },
        Self {
            name: "half speed",
            speed: 0.5,
            ..SAME
        },
        Self {
            name: "double speed",
            speed: 2.0,
            ..SAME
        },
        Self {
            name: "2 Hz",
            rate_hz: Some(2.0),
            ..SAME
        },
        Self {
            name: "20 Hz",
            rate_hz: Some(20.0),
            ..SAME
        },
        Self {
            name: "sigmas x 0.5",
            stated: 0.5,
            ..SAME
        },
        Self {
            name: "sigmas x 2",
            stated: 2.0,
            ..SAME
        },
    ];

    /// `count` flights that no fold has seen, in the radar's frame.
    ///
    /// # Errors
    /// Flights of this kind do not fit the volume.
    pub fn flights(
        &self,
        scenario: &Scenario,
        count: usize,
        seed: u64,
    ) -> Result<Vec<Flight>, GeneratorError> {
        let seed = seed::derive(seed, &[seed::name_id("variation")]);
        let settings = self.generator(scenario, count, seed);
        let radar_m = self
            .radar_parts
            .map(|part| part * scenario.volume.range_m_mean);
        Ok(scenario
            .kind
            .generate(&settings)?
            .iter()
            .map(|flight| flight.seen_from(radar_m))
            .collect())
    }

    /// Whether the generator takes what this world makes of the scenario. That its flights fit into the volume only
    /// [`Variation::flights`] finds out.
    ///
    /// # Errors
    /// The first setting that makes no sense.
    pub fn check(&self, scenario: &Scenario) -> Result<(), GeneratorError> {
        scenario.kind.check(&self.generator(scenario, 1, 1))
    }

    fn generator(&self, scenario: &Scenario, count: usize, seed: u64) -> GeneratorSettings {
        let mut volume = scenario.volume;
        volume.range_m_min *= self.range;
        volume.range_m_max *= self.range;
        volume.range_m_mean *= self.range;
        GeneratorSettings {
            rate_hz: self.rate_hz.unwrap_or(scenario.rate_hz),
            speed_scale: scenario.speed_scale * self.speed,
            volume,
            ..scenario.generator(count, seed)
        }
    }

    /// The scenario's radar as it is in this world.
    pub fn radar(&self, scenario: &Scenario) -> Radar {
        Radar {
            stated_factor: self.stated,
            ..scenario.radar.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::Variation;
    use crate::scenario::Scenario;

    /// Mean over samples of a value of a flight's sample.
    fn mean(
        variation: &Variation,
        value: fn(&bnkf_model_export::flights::flight::Sample) -> f64,
    ) -> f64 {
        let scenario = Scenario::find(Path::new("paper")).unwrap();
        let flights = variation.flights(&scenario, 8, 1).unwrap();
        let values: Vec<f64> = flights
            .iter()
            .flat_map(|flight| &flight.samples)
            .map(value)
            .collect();
        values.iter().sum::<f64>() / values.len() as f64
    }

    fn named(name: &str) -> &'static Variation {
        const ALL: &[Variation] = &Variation::ALL;
        ALL.iter().find(|variation| variation.name == name).unwrap()
    }

    #[test]
    fn names_are_distinct() {
        let mut names: Vec<_> = Variation::ALL
            .iter()
            .map(|variation| variation.name)
            .collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), Variation::ALL.len());
    }

    #[test]
    fn agile_flights_have_all_worlds_too() {
        let agile = Scenario::find(Path::new("agile")).unwrap();
        for variation in &Variation::ALL {
            let flights = variation.flights(&agile, 20, 1);
            assert_eq!(flights.unwrap().len(), 20, "{}", variation.name);
        }
    }

    #[test]
    fn each_world_differs_in_what_it_says() {
        let speed = |sample: &bnkf_model_export::flights::flight::Sample| {
            sample
                .velocity_mps
                .iter()
                .map(|v| v * v)
                .sum::<f64>()
                .sqrt()
        };
        let range = |sample: &bnkf_model_export::flights::flight::Sample| {
            sample.position_m.iter().map(|v| v * v).sum::<f64>().sqrt()
        };
        let (same, fast) = (
            mean(named("as trained"), speed),
            mean(named("double speed"), speed),
        );
        assert!((fast / same - 2.0).abs() < 0.5, "{same} {fast}");
        let (near, far) = (mean(named("nearer"), range), mean(named("farther"), range));
        assert!(far > 1.5 * near, "{near} {far}");
        let east = mean(named("radar east"), |sample| sample.position_m[0]);
        let same = mean(named("as trained"), |sample| sample.position_m[0]);
        assert!((same - east - 10.0).abs() < 1e-6, "{same} {east}");
        let scenario = Scenario::find(Path::new("paper")).unwrap();
        assert_eq!(
            named("2 Hz").flights(&scenario, 2, 1).unwrap()[0]
                .samples
                .len(),
            30
        );
        assert_eq!(named("sigmas x 2").radar(&scenario).stated_factor, 2.0);
    }
}
