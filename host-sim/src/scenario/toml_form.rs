//! The limits of a scenario file's keys, and what they amount to.

use std::ops::{Range, RangeInclusive};

use bnkf::late::LATE_MAX_US;
use bnkf::measurement::Channel;
use bnkf_model_export::brief_number::brief;
use bnkf_model_export::flights::data_hash;
use bnkf_model_export::flights::flight::SAMPLES_MIN;
use bnkf_model_export::flights::generator::{GeneratorError, NOMINAL_S_MAX};
use bnkf_model_export::flights::volume::{Volume, VolumeError};
use bnkf_model_export::radar::errors::Errors;
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::{NoiseSigmas, NoiseTable};
use bnkf_model_export::radar::sensors::Sensors;
use toml::Spanned;

use crate::campaign::variation::Variation as World;

use super::radar::{Lateness, Radar};
use super::toml_keys::{
    Circle, File, Flights, Kinship, Late, Missing, Sigmas, Site, Variation, VolumeTable,
};
use super::{Scenario, ScenarioError, WHOLE};

/// Most flights.
const COUNT_MAX: f64 = 100_000.0;
/// Most samples of all flights: a gigabyte with their tracks.
const SAMPLES_MAX: f64 = 5e6;
/// Farthest point, metres: ten times what a counter-UAS radar sees.
const RANGE_M_MAX: f64 = 50_000.0;
/// Smallest part of the samples that is measured, and most such parts.
const RATE_MIN: f64 = 0.001;
const RATES_MAX: usize = 10;
/// Most radars that measure by turns.
const SITES_MAX: usize = 10;

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
            "`{name}` = {} is not between {} and {}",
            brief(number),
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

    /// Kinds of errors that mean something.
    fn errors(&self, errors: Option<&Spanned<Errors>>) -> Result<Errors, ScenarioError> {
        let Some(errors) = errors else {
            return Ok(Errors::Gaussian);
        };
        let within = |value: f64, name: &str, limits: RangeInclusive<f64>| {
            let value = Spanned::new(errors.span(), value);
            self.within(&value, name, limits).map(|_| ())
        };
        match *errors.get_ref() {
            Errors::Gaussian | Errors::Quantised => Ok(()),
            Errors::Outliers { share } => within(share, "share", 0.0..=1.0),
            Errors::StudentT { degrees } => within(degrees, "degrees", 2.1..=1000.0),
            Errors::Glint { share, factor } => within(share, "share", 0.0..=1.0)
                .and_then(|()| within(factor, "factor", 1.0..=100.0)),
            Errors::Bias { part, time_s } => {
                within(part, "part", 0.0..=1.0).and_then(|()| within(time_s, "time_s", 0.01..=1e6))
            }
            Errors::Ranged { reference_m } => within(reference_m, "reference_m", 0.1..=RANGE_M_MAX),
        }?;
        Ok(*errors.get_ref())
    }

    /// Channels that are not measured, not all of them.
    fn missing(
        &self,
        missing: Option<&Spanned<Vec<Missing>>>,
    ) -> Result<Vec<Channel>, ScenarioError> {
        let Some(missing) = missing else {
            return Ok(Vec::new());
        };
        let distinct = self.distinct(missing.get_ref(), Some(missing.span()), "missing", 3)?;
        Ok(distinct.into_iter().map(Channel::from).collect())
    }

    /// What the radar does not measure, or each of its sites. What measures first has an azimuth:
    /// no filter starts without one.
    fn missing_by_turns(
        &self,
        missing: Option<&Spanned<Vec<Missing>>>,
        sites: &[Site],
    ) -> Result<Vec<Vec<Channel>>, ScenarioError> {
        let of_sites = sites.iter().map(|site| self.missing(site.missing.as_ref()));
        let mut turns = of_sites.collect::<Result<Vec<_>, _>>()?;
        let mut first = sites.first().and_then(|site| site.missing.as_ref());
        if let Some(missing) = missing {
            if turns.iter().any(|turn| !turn.is_empty()) {
                let message = "`missing` of the radar and of a `site` exclude each other";
                return Err(self.error(Some(missing.span()), message));
            }
            turns = vec![self.missing(Some(missing))?];
            first = Some(missing);
        }
        if let Some(first) = first.filter(|first| first.get_ref().contains(&Missing::Azimuth)) {
            let message = "`missing` has `azimuth`, without which no track starts";
            return Err(self.error(Some(first.span()), message));
        }
        Ok(turns)
    }

    /// A whole number.
    fn count(&self, value: &Spanned<f64>, name: &str) -> Result<usize, ScenarioError> {
        let count = self.within(value, name, 2.0..=COUNT_MAX)?;
        if count.fract() == 0.0 {
            return Ok(count as usize);
        }
        let message = format!("`{name}` = {count} is not a whole number");
        Err(self.error(Some(value.span()), &message))
    }

    /// Text for people, in one line.
    fn line(
        &self,
        text: &Spanned<String>,
        name: &str,
        characters_max: usize,
    ) -> Result<String, ScenarioError> {
        let characters = text.get_ref().chars().count();
        if !(1..=characters_max).contains(&characters) {
            let message =
                format!("`{name}` has {characters} characters, not 1 to {characters_max}");
            return Err(self.error(Some(text.span()), &message));
        }
        if text.get_ref().contains(char::is_control) {
            let message = format!("`{name}` has a line break or another control character");
            return Err(self.error(Some(text.span()), &message));
        }
        Ok(text.get_ref().clone())
    }

    fn speed_scale(&self, scale: &Spanned<f64>) -> Result<f64, ScenarioError> {
        self.within(scale, "speed_scale", 0.01..=100.0)
    }

    fn tables(&self, tables: &Spanned<Vec<NoiseTable>>) -> Result<Vec<NoiseTable>, ScenarioError> {
        self.distinct(tables.get_ref(), Some(tables.span()), "noise_tables", 2)
    }

    /// A list of one to `most` values, none of them twice.
    fn distinct<T: Clone + PartialEq>(
        &self,
        list: &[T],
        span: Option<Range<usize>>,
        name: &str,
        most: usize,
    ) -> Result<Vec<T>, ScenarioError> {
        if list.is_empty() {
            return Err(self.error(span, &format!("`{name}` is empty")));
        }
        if list.len() > most {
            let message = format!("`{name}` has {} values, at most {most}", list.len());
            return Err(self.error(span, &message));
        }
        if (1..list.len()).any(|index| list[..index].contains(&list[index])) {
            return Err(self.error(span, &format!("`{name}` has a value twice")));
        }
        Ok(list.to_vec())
    }

    fn rates(
        &self,
        rates: &Spanned<Vec<Spanned<f64>>>,
    ) -> Result<Vec<SamplingRate>, ScenarioError> {
        let mut checked = Vec::new();
        // No more than the next check wants to see.
        for rate in rates.get_ref().iter().take(RATES_MAX + 1) {
            let number = self.within(rate, "rates", RATE_MIN..=1.0)?;
            let rate = SamplingRate::new(number)
                .map_err(|error| self.error(Some(rate.span()), &error.to_string()))?;
            checked.push(rate);
        }
        self.distinct(&checked, Some(rates.span()), "rates", RATES_MAX)
    }

    fn volume(&self, table: &VolumeTable) -> Result<Volume, ScenarioError> {
        let size = 0.1..=RANGE_M_MAX;
        let height = -RANGE_M_MAX..=RANGE_M_MAX;
        let volume = Volume {
            range_m_min: self.within(&table.range_m_min, "range_m_min", size.clone())?,
            range_m_max: self.within(&table.range_m_max, "range_m_max", size.clone())?,
            range_m_mean: self.within(&table.range_m_mean, "range_m_mean", size.clone())?,
            range_m_sd: self.within(&table.range_m_sd, "range_m_sd", size)?,
            height_m_min: self.within(&table.height_m_min, "height_m_min", height.clone())?,
            height_m_max: self.within(&table.height_m_max, "height_m_max", height)?,
        };
        match volume.check() {
            Ok(()) => Ok(volume),
            Err(VolumeError::Empty(low, high)) => {
                let place = match low {
                    "height_m_min" => &table.height_m_min,
                    _ => &table.range_m_min,
                };
                let message = format!("`{low}` is not below `{high}`");
                Err(self.error(Some(place.span()), &message))
            }
            Err(error) => Err(self.error(Some(table.range_m_min.span()), &error.to_string())),
        }
    }

    fn late(&self, late: Option<&Late>) -> Result<Lateness, ScenarioError> {
        let Some(late) = late else {
            return Ok(Lateness::default());
        };
        let most_s = LATE_MAX_US as f64 * 1e-6;
        Ok(Lateness {
            share: self.within(&late.share, "share", 0.0..=1.0)?,
            by_s: self.within(&late.by_s, "by_s", 0.0..=most_s)?,
        })
    }

    /// Where the radars are: one in the origin, sites by turns, or one that drives.
    fn sensors(&self, sites: &[Site], circle: Option<&Circle>) -> Result<Sensors, ScenarioError> {
        if let Some(circle) = circle {
            let span = circle.radius_m.span();
            if !sites.is_empty() {
                return Err(self.error(Some(span), "`site` and `circle` exclude each other"));
            }
            return Ok(Sensors::Circling {
                radius_m: self.within(&circle.radius_m, "radius_m", 0.1..=RANGE_M_MAX)?,
                speed_mps: self.within(&circle.speed_mps, "speed_mps", -300.0..=300.0)?,
            });
        }
        if sites.len() > SITES_MAX {
            let span = sites[SITES_MAX].east_m.span();
            let message = format!("`site`: {} of them, at most {SITES_MAX}", sites.len());
            return Err(self.error(Some(span), &message));
        }
        let place = -RANGE_M_MAX..=RANGE_M_MAX;
        let mut places = Vec::with_capacity(sites.len());
        for site in sites {
            places.push([
                self.within(&site.east_m, "east_m", place.clone())?,
                self.within(&site.north_m, "north_m", place.clone())?,
                self.within(&site.up_m, "up_m", place.clone())?,
            ]);
        }
        Ok(if places.is_empty() {
            Sensors::Origin
        } else {
            Sensors::ByTurns(places)
        })
    }

    /// Every field is within its bounds, and still all together may be too much.
    fn samples(&self, flights: &Flights, count: usize) -> Result<(), ScenarioError> {
        let samples = (flights.duration_s.get_ref() * flights.rate_hz.get_ref()).round();
        let nominal_s = flights.duration_s.get_ref() * flights.speed_scale.get_ref()
            / flights.size_scale.get_ref();
        let products = [
            (
                "`duration_s` x `rate_hz`",
                samples,
                SAMPLES_MIN as f64,
                SAMPLES_MAX,
            ),
            (
                "`count` x `duration_s` x `rate_hz`",
                count as f64 * samples,
                0.0,
                SAMPLES_MAX,
            ),
            (
                "`duration_s` x `speed_scale` / `size_scale`",
                nominal_s,
                0.0,
                NOMINAL_S_MAX,
            ),
        ];
        for (name, value, low, high) in products {
            if !(low..=high).contains(&value) {
                let message = format!("{name} = {value} is not between {low} and {high}");
                return Err(self.error(Some(flights.duration_s.span()), &message));
            }
        }
        Ok(())
    }

    /// What an evaluation makes of the scenario, its other worlds too, the generator takes. `speed_scale` and
    /// `otherwise` are where a setting that it refuses belongs.
    fn worlds(
        &self,
        scenario: &Scenario,
        speed_scale: Option<Range<usize>>,
        otherwise: Option<Range<usize>>,
    ) -> Result<(), ScenarioError> {
        for world in &World::ALL {
            let Err(error) = world.check(scenario) else {
                continue;
            };
            let is_speed = matches!(error, GeneratorError::OutOfRange { field, .. } if field.contains("speed_scale"));
            let (span, own) = if is_speed {
                (
                    speed_scale,
                    format!("`speed_scale` = {}", brief(scenario.speed_scale)),
                )
            } else {
                (
                    otherwise,
                    format!("`duration_s` = {}", brief(scenario.duration_s)),
                )
            };
            let message = format!(
                "{own} is too much for the variation \"{}\" of an evaluation, where {error}",
                world.name
            );
            return Err(self.error(span, &message));
        }
        Ok(())
    }
}

