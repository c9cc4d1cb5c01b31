//! Flight files: a header line `timestamp,tx,ty,tz[,...]`, then one sample a line.
//!
//! `timestamp` is in seconds, from any epoch; `tx,ty,tz` are metres, east, north, up. Columns may
//! come in any order and others are ignored; blanks around values, CRLF, a byte-order mark, a `#`
//! before the header, comment lines and blank lines are accepted, and quotes are RFC 4180's.
//!
//! Other dialects are read where they can be told: tabs, semicolons (with decimal commas) or blanks
//! between the columns, other names ([`columns`]), milliseconds to nanoseconds ([`time_unit`]),
//! north-east-down or latitude, longitude and height ([`frame`]), eight numbers a line without a header
//! (trajectories of the TUM form). What was assumed is said in [`FlightFile::notes`]. No input panics:
//! whatever is not a flight is an error that names the file, the line and the column.

pub mod columns;
pub mod frame;
pub mod options;
pub mod records;
pub mod time_unit;

use crate::atomic_file::{self, AtomicWriteError};
use crate::flights::dataflash::DataflashError;
use crate::flights::flight::{Flight, SampleField, TrackError};
use crate::flights::flight_file::FlightFile;
use crate::flights::geodetic::Geodetic;
use crate::flights::ulog::UlogError;
use crate::regular_file::ReadFileCause;
use columns::{Columns, ColumnsError};
use frame::Frame;
use options::ReadOptions;
use records::{Record, Records, RecordsError, Separator};
use std::fmt::Write;
use std::path::Path;
use time_unit::{TimeUnit, TimeUnitError};

/// Most samples of a flight file: eleven hours at 100 Hz.
pub const SAMPLES_MAX: usize = 4_000_000;
/// Largest median time step, seconds: more is no flight that a tracker follows.
pub const MEDIAN_STEP_S_MAX: f64 = 10.0;

