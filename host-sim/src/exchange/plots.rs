//! Plots of somebody's radar, read from a CSV file.
//!
//! A row is what the radar said at one time, in the order in which it came. Columns: `time_s` or `time_us`;
//! any of `range_m`, `elevation_rad` or `elevation_deg`, `azimuth_rad` or `azimuth_deg`, `range_rate_mps`,
//! empty where it was not measured; for each its `sigma_...` in the same unit, or one for all rows from
//! outside; `sensor_x_m,sensor_y_m,sensor_z_m` and `sensor_vx_mps,sensor_vy_mps,sensor_vz_mps` where the
//! radar is not at rest in the origin; `late_s`, how long after its time it came. A row without any channel asks
//! for an estimate in a gap. Rows of several targets have a column `flight`, and what else tells them apart:
//! `noise_table`, `noise`, `rate`. Others are not read, and said to be.

use core::f64::consts::TAU;
use std::collections::HashMap;
use std::path::Path;

use bnkf::measurement::AZIMUTH_MAX_RAD;
use bnkf_model_export::radar::polar::wrap_azimuth;
use bnkf_model_export::radar::pose::Pose;
use bnkf_model_export::radar::reading::Reading;

use super::columns::{Row, Table, TableCause, TableError, is_same};
use super::readings;

/// Columns that tell targets apart.
const NAMES: [&str; 4] = ["flight", "noise_table", "noise", "rate"];
/// Furthest time from the first row's, s: a year.
const SPAN_S_MAX: f64 = 3.2e7;

/// Standard deviations of channels whose columns are missing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StatedSigmas {
    /// Of the range, metres.
    pub range_m: Option<f64>,
    /// Of both angles, radians.
    pub angle_rad: Option<f64>,
    /// Of the range-rate, metres per second.
    pub range_rate_mps: Option<f64>,
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Plots {
    /// In the order in which they appear.
    pub targets: Vec<Target>,
    /// Columns that mean nothing here: somebody else's, or names that are not quite right.
    pub unread: Vec<String>,
    /// Columns of radians that seem to hold degrees, and the names that would say so.
    pub degrees: Vec<[&'static str; 2]>,
}

/// What a radar said of one target.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// What tells it apart; empty where nothing does.
    pub name: String,
    /// In the order in which they came.
    pub plots: Vec<Plot>,
}

/// One row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plot {
    /// Its line in the file.
    pub line: u64,
    /// Microseconds since the file's first row.
    pub time_us: u64,
    /// What was measured, if anything.
    pub reading: Option<Reading>,
}

/// A channel: place of its values, unit, and where their standard deviations are.
struct Column {
    at: usize,
    name: &'static str,
    unit: f64,
    sigma: Sigma,
}