/// The scenario that `text`, the contents of `file`, describes.
pub fn parse(text: &str, file: &str) -> Result<Scenario, ScenarioError> {
    let place = Place { text, file };
    let broken = |error: toml::de::Error| place.error(error.span(), error.message());
    let kinship = toml::from_str::<Kinship>(text).ok();
    if let Some(like) = kinship.and_then(|kinship| kinship.like) {
        if !like.get_ref().is_str() {
            let message = "`like` is not a text, which is the name of a built-in scenario";
            return Err(place.error(Some(like.span()), message));
        }
        return varied(&place, &toml::from_str(text).map_err(broken)?);
    }
    let form: File = toml::from_str(text).map_err(broken)?;
    let (flights, radar) = (&form.flights, &form.radar);
    let volume = place.volume(&form.volume)?;
    let scenario = Scenario {
        name: place.line(&form.name, "name", 60)?,
        summary: place.line(&form.summary, "summary", 300)?,
        kind: flights.kind,
        count: place.count(&flights.count, "count")?,
        quick_count: place.count(&flights.quick_count, "quick_count")?,
        duration_s: place.within(&flights.duration_s, "duration_s", 1.0..=3600.0)?,
        rate_hz: place.within(&flights.rate_hz, "rate_hz", 0.1..=1000.0)?,
        speed_scale: place.speed_scale(&flights.speed_scale)?,
        size_scale: place.within(&flights.size_scale, "size_scale", 0.01..=1000.0)?,
        volume,
        sha256: data_hash::of_bytes(text.as_bytes()),
        radar: Radar {
            sigmas: [
                place.sigmas(&radar.low)?,
                place.sigmas(&radar.medium)?,
                place.sigmas(&radar.high)?,
            ],
            tables: place.tables(&radar.noise_tables)?,
            rates: place.rates(&radar.rates)?,
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
            errors: place.errors(radar.errors.as_ref())?,
            missing: place.missing_by_turns(radar.missing.as_ref(), &radar.site)?,
            range_m_max: volume.range_m_max,
            stated_factor: 1.0,
            sensors: place.sensors(&radar.site, radar.circle.as_ref())?,
            late: place.late(radar.late.as_ref())?,
        },
    };
    place.samples(flights, scenario.count.max(scenario.quick_count))?;
    let (speed, duration) = (flights.speed_scale.span(), flights.duration_s.span());
    place.worlds(&scenario, Some(speed), Some(duration))?;
    Ok(scenario)
}

