//! A scenario: flights, the volume they fill and the radar that sees them, read from TOML.
//!
//! Keys are strict: unknown, missing or out-of-range ones are errors that name file and line.

mod error;
pub mod radar;
mod toml_form;

use std::path::Path;

use bnkf_model_export::flights::generator::GeneratorSettings;
use bnkf_model_export::flights::volume::Volume;

use radar::Radar;

pub use error::ScenarioError;

/// A scenario that was checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// Short name.
    pub name: String,
    /// One sentence for people.
    pub summary: String,
    /// Number of generated flights.
    pub count: usize,
    /// Number of generated flights of a quick run.
    pub quick_count: usize,
    /// Duration of a flight, seconds.
    pub duration_s: f64,
    /// Samples per second.
    pub rate_hz: f64,
    /// Factor on the speeds of generated flights.
    pub speed_scale: f64,
    /// Factor on the lengths of generated flights.
    pub size_scale: f64,
    /// Where flights take place.
    pub volume: Volume,
    /// The radar.
    pub radar: Radar,
    /// SHA-256 of its text.
    pub sha256: String,
}

/// The scenarios that are part of the program: name and text.
pub const BUILT_IN: [(&str, &str); 2] = [
    ("paper", include_str!("../scenarios/paper.toml")),
    ("counter-uas", include_str!("../scenarios/counter-uas.toml")),
];

impl Scenario {
    /// A built-in scenario by its name, or else the file `name`.
    ///
    /// # Errors
    /// The file cannot be read, or a line of it is wrong.
    pub fn find(name: &Path) -> Result<Self, ScenarioError> {
        let built_in = BUILT_IN.iter().find(|(known, _)| name == Path::new(known));
        if let Some((known, text)) = built_in {
            return toml_form::parse(text, &format!("{known}.toml"));
        }
        let file = name.display().to_string();
        let text = std::fs::read_to_string(name).map_err(|cause| ScenarioError::Io {
            known: BUILT_IN.map(|(known, _)| known).join(", "),
            file: file.clone(),
            cause,
        })?;
        toml_form::parse(&text, &file)
    }