/// What is wrong with a flight file.
#[derive(Debug, thiserror::Error)]
pub enum FlightFileCause {
    /// The file is missing, too large, no file, or cannot be read.
    #[error(transparent)]
    Read(#[from] ReadFileCause),
    /// No header line.
    #[error("the file is empty")]
    Empty,
    /// Beyond [`SAMPLES_MAX`].
    #[error("more than {SAMPLES_MAX} samples")]
    TooManySamples,
    /// The lines are not records of fields.
    #[error(transparent)]
    Records(#[from] RecordsError),
    /// The header lacks a column, or names one twice.
    #[error(transparent)]
    Columns(#[from] ColumnsError),
    /// The line ends before the column.
    #[error("`{0}` is missing")]
    MissingField(String),
    /// Not a decimal number.
    #[error("`{column}` is not a number: {text:?}")]
    NotANumber {
        /// The column.
        column: String,
        /// The first characters of what stands there.
        text: String,
    },
    /// Some numbers have a point, others a comma.
    #[error("`{column}` = {text:?}: decimal commas and decimal points in one file")]
    MixedDecimals {
        /// The column.
        column: String,
        /// What stands there.
        text: String,
    },
    /// PX4's log has no flight.
    #[error(transparent)]
    Ulog(#[from] UlogError),
    /// ArduPilot's log has no flight.
    #[error(transparent)]
    Dataflash(#[from] DataflashError),
    /// Latitudes and longitudes that are none.
    #[error("`{column}` = {value} is no {what} in degrees")]
    NotAPlace {
        /// The column.
        column: String,
        /// Its value.
        value: f64,
        /// What it should be.
        what: &'static str,
    },
    /// The numbers are not a flight.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// The times' unit cannot be told.
    #[error(transparent)]
    TimeUnit(#[from] TimeUnitError),
    /// Beyond [`MEDIAN_STEP_S_MAX`].
    #[error(
        "the median time step is {median_s} s, more than {MEDIAN_STEP_S_MAX} s: is `{column}` in another unit? \
         See --time-unit"
    )]
    StepTooLong {
        /// Median time between two samples, seconds.
        median_s: f64,
        /// The time's column.
        column: String,
    },
}

/// Writes time and position of `flight` as a flight file, in full precision, in one step.
///
/// # Errors
/// The file cannot be written; what was there before is unchanged.
pub fn write_flight_csv(path: &Path, flight: &Flight) -> Result<(), AtomicWriteError> {
    let mut text = String::from("timestamp,tx,ty,tz\n");
    for sample in &flight.samples {
        let [x, y, z] = sample.position_m;
        // `{:?}` is the shortest text that reads back as the same number.
        writeln!(text, "{:?},{x:?},{y:?},{z:?}", sample.time_s)
            .expect("a String accepts every write");
    }
    atomic_file::write(path, text.as_bytes())
}

/// The line, where there is one, and what is wrong there.
pub type Located = (Option<u64>, FlightFileCause);

/// The flight in `bytes`, the contents of the file `name`.
///
/// # Errors
/// See [`FlightFileCause`].
pub fn parse(bytes: &[u8], name: &str, options: &ReadOptions) -> Result<FlightFile, Located> {
    let (mut records, columns) = header(bytes, options)?;
    let mut decimals = Decimals::default();
    let mut rows = Vec::new();
    let mut lines = Vec::new();
    let mut invalid = 0_usize;
    while let Some(record) = records.next_record().map_err(located)? {
        if record.is_comment() {
            continue;
        }
        let at = |cause| (Some(record.line), cause);
        if rows.len() == SAMPLES_MAX {
            return Err(at(FlightFileCause::TooManySamples));
        }
        if columns.says_invalid(&record) {
            invalid += 1;
            continue;
        }
        let row = parse_row(&record, &columns, records.separator, &mut decimals);
        rows.push(row.map_err(at)?);
        lines.push(record.line);
    }
    let mut notes = decimals.notes();
    if columns.is_assumed() {
        notes.push(
            "no header and eight numbers a line: read as a TUM trajectory (seconds, x, y, z, quaternion)".to_owned(),
        );
    }
    if invalid > 0 {
        notes.push(format!(
            "{invalid} rows left out whose position is marked as invalid"
        ));
    }
    let is_geodetic = columns.frame_is_geodetic(options);
    if is_geodetic {
        // Before the times, whose unit is told by speeds in metres.
        notes.extend(to_east_north_up(&mut rows, &lines, &columns, options)?);
        // A receiver that repeats its last fix has not moved in no time.
        let all = rows.len();
        drop_repeats(&mut rows, &mut lines);
        if rows.len() < all {
            notes.push(format!(
                "{} rows left out whose time is the one before",
                all - rows.len()
            ));
        }
    }
    notes.extend(to_seconds(&mut rows, &columns, options).map_err(|cause| (None, cause))?);
    if !is_geodetic {
        notes.extend(to_east_north_up(&mut rows, &lines, &columns, options)?);
    }
    let flight = Flight::from_track(name, name, &rows).map_err(|error| {
        let line = error.index().map(|index| lines[index]);
        (line, FlightFileCause::Track(error))
    })?;
    let median_s = flight.median_step_s();
    if median_s > MEDIAN_STEP_S_MAX {
        let column = columns.title(SampleField::Time).to_owned();
        return Err((None, FlightFileCause::StepTooLong { median_s, column }));
    }
    Ok(FlightFile { flight, notes })
}

fn located((line, cause): (u64, RecordsError)) -> Located {
    (Some(line), cause.into())
}

/// The columns of a header, and the records after it.
type Header<'a> = (Records<&'a [u8]>, Columns);

/// The records after the header, by the first separator that gives the four columns.
fn header<'a>(bytes: &'a [u8], options: &ReadOptions) -> Result<Header<'a>, Located> {
    let mut best: Option<(usize, Located)> = None;
    for separator in Separator::ALL {
        // Commas are tried in any case, for the sake of an error to give.
        if separator != Separator::Comma && !separator.occurs_in(bytes) {
            continue;
        }
        let found = header_by(bytes, separator, options);
        match found {
            Ok(found) => return Ok(found),
            // The separator that divides the line most is the one to talk about.
            Err((fields, error)) if best.as_ref().is_none_or(|(most, _)| fields > *most) => {
                best = Some((fields, error));
            }
            Err(_) => {}
        }
    }
    Err(best.map_or((None, FlightFileCause::Empty), |(_, error)| error))
}

/// The same for one separator; else the number of fields of the line that is no header.
fn header_by<'a>(
    bytes: &'a [u8],
    separator: Separator,
    options: &ReadOptions,
) -> Result<Header<'a>, (usize, Located)> {
    let mut records = Records::new(bytes, separator);
    let mut comment: Option<(usize, Located)> = None;
    loop {
        let record = match records.next_record() {
            Ok(Some(record)) => record,
            Ok(None) => return Err(comment.unwrap_or((0, (None, FlightFileCause::Empty)))),
            Err(fault) => return Err((0, located(fault))),
        };
        if let Some(columns) = Columns::of_tum(&record, separator, options) {
            // Its first line is one of numbers already, and nothing says what they are.
            return Ok((Records::new(bytes, separator), columns));
        }
        match Columns::find(&record, separator, options) {
            Ok(columns) => return Ok((records, columns)),
            Err(cause) => {
                let fault = (record.width(), (Some(record.line), cause.into()));
                // A header may stand in a comment; a comment need not be one.
                if !record.is_comment() {
                    return Err(comment.unwrap_or(fault));
                }
                comment.get_or_insert(fault);
            }
        }
    }
}

fn parse_row(
    record: &Record,
    columns: &Columns,
    separator: Separator,
    decimals: &mut Decimals,
) -> Result<[f64; 4], FlightFileCause> {
    let mut row = [0.0; 4];
    for field in SampleField::ALL {
        let text = record.field(columns.index(field));
        let title = || columns.title(field).to_owned();
        if text.is_empty() {
            return Err(FlightFileCause::MissingField(title()));
        }
        let number = decimals.parse(text, separator);
        row[field as usize] = number.map_err(|fault| match fault {
            NumberFault::NotANumber => FlightFileCause::NotANumber {
                column: title(),
                text: text.chars().take(40).collect(),
            },
            NumberFault::Mixed => FlightFileCause::MixedDecimals {
                column: title(),
                text: text.chars().take(40).collect(),
            },
        })?;
    }
    Ok(row)
}

