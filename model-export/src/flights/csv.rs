//! Flight files: a header line `timestamp,tx,ty,tz[,...]`, then one sample a line.
//!
//! `timestamp` is in seconds, from any epoch; `tx,ty,tz` are metres, east, north, up. Columns may
//! come in any order and others are ignored; blanks around values, CRLF, a byte-order mark, a `#`
//! before the header and blank lines are accepted. No input panics: whatever is not a flight is an
//! error that names the file, the line and the column.

use crate::atomic_file::{self, AtomicWriteError};
use crate::flights::flight::{Flight, SampleField, TrackError};
use std::fmt::Write;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// Largest flight file, bytes.
pub const FILE_BYTES_MAX: u64 = 1 << 28;
/// Largest median time step, seconds: more means that the times are not in seconds.
pub const MEDIAN_STEP_S_MAX: f64 = 10.0;

/// Why a file is not a flight, and where.
#[derive(Debug, thiserror::Error)]
#[error("{}{}: {cause}", path.display(), line.map(|l| format!(":{l}")).unwrap_or_default())]
pub struct FlightFileError {
    /// The file.
    pub path: PathBuf,
    /// Its line, counted from 1, where the cause has one.
    pub line: Option<u64>,
    /// What is wrong.
    #[source]
    pub cause: FlightFileCause,
}

/// What is wrong with a flight file.
#[derive(Debug, thiserror::Error)]
pub enum FlightFileCause {
    /// The file is missing or cannot be read.
    #[error("cannot read: {0}")]
    Io(#[source] std::io::Error),
    /// A folder, a device or a pipe.
    #[error("not a regular file")]
    NotAFile,
    /// Beyond [`FILE_BYTES_MAX`].
    #[error("{bytes} bytes, at most {FILE_BYTES_MAX} are read")]
    TooLarge {
        /// Size of the file.
        bytes: u64,
    },
    /// No header line.
    #[error("the file is empty")]
    Empty,
    /// The header lacks a column.
    #[error("column `{0}` is missing from the header")]
    MissingColumn(SampleField),
    /// The header names a column twice.
    #[error("column `{0}` appears twice in the header")]
    DuplicateColumn(SampleField),
    /// The line ends before the column.
    #[error("`{0}` is missing")]
    MissingField(SampleField),
    /// Not a decimal number.
    #[error("`{field}` is not a number: {text:?}")]
    NotANumber {
        /// The column.
        field: SampleField,
        /// The first characters of what stands there.
        text: String,
    },
    /// The line is not UTF-8 text.
    #[error("not UTF-8 text")]
    NotUtf8,
    /// The numbers are not a flight.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// Beyond [`MEDIAN_STEP_S_MAX`].
    #[error("the median time step is {median_s} s: is `timestamp` in seconds?")]
    StepTooLong {
        /// Median time between two samples, seconds.
        median_s: f64,
    },
}

/// Reads one flight file. The flight is named after the file, and so is its source.
///
/// # Errors
/// See [`FlightFileCause`].
pub fn read_flight_csv(path: &Path) -> Result<Flight, FlightFileError> {
    let whole_file = |cause| FlightFileError {
        path: path.to_owned(),
        line: None,
        cause,
    };
    let io = |error| whole_file(FlightFileCause::Io(error));
    let status = std::fs::metadata(path).map_err(io)?;
    if !status.is_file() {
        return Err(whole_file(FlightFileCause::NotAFile));
    }
    if status.len() > FILE_BYTES_MAX {
        let bytes = status.len();
        return Err(whole_file(FlightFileCause::TooLarge { bytes }));
    }
    let name = path.file_name().unwrap_or(path.as_os_str());
    let file = BufReader::new(File::open(path).map_err(io)?);
    parse(file, &name.to_string_lossy()).map_err(|(line, cause)| FlightFileError {
        path: path.to_owned(),
        line,
        cause,
    })
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

type Located = (Option<u64>, FlightFileCause);

fn parse(mut input: impl BufRead, name: &str) -> Result<Flight, Located> {
    let mut columns = None;
    let mut rows = Vec::new();
    let mut lines = Vec::new();
    let mut bytes = Vec::new();
    for line in 1.. {
        bytes.clear();
        let at = |cause| (Some(line), cause);
        let read = input.read_until(b'\n', &mut bytes);
        if read.map_err(|error| at(FlightFileCause::Io(error)))? == 0 {
            break;
        }
        let text = std::str::from_utf8(&bytes).map_err(|_| at(FlightFileCause::NotUtf8))?;
        // A spreadsheet saves an empty row as commas.
        if text.chars().all(|c| c == ',' || c.is_whitespace()) {
            continue;
        }
        match &columns {
            None => columns = Some(find_columns(text).map_err(at)?),
            Some(columns) => {
                rows.push(parse_row(text, columns).map_err(at)?);
                lines.push(line);
            }
        }
    }
    if columns.is_none() {
        return Err((None, FlightFileCause::Empty));
    }
    let flight = Flight::from_track(name, name, &rows).map_err(|error| {
        let line = error.index().map(|index| lines[index]);
        (line, FlightFileCause::Track(error))
    })?;
    let median_s = flight.median_step_s();
    if median_s > MEDIAN_STEP_S_MAX {
        return Err((None, FlightFileCause::StepTooLong { median_s }));
    }
    Ok(flight)
}

/// Where each of the four columns stands in the header.
fn find_columns(header: &str) -> Result<[usize; 4], FlightFileCause> {
    let titles: Vec<&str> = header
        .trim_start_matches(['\u{feff}', '#'])
        .split(',')
        .map(|title| title.trim().trim_matches('"'))
        .collect();
    let mut columns = [0; 4];
    for (column, field) in columns.iter_mut().zip(SampleField::ALL) {
        let mut places = (0..titles.len()).filter(|i| titles[*i] == field.column());
        *column = places.next().ok_or(FlightFileCause::MissingColumn(field))?;
        if places.next().is_some() {
            return Err(FlightFileCause::DuplicateColumn(field));
        }
    }
    Ok(columns)
}

fn parse_row(line: &str, columns: &[usize; 4]) -> Result<[f64; 4], FlightFileCause> {
    let mut row = [0.0; 4];
    for (k, field) in SampleField::ALL.into_iter().enumerate() {
        let text = line.split(',').nth(columns[k]).unwrap_or("").trim();
        if text.is_empty() {
            return Err(FlightFileCause::MissingField(field));
        }
        row[k] = text.parse().map_err(|_| FlightFileCause::NotANumber {
            field,
            text: text.chars().take(40).collect(),
        })?;
    }
    Ok(row)
}

#[cfg(test)]
mod tests;