/// The built-in scenario that a variation names, with what it changes.
fn varied(place: &Place<'_>, form: &Variation) -> Result<Scenario, ScenarioError> {
    let like = form.like.get_ref();
    let Some((known, text)) = WHOLE.iter().find(|(known, _)| known == like) else {
        let known = WHOLE.map(|(known, _)| known).join(", ");
        let message = format!("`like` = \"{}\" is none of: {known}", like.escape_default());
        return Err(place.error(Some(form.like.span()), &message));
    };
    let base = parse(text, &format!("{known}.toml"))?;
    let tables = match &form.radar.noise_tables {
        Some(tables) => place.tables(tables)?,
        None => base.radar.tables,
    };
    let speed_scale = match &form.flights.speed_scale {
        Some(scale) => place.speed_scale(scale)?,
        None => base.speed_scale,
    };
    let scenario = Scenario {
        name: place.line(&form.name, "name", 60)?,
        summary: place.line(&form.summary, "summary", 300)?,
        kind: form.flights.kind.unwrap_or(base.kind),
        speed_scale,
        // Of both texts.
        sha256: data_hash::of_bytes(format!("{}{}", base.sha256, place.text).as_bytes()),
        radar: Radar {
            tables,
            errors: place.errors(form.radar.errors.as_ref())?,
            missing: place.missing_by_turns(form.radar.missing.as_ref(), &form.radar.site)?,
            sensors: place.sensors(&form.radar.site, form.radar.circle.as_ref())?,
            late: place.late(form.radar.late.as_ref())?,
            ..base.radar
        },
        ..base
    };
    let like = form.like.span();
    let speed = form.flights.speed_scale.as_ref().map(Spanned::span);
    place.worlds(&scenario, Some(speed.unwrap_or(like.clone())), Some(like))?;
    Ok(scenario)
}