enum Sigma {
    At(usize, &'static str),
    Same(f64),
}

/// Value and sigma columns of a channel in its units, and what one of these is worth.
type Named = (&'static str, &'static str, f64);

const RANGE: &[Named] = &[("range_m", "sigma_range_m", 1.0)];
const ELEVATION: &[Named] = &[
    ("elevation_rad", "sigma_elevation_rad", 1.0),
    (
        "elevation_deg",
        "sigma_elevation_deg",
        core::f64::consts::PI / 180.0,
    ),
];
const AZIMUTH: &[Named] = &[
    ("azimuth_rad", "sigma_azimuth_rad", 1.0),
    (
        "azimuth_deg",
        "sigma_azimuth_deg",
        core::f64::consts::PI / 180.0,
    ),
];
const RANGE_RATE: &[Named] = &[("range_rate_mps", "sigma_range_rate_mps", 1.0)];

/// Places of all columns.
struct Columns {
    names: Vec<usize>,
    time: (usize, &'static str, f64),
    channels: [Option<Column>; 4],
    position: Option<[usize; 3]>,
    velocity: Option<[usize; 3]>,
    late: Option<usize>,
}

/// Reads a file.
///
/// # Errors
/// The file is no such table.
pub fn read(path: &Path, sigmas: StatedSigmas) -> Result<Plots, TableError> {
    let mut table = Table::open(path)?;
    let columns = Columns::of(&table, sigmas)?;
    let unread = unread(&table);
    let mut targets: Vec<Target> = Vec::new();
    let mut places: HashMap<String, usize> = HashMap::new();
    let mut start_s = None;
    let (mut elevations, mut azimuths) = (Turns::default(), Turns::default());
    while let Some(row) = table.next_row()? {
        let plot = columns.plot(&row, &mut start_s);
        let mut plot = plot.map_err(|cause| table.fault(Some(row.line), cause))?;
        if let Some(reading) = &mut plot.reading {
            elevations.count(reading.elevation_rad);
            azimuths.count(reading.azimuth_rad);
            // What no azimuth is stays so, for the tracker to refuse.
            if reading.azimuth_rad.abs() <= f64::from(AZIMUTH_MAX_RAD) {
                reading.azimuth_rad = wrap_azimuth(reading.azimuth_rad);
            }
        }
        let parts = columns.names.iter().map(|at| row.text(*at));
        let name = parts.collect::<Vec<_>>().join(" ");
        let place = *places.entry(name).or_insert_with_key(|name| {
            targets.push(Target {
                name: name.clone(),
                plots: Vec::new(),
            });
            targets.len() - 1
        });
        targets[place].plots.push(plot);
    }
    if targets.is_empty() {
        return Err(table.fault(None, TableCause::Row("no rows".to_owned())));
    }
    for target in &mut targets {
        // Rows that say how late they came stand at their own times.
        let came_us = |plot: &Plot| plot.time_us + plot.reading.map_or(0, |r| r.late_us);
        if target
            .plots
            .iter()
            .any(|plot| came_us(plot) != plot.time_us)
        {
            target.plots.sort_by_key(came_us);
        }
    }
    let angles = [(ELEVATION, elevations), (AZIMUTH, azimuths)];
    let degrees = angles.iter().filter_map(|(names, turns)| {
        let [(in_radians, ..), (in_degrees, ..)] = names else {
            return None;
        };
        let seems = turns.are_most() && table.find(in_radians).is_some();
        seems.then_some([*in_radians, *in_degrees])
    });
    let degrees = degrees.collect();
    Ok(Plots {
        targets,
        unread,
        degrees,
    })
}

/// How many angles lie beyond a whole turn.
#[derive(Clone, Copy, Default)]
struct Turns {
    beyond: usize,
    all: usize,
}

impl Turns {
    /// Counts an angle, radians, if it is one.
    fn count(&mut self, angle_rad: f64) {
        self.all += usize::from(!angle_rad.is_nan());
        self.beyond += usize::from(angle_rad.abs() > TAU);
    }

    fn are_most(&self) -> bool {
        2 * self.beyond > self.all
    }
}

/// Names of columns that are no one's here, nor what `readings` writes beside the plots.
fn unread(table: &Table) -> Vec<String> {
    let channels = [RANGE, ELEVATION, AZIMUTH, RANGE_RATE].concat();
    let mut known = readings::header();
    known.push("time_s");
    known.extend(channels.iter().flat_map(|channel| [channel.0, channel.1]));
    let known = |name: &str| known.iter().any(|other| is_same(other, name));
    let names = table.names().iter().filter(|name| !known(name));
    names.cloned().collect()
}

impl Columns {
    fn of(table: &Table, sigmas: StatedSigmas) -> Result<Self, TableError> {
        let time = match (table.find("time_us"), table.find("time_s")) {
            (Some(_), Some(_)) => {
                let said = "both `time_us` and `time_s`".to_owned();
                return Err(table.header_fault(TableCause::Row(said)));
            }
            (Some(at), None) => (at, "time_us", 1e-6),
            (None, Some(at)) => (at, "time_s", 1.0),
            (None, None) => {
                return Err(table.lacks("`time_s` or `time_us`"));
            }
        };
        let channels = [
            channel(table, ELEVATION, sigmas.angle_rad, "--sigma-angle-rad")?,
            channel(table, AZIMUTH, sigmas.angle_rad, "--sigma-angle-rad")?,
            channel(table, RANGE, sigmas.range_m, "--sigma-range-m")?,
            channel(
                table,
                RANGE_RATE,
                sigmas.range_rate_mps,
                "--sigma-range-rate-mps",
            )?,
        ];
        let [elevation, azimuth, range, range_rate] = channels.each_ref();
        for (stated, option, own) in [
            (sigmas.range_m, "--sigma-range-m", vec![range]),
            (
                sigmas.angle_rad,
                "--sigma-angle-rad",
                vec![elevation, azimuth],
            ),
            (
                sigmas.range_rate_mps,
                "--sigma-range-rate-mps",
                vec![range_rate],
            ),
        ] {
            let mut own = own.into_iter().flatten();
            let is_used = own.any(|column| matches!(column.sigma, Sigma::Same(_)));
            if stated.is_some() && !is_used {
                let said = format!(
                    "{option} is for channels whose `sigma_...` is no column: there is none"
                );
                return Err(table.header_fault(TableCause::Row(said)));
            }
        }
        if channels.iter().all(Option::is_none) {
            let names = "`range_m`, `elevation_rad`, `azimuth_rad` or `range_rate_mps`";
            return Err(table.lacks(names));
        }
        Ok(Self {
            names: NAMES.iter().filter_map(|name| table.find(name)).collect(),
            time,
            channels,
            position: table.group(["sensor_x_m", "sensor_y_m", "sensor_z_m"])?,
            velocity: table.group(["sensor_vx_mps", "sensor_vy_mps", "sensor_vz_mps"])?,
            late: table.find("late_s"),
        })
    }

