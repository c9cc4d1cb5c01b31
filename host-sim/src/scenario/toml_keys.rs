//! The keys of a scenario file, unchecked.

use bnkf::measurement::Channel;
use bnkf_model_export::radar::errors::Errors;
use bnkf_model_export::radar::noise::NoiseTable;
use serde::Deserialize;
use toml::Spanned;

use super::kind::Kind;
use super::radar::Pattern;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct File {
    pub name: Spanned<String>,
    pub summary: Spanned<String>,
    pub flights: Flights,
    pub volume: VolumeTable,
    pub radar: RadarTable,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VolumeTable {
    pub range_m_min: Spanned<f64>,
    pub range_m_max: Spanned<f64>,
    pub range_m_mean: Spanned<f64>,
    pub range_m_sd: Spanned<f64>,
    pub height_m_min: Spanned<f64>,
    pub height_m_max: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Flights {
    #[serde(default)]
    pub kind: Kind,
    pub count: Spanned<f64>,
    pub quick_count: Spanned<f64>,
    pub duration_s: Spanned<f64>,
    pub rate_hz: Spanned<f64>,
    pub speed_scale: Spanned<f64>,
    pub size_scale: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RadarTable {
    pub noise_tables: Spanned<Vec<NoiseTable>>,
    pub rates: Spanned<Vec<Spanned<f64>>>,
    pub pattern: Pattern,
    pub detection_probability: Spanned<f64>,
    pub false_alarm_probability: Spanned<f64>,
    pub errors: Option<Spanned<Errors>>,
    pub missing: Option<Spanned<Vec<Missing>>>,
    #[serde(default)]
    pub site: Vec<Site>,
    pub circle: Option<Circle>,
    pub late: Option<Late>,
    pub low: Sigmas,
    pub medium: Sigmas,
    pub high: Sigmas,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sigmas {
    pub range_m: Spanned<f64>,
    pub elevation: Spanned<f64>,
    pub azimuth: Spanned<f64>,
    pub range_rate_mps: Spanned<f64>,
}

/// A scenario that is like a built-in one but for what it names.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variation {
    pub name: Spanned<String>,
    pub summary: Spanned<String>,
    pub like: Spanned<String>,
    #[serde(default)]
    pub flights: FlightsVariation,
    #[serde(default)]
    pub radar: RadarVariation,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlightsVariation {
    pub kind: Option<Kind>,
    pub speed_scale: Option<Spanned<f64>>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RadarVariation {
    pub noise_tables: Option<Spanned<Vec<NoiseTable>>>,
    pub errors: Option<Spanned<Errors>>,
    pub missing: Option<Spanned<Vec<Missing>>>,
    #[serde(default)]
    pub site: Vec<Site>,
    pub circle: Option<Circle>,
    pub late: Option<Late>,
}

/// Tells a [`Variation`] from a whole scenario, whatever stands there.
#[derive(Deserialize)]
pub struct Kinship {
    pub like: Option<Spanned<toml::Value>>,
}

/// A channel by the name of its sigma.
#[derive(Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Missing {
    Elevation,
    Azimuth,
    Range,
    RangeRate,
}

impl From<Missing> for Channel {
    fn from(missing: Missing) -> Self {
        match missing {
            Missing::Elevation => Self::Elevation,
            Missing::Azimuth => Self::Azimuth,
            Missing::Range => Self::Range,
            Missing::RangeRate => Self::RangeRate,
        }
    }
}

/// One of several radars that measure by turns.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Site {
    pub east_m: Spanned<f64>,
    pub north_m: Spanned<f64>,
    pub up_m: Spanned<f64>,
    pub missing: Option<Spanned<Vec<Missing>>>,
}

/// The circle that a radar drives on.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Circle {
    pub radius_m: Spanned<f64>,
    pub speed_mps: Spanned<f64>,
}

/// Readings that come late.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Late {
    pub share: Spanned<f64>,
    pub by_s: Spanned<f64>,
}