/// Which decimal signs a file has used.
#[derive(Debug, Default)]
struct Decimals {
    points: bool,
    commas: bool,
}

enum NumberFault {
    NotANumber,
    Mixed,
}

impl Decimals {
    /// The number in `text`. A comma is a decimal sign where it does not separate columns; with
    /// points elsewhere in the file it might stand between thousands, so that is refused.
    fn parse(&mut self, text: &str, separator: Separator) -> Result<f64, NumberFault> {
        let comma = separator != Separator::Comma && text.contains(',');
        self.commas |= comma;
        self.points |= text.contains('.');
        if self.commas && self.points {
            return Err(NumberFault::Mixed);
        }
        let number = if comma {
            text.replacen(',', ".", 1).parse()
        } else {
            text.parse()
        };
        number.map_err(|_| NumberFault::NotANumber)
    }

    fn notes(&self) -> Vec<String> {
        let said = "commas within numbers read as decimal signs";
        self.commas.then(|| said.to_owned()).into_iter().collect()
    }
}

/// Brings the times to seconds. Other units than seconds are counted from the first sample: an
/// epoch in nanoseconds has no microseconds left in an f64 of seconds.
fn to_seconds(
    rows: &mut [[f64; 4]],
    columns: &Columns,
    options: &ReadOptions,
) -> Result<Option<String>, FlightFileCause> {
    let title = columns.title(SampleField::Time);
    let (unit, note) = match options.time_unit.or(columns.time_unit) {
        Some(unit) => (unit, None),
        None => {
            let unit = time_unit::plausible(rows, title)?;
            let note = format!(
                "`{title}` read as {}, which gives plausible steps and speeds; --time-unit says otherwise",
                unit.name()
            );
            (unit, (unit != TimeUnit::S).then_some(note))
        }
    };
    if unit != TimeUnit::S {
        let start = rows.first().map_or(0.0, |row| row[0]);
        for row in rows {
            row[0] = (row[0] - start) / unit.per_second();
        }
    }
    Ok(note)
}

/// Leaves out rows that have the time of the one before.
fn drop_repeats(rows: &mut Vec<[f64; 4]>, lines: &mut Vec<u64>) {
    let keep: Vec<bool> = (0..rows.len())
        .map(|i| i == 0 || rows[i][0] != rows[i - 1][0])
        .collect();
    let mut kept = keep.iter();
    rows.retain(|_| *kept.next().unwrap_or(&true));
    let mut kept = keep.iter();
    lines.retain(|_| *kept.next().unwrap_or(&true));
}

fn to_east_north_up(
    rows: &mut [[f64; 4]],
    lines: &[u64],
    columns: &Columns,
    options: &ReadOptions,
) -> Result<Option<String>, Located> {
    let titles = [SampleField::X, SampleField::Y, SampleField::Z].map(|field| columns.title(field));
    let [x, y, z] = titles;
    let (frame, note) = match options.frame.or(columns.frame) {
        Some(frame) => (frame, None),
        None => {
            let (frame, note) = Frame::plausible(rows, titles);
            (frame, Some(note))
        }
    };
    match frame {
        Frame::Enu => Ok(note),
        Frame::Ned => {
            for row in rows {
                let [time, north, east, down] = *row;
                *row = [time, east, north, -down];
            }
            Ok(note)
        }
        Frame::Wgs84 => {
            let above_ground = columns.is_above_ground();
            let Some([_, latitude_deg, longitude_deg, height]) = rows.first().copied() else {
                return Ok(None);
            };
            let unit_m = columns.height_unit_m();
            let place = |latitude_deg, longitude_deg, height: f64| Geodetic {
                latitude_deg,
                longitude_deg,
                height_m: unit_m * height,
            };
            let start_m = if above_ground { 0.0 } else { height };
            let origin = place(latitude_deg, longitude_deg, start_m);
            for (row, line) in rows.iter_mut().zip(lines) {
                let here = place(row[1], row[2], row[3]);
                if !here.is_a_place() {
                    let is_latitude = row[1].is_nan() || row[1].abs() > 90.0;
                    let (column, value, what) = if is_latitude {
                        (x, row[1], "latitude")
                    } else {
                        (y, row[2], "longitude")
                    };
                    let column = column.to_owned();
                    return Err((
                        Some(*line),
                        FlightFileCause::NotAPlace {
                            column,
                            value,
                            what,
                        },
                    ));
                }
                [row[1], row[2], row[3]] = here.east_north_up(&origin);
            }
            let from = if above_ground {
                "the ground below it"
            } else {
                "it"
            };
            let unit = if unit_m == 1.0 { "metres" } else { "feet" };
            Ok(Some(format!(
                "`{x}`, `{y}`, `{z}` ({unit}) read as latitude, longitude and height: metres east and north of the first row, up from {from}"
            )))
        }
    }
}

#[cfg(test)]
mod tests;