    /// One row; the first one's time is where times begin.
    fn plot(&self, row: &Row, start_s: &mut Option<f64>) -> Result<Plot, TableCause> {
        let (at, name, unit_s) = self.time;
        let number = row.number(at, name)?;
        // Of an epoch in microseconds a difference of whole numbers keeps every digit.
        let since_s = unit_s * (number - *start_s.get_or_insert(number));
        if !(0.0..=SPAN_S_MAX).contains(&since_s) {
            return Err(TableCause::Row(format!(
                "`{name}`: {since_s} s after the first row's, which must be the earliest and no year before"
            )));
        }
        let time_us = (1e6 * since_s).round() as u64;
        let [elevation, azimuth, range, range_rate] = [0, 1, 2, 3].map(|i: usize| {
            let channel = self.channels[i].as_ref();
            channel.map_or(Ok(None), |channel| channel.sensed(row))
        });
        let channels = [elevation?, azimuth?, range?, range_rate?];
        if channels.iter().all(Option::is_none) {
            return Ok(Plot {
                line: row.line,
                time_us,
                reading: None,
            });
        }
        let [elevation, azimuth, range, range_rate] =
            channels.map(|sensed| sensed.unwrap_or((f64::NAN, f64::NAN)));
        let numbers = |places: Option<[usize; 3]>, name| {
            let mut vector = [0.0; 3];
            for (slot, at) in vector.iter_mut().zip(places.into_iter().flatten()) {
                *slot = row.number(at, name)?;
            }
            Ok::<_, TableCause>(vector)
        };
        let late_s = match self.late {
            Some(at) => row.number_or_none(at, "late_s")?.unwrap_or(0.0),
            None => 0.0,
        };
        if !(0.0..=SPAN_S_MAX).contains(&late_s) {
            return Err(row.wrong(self.late.unwrap_or(0), "late_s", "seconds from 0 to a year"));
        }
        Ok(Plot {
            line: row.line,
            time_us,
            reading: Some(Reading {
                time_us,
                range_m: range.0,
                elevation_rad: elevation.0,
                azimuth_rad: azimuth.0,
                range_rate_mps: range_rate.0,
                sigma_range_m: range.1,
                sigma_elevation_rad: elevation.1,
                sigma_azimuth_rad: azimuth.1,
                sigma_range_rate_mps: range_rate.1,
                sensor: Pose {
                    position_m: numbers(self.position, "sensor_x_m,sensor_y_m,sensor_z_m")?,
                    velocity_mps: numbers(
                        self.velocity,
                        "sensor_vx_mps,sensor_vy_mps,sensor_vz_mps",
                    )?,
                },
                late_us: (1e6 * late_s).round() as u64,
            }),
        })
    }
}

fn channel(
    table: &Table,
    units: &[Named],
    stated: Option<f64>,
    option: &str,
) -> Result<Option<Column>, TableError> {
    let mut found = units
        .iter()
        .filter_map(|named| Some((table.find(named.0)?, named)));
    let Some((at, &(name, sigma_name, unit))) = found.next() else {
        return Ok(None);
    };
    if let Some((_, (other, ..))) = found.next() {
        let said = format!("both `{name}` and `{other}`");
        return Err(table.header_fault(TableCause::Row(said)));
    }
    let sigma = match (table.find(sigma_name), stated) {
        (Some(at), _) => Sigma::At(at, sigma_name),
        (None, Some(stated)) => Sigma::Same(stated),
        (None, None) => {
            let said =
                format!("there is no column `{sigma_name}`; {option} gives one for all rows");
            return Err(table.header_fault(TableCause::Row(said)));
        }
    };
    Ok(Some(Column {
        at,
        name,
        unit,
        sigma,
    }))
}

impl Column {
    /// Value and standard deviation, if the channel was measured.
    fn sensed(&self, row: &Row) -> Result<Option<(f64, f64)>, TableCause> {
        let Some(value) = row.number_or_none(self.at, self.name)? else {
            return Ok(None);
        };
        let sigma = match self.sigma {
            Sigma::Same(sigma) => sigma,
            Sigma::At(at, name) => self.unit * row.number(at, name)?,
        };
        Ok(Some((self.unit * value, sigma)))
    }
}