    /// Settings that generate `flights` flights of this scenario.
    pub fn generator(&self, flights: usize, seed: u64) -> GeneratorSettings {
        GeneratorSettings {
            flights,
            seed,
            duration_s: self.duration_s,
            rate_hz: self.rate_hz,
            speed_scale: self.speed_scale,
            size_scale: self.size_scale,
            timing_jitter_s: 0.0,
            volume: self.volume,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use bnkf_model_export::flights::volume::Volume;
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{
        COUNTER_UAS_ANGLES_DEG, NoiseLevel, NoiseSigmas, NoiseTable,
    };
    use bnkf_model_export::recursive::scenario::{
        COUNTER_UAS_MISSED, COUNTER_UAS_STRIDES, Scenario as Trained,
    };

    use super::{BUILT_IN, Scenario};
    use crate::scenario::radar::{Pattern, Radar};

    #[test]
    fn the_papers_scenario_is_the_papers() {
        let scenario = Scenario::find(Path::new("paper")).unwrap();
        assert_eq!(scenario.volume, Volume::PAPER);
        let radar = Radar::paper(NoiseTable::Radians);
        assert_eq!(scenario.radar.sigmas, radar.sigmas);
        assert_eq!(scenario.radar.rates, SamplingRate::ALL);
        assert_eq!(scenario.radar.conditions().len(), 18);
        for level in NoiseLevel::ALL {
            for table in [NoiseTable::Radians, NoiseTable::Printed] {
                assert_eq!(scenario.radar.sigmas(table, level), level.sigmas(table));
            }
        }
    }

    #[test]
    fn the_surveillance_radar_sees_kilometres_and_misses_some() {
        let scenario = Scenario::find(Path::new("counter-uas")).unwrap();
        assert_eq!(scenario.radar.range_m_max, 3000.0);
        assert_eq!(scenario.radar.pattern, Pattern::Even);
        let high = scenario.radar.sigmas(NoiseTable::Printed, NoiseLevel::High);
        assert!((high.azimuth_rad - 0.7_f64.to_radians()).abs() < 1e-15);
        assert_eq!(high.range_m, 3.0);
    }

    /// The figures that the counter-UAS model was trained for are the scenario's.
    #[test]
    fn the_surveillance_radar_is_the_one_that_its_model_was_trained_for() {
        let scenario = Scenario::find(Path::new("counter-uas")).unwrap();
        let trained = Trained::CounterUas.held_out_flights();
        assert_eq!(scenario.volume, Volume::COUNTER_UAS);
        assert_eq!(scenario.volume, trained.volume);
        assert_eq!(scenario.speed_scale, trained.speed_scale);
        assert_eq!(scenario.size_scale, trained.size_scale);
        assert_eq!(scenario.rate_hz, trained.rate_hz);
        for (level, angle_deg) in NoiseLevel::ALL.into_iter().zip(COUNTER_UAS_ANGLES_DEG) {
            let sigmas = scenario.radar.sigmas(NoiseTable::Printed, level);
            assert_eq!(sigmas, NoiseSigmas::counter_uas(angle_deg));
        }
        let strides = scenario.radar.rates.iter().map(|rate| 1.0 / rate.get());
        let trained = COUNTER_UAS_STRIDES.map(|stride| stride as f64);
        assert!(strides.eq(trained));
        let missed = 1.0 - scenario.radar.detection_probability;
        assert!((missed - COUNTER_UAS_MISSED).abs() < 1e-12);
    }

    /// Every built-in file with one line changed, and what the error must say.
    #[test]
    fn typos_are_named_with_file_and_line() {
        let (_, text) = BUILT_IN[0];
        let cases = [
            (
                "rate_hz = 10.0",
                "rate_herz = 10.0",
                "unknown field `rate_herz`",
            ),
            (
                "rate_hz = 10.0",
                "rate_hz = -1.0",
                "`rate_hz` = -1 is not between",
            ),
            (
                "rate_hz = 10.0",
                "rate_hz = \"ten\"",
                "invalid type: string",
            ),
            ("count = 100", "count = 1", "`count` = 1 is not between"),
            (
                "range_m_max = 46.9",
                "range_m_max = 4.69",
                "`range_m_min` is not below `range_m_max`",
            ),
            (
                "rates = [1.0, 0.75, 0.5]",
                "rates = [1.0, 1.75]",
                "sampling rate 1.75",
            ),
            ("rates = [1.0, 0.75, 0.5]", "rates = []", "`rates` is empty"),
            (
                "pattern = \"blocks\"",
                "pattern = \"block\"",
                "unknown variant `block`",
            ),
            (
                "detection_probability = 1.0",
                "detection_probability = 1.5",
                "`detection_probability` = 1.5",
            ),
            (
                "elevation = 0.01\n",
                "elevation = nan\n",
                "`elevation` = NaN",
            ),
            ("[volume]", "[volume", ""),
        ];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.toml");
        for (from, to, message) in cases {
            let line = text[..text.find(from).unwrap()].lines().count()
                + usize::from(!text.starts_with(from));
            std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
            let error = Scenario::find(&path).unwrap_err().to_string();
            assert!(error.contains(message), "{to}: {error}");
            assert!(!error.contains('\n'), "{error}");
            // Of two keys that contradict each other either may be named; a table that ends too
            // early is noticed a line later.
            let named = [line - 1, line, line + 1]
                .iter()
                .any(|line| error.starts_with(&format!("{}:{line}: ", path.display())));
            assert!(named, "{to}: line {line}, {error}");
        }
        std::fs::write(&path, text.replacen("rate_hz = 10.0\n", "", 1)).unwrap();
        let error = Scenario::find(&path).unwrap_err().to_string();
        assert!(error.contains("missing field `rate_hz`"), "{error}");
    }

    #[test]
    fn an_unknown_name_lists_the_built_in_ones() {
        let error = Scenario::find(Path::new("papper")).unwrap_err().to_string();
        assert!(
            error.contains("papper") && error.contains("paper, counter-uas"),
            "{error}"
        );
    }
}
