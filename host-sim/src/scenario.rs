//! A scenario: flights, the volume they fill and the radar that sees them, read from TOML.
//!
//! Keys are strict: unknown, missing or out-of-range ones are errors that name file and line.

mod error;
pub mod kind;
pub mod radar;
mod toml_form;
mod toml_keys;

use std::path::Path;

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::generator::{GeneratorError, GeneratorSettings};
use bnkf_model_export::flights::volume::Volume;
use bnkf_model_export::regular_file;

use kind::Kind;
use radar::Radar;

pub use error::ScenarioError;

/// A scenario that was checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// Short name.
    pub name: String,
    /// One sentence for people.
    pub summary: String,
    /// What generated flights do.
    pub kind: Kind,
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

/// The scenarios that are part of the program and like no other: name and text.
const WHOLE: [(&str, &str); 3] = [
    ("paper", include_str!("../scenarios/paper.toml")),
    ("counter-uas", include_str!("../scenarios/counter-uas.toml")),
    ("agile", include_str!("../scenarios/agile.toml")),
];

/// All scenarios that are part of the program: name and text.
pub const BUILT_IN: [(&str, &str); 21] = [
    WHOLE[0],
    WHOLE[1],
    WHOLE[2],
    ("no-doppler", include_str!("../scenarios/no-doppler.toml")),
    (
        "no-elevation",
        include_str!("../scenarios/no-elevation.toml"),
    ),
    ("angles-only", include_str!("../scenarios/angles-only.toml")),
    ("quantised", include_str!("../scenarios/quantised.toml")),
    ("student-t", include_str!("../scenarios/student-t.toml")),
    ("glint", include_str!("../scenarios/glint.toml")),
    ("bias", include_str!("../scenarios/bias.toml")),
    ("ranged", include_str!("../scenarios/ranged.toml")),
    ("two-radars", include_str!("../scenarios/two-radars.toml")),
    (
        "moving-radar",
        include_str!("../scenarios/moving-radar.toml"),
    ),
    ("late", include_str!("../scenarios/late.toml")),
    (
        "range-doppler",
        include_str!("../scenarios/range-doppler.toml"),
    ),
    (
        "range-doppler-apart",
        include_str!("../scenarios/range-doppler-apart.toml"),
    ),
    ("outliers", include_str!("../scenarios/outliers.toml")),
    ("darts", include_str!("../scenarios/darts.toml")),
    ("bursts", include_str!("../scenarios/bursts.toml")),
    ("falls", include_str!("../scenarios/falls.toml")),
    ("fast", include_str!("../scenarios/fast.toml")),
];

/// The names of all of them, for people.
pub fn known() -> String {
    BUILT_IN.map(|(name, _)| name).join(", ")
}

/// Longest scenario file, bytes.
pub const FILE_BYTES_MAX: u64 = 1 << 16;

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
        let text =
            regular_file::read_text(name, FILE_BYTES_MAX).map_err(|cause| ScenarioError::Read {
                known: known(),
                cause,
            })?;
        toml_form::parse(&text, &file)
    }

    /// `flights` flights of this scenario.
    ///
    /// # Errors
    /// They do not fit the volume.
    pub fn flights(&self, flights: usize, seed: u64) -> Result<Vec<Flight>, GeneratorError> {
        self.kind.generate(&self.generator(flights, seed))
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

    /// The scenario that `text`, the contents of `file`, describes.
    ///
    /// # Errors
    /// A line of it is wrong.
    pub fn parse(text: &str, file: &str) -> Result<Self, ScenarioError> {
        toml_form::parse(text, file)
    }
}

#[cfg(test)]
mod tests;
