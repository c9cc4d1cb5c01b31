//! The keys of a scenario file and their limits.

use std::ops::{Range, RangeInclusive};

use bnkf_model_export::flights::data_hash;
use bnkf_model_export::flights::volume::Volume;
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::{NoiseSigmas, NoiseTable};
use serde::Deserialize;
use toml::Spanned;

use super::{Scenario, ScenarioError};
use crate::scenario::radar::{Pattern, Radar};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    summary: String,
    flights: Flights,
    volume: Spanned<Volume>,
    radar: RadarTable,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Flights {
    count: Spanned<f64>,
    quick_count: Spanned<f64>,
    duration_s: Spanned<f64>,
    rate_hz: Spanned<f64>,
    speed_scale: Spanned<f64>,
    size_scale: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RadarTable {
    noise_tables: Spanned<Vec<NoiseTable>>,
    rates: Spanned<Vec<SamplingRate>>,
    pattern: Pattern,
    detection_probability: Spanned<f64>,
    false_alarm_probability: Spanned<f64>,
    low: Sigmas,
    medium: Sigmas,
    high: Sigmas,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sigmas {
    range_m: Spanned<f64>,
    elevation: Spanned<f64>,
    azimuth: Spanned<f64>,
    range_rate_mps: Spanned<f64>,
}

/// Where an error belongs.
struct Place<'a> {
    text: &'a str,
    file: &'a str,
}

impl Place<'_> {
    fn error(&self, span: Option<Range<usize>>, message: &str) -> ScenarioError {
        let start = span.map_or(0, |span| span.start).min(self.text.len());
        ScenarioError::Line {
            file: self.file.to_owned(),
            line: self.text.as_bytes()[..start]
                .iter()
                .filter(|byte| **byte == b'\n')
                .count()
                + 1,
            // The parser explains over several lines; one is enough beside the line number.
            message: message.lines().collect::<Vec<_>>().join(", "),
        }
    }

    fn within(
        &self,
        value: &Spanned<f64>,
        name: &str,
        limits: RangeInclusive<f64>,
    ) -> Result<f64, ScenarioError> {
        let number = *value.get_ref();
        if limits.contains(&number) {
            return Ok(number);
        }
        let message = format!(
            "`{name}` = {number} is not between {} and {}",
            limits.start(),
            limits.end()
        );
        Err(self.error(Some(value.span()), &message))
    }

    fn sigmas(&self, sigmas: &Sigmas) -> Result<NoiseSigmas, ScenarioError> {
        Ok(NoiseSigmas {
            range_m: self.within(&sigmas.range_m, "range_m", 1e-4..=1e4)?,
            elevation_rad: self.within(&sigmas.elevation, "elevation", 1e-7..=10.0)?,
            azimuth_rad: self.within(&sigmas.azimuth, "azimuth", 1e-7..=10.0)?,
            range_rate_mps: self.within(&sigmas.range_rate_mps, "range_rate_mps", 1e-4..=100.0)?,
        })
    }

    fn filled<T: Clone>(
        &self,
        list: &Spanned<Vec<T>>,
        name: &str,
    ) -> Result<Vec<T>, ScenarioError> {
        if list.get_ref().is_empty() {
            return Err(self.error(Some(list.span()), &format!("`{name}` is empty")));
        }
        Ok(list.get_ref().clone())
    }
}

/// The scenario that `text`, the contents of `file`, describes.
pub fn parse(text: &str, file: &str) -> Result<Scenario, ScenarioError> {
    let place = Place { text, file };
    let form: File =
        toml::from_str(text).map_err(|error| place.error(error.span(), error.message()))?;
    let (flights, radar) = (&form.flights, &form.radar);
    let volume = *form.volume.get_ref();
    volume.check().map_err(|error| {
        // The table's span starts at its header; the key itself is the first of its name after it.
        let named = error.to_string();
        let key = named.split('`').nth(1).unwrap_or_default();
        let table = text.find("[volume]").unwrap_or_default();
        let start = text[table..]
            .find(key)
            .map_or(table, |offset| table + offset);
        place.error(Some(start..start), &named)
    })?;
    Ok(Scenario {
        name: form.name.clone(),
        summary: form.summary.clone(),
        count: place.within(&flights.count, "count", 2.0..=100_000.0)? as usize,
        quick_count: place.within(&flights.quick_count, "quick_count", 2.0..=100_000.0)? as usize,
        duration_s: place.within(&flights.duration_s, "duration_s", 1.0..=3600.0)?,
        rate_hz: place.within(&flights.rate_hz, "rate_hz", 0.1..=1000.0)?,
        speed_scale: place.within(&flights.speed_scale, "speed_scale", 0.01..=100.0)?,
        size_scale: place.within(&flights.size_scale, "size_scale", 0.01..=1000.0)?,
        volume,
        sha256: data_hash::of_bytes(text.as_bytes()),
        radar: Radar {
            sigmas: [
                place.sigmas(&radar.low)?,
                place.sigmas(&radar.medium)?,
                place.sigmas(&radar.high)?,
            ],
            tables: place.filled(&radar.noise_tables, "noise_tables")?,
            rates: place.filled(&radar.rates, "rates")?,
            pattern: radar.pattern,
            detection_probability: place.within(
                &radar.detection_probability,
                "detection_probability",
                0.01..=1.0,
            )?,
            false_alarm_probability: place.within(
                &radar.false_alarm_probability,
                "false_alarm_probability",
                0.0..=0.5,
            )?,
            range_m_max: volume.range_m_max,
            stated_factor: 1.0,
        },
    })
}
