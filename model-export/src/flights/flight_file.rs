//! One flight file of any form: which one it is, its contents say.
//!
//! CSV and its kin ([`csv`]), PX4's ULog ([`ulog`]), ArduPilot's log
//! ([`dataflash`]).

use crate::flights::csv::options::ReadOptions;
use crate::flights::csv::{self, FlightFileCause, Located, SAMPLES_MAX};
use crate::flights::flight::Flight;
use crate::flights::{dataflash, ulog};
use crate::regular_file;
use std::path::{Path, PathBuf};

/// Largest flight file, bytes.
pub const FILE_BYTES_MAX: u64 = 1 << 28;
/// With steps shorter than this a radar that measured every sample would be an uncommon one, s.
const STEP_S_DENSE: f64 = 0.03;

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

/// A flight file as it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightFile {
    /// The flight, east-north-up.
    pub flight: Flight,
    /// What the reader assumed about unit, frame or numbers, and the option that says otherwise;
    /// empty for a file as the first line of [`csv`] describes it.
    pub notes: Vec<String>,
}

/// Reads one flight file. The flight is named after the file, and so is its source.
///
/// # Errors
/// See [`FlightFileCause`].
pub fn read_flight(path: &Path, options: &ReadOptions) -> Result<FlightFile, FlightFileError> {
    let name = path.file_name().unwrap_or(path.as_os_str());
    read_flight_as(path, &name.to_string_lossy(), options)
}

/// [`read_flight`] that names flight and source `name`.
///
/// # Errors
/// See [`FlightFileCause`].
pub fn read_flight_as(
    path: &Path,
    name: &str,
    options: &ReadOptions,
) -> Result<FlightFile, FlightFileError> {
    let failed = |(line, cause)| FlightFileError {
        path: path.to_owned(),
        line,
        cause,
    };
    let bytes = regular_file::read(path, FILE_BYTES_MAX)
        .map_err(|error| failed((None, error.cause.into())))?;
    parse(&bytes, name, options).map_err(failed)
}

/// The flight in `bytes`, the contents of the file `name`.
///
/// # Errors
/// See [`FlightFileCause`].
pub fn parse(bytes: &[u8], name: &str, options: &ReadOptions) -> Result<FlightFile, Located> {
    let of_log = |form: &str, log: Result<ulog::Rows, FlightFileCause>| {
        let ulog::Rows { rows, mut notes } = log.map_err(|cause| (None, cause))?;
        if rows.len() > SAMPLES_MAX {
            return Err((None, FlightFileCause::TooManySamples));
        }
        notes.insert(0, format!("read as {form}"));
        let flight = Flight::from_track(name, name, &rows);
        let flight = flight.map_err(|error| (None, FlightFileCause::Track(error)))?;
        Ok(FlightFile { flight, notes })
    };
    let mut file = if bytes.starts_with(ulog::MAGIC) {
        of_log(
            "PX4's ULog",
            ulog::parse(bytes).map_err(FlightFileCause::from),
        )?
    } else if bytes.starts_with(dataflash::MAGIC) {
        of_log(
            "ArduPilot's log",
            dataflash::parse(bytes).map_err(FlightFileCause::from),
        )?
    } else {
        csv::parse(bytes, name, options)?
    };
    if let Some(rate_hz) = options.resample {
        if file.flight.duration_s() * rate_hz > SAMPLES_MAX as f64 {
            return Err((None, FlightFileCause::TooManySamples));
        }
        let failed = |error| (None, FlightFileCause::Track(error));
        file.flight = file.flight.resampled(rate_hz).map_err(failed)?;
    } else {
        let step_s = file.flight.median_step_s();
        if step_s < STEP_S_DENSE {
            file.notes.push(format!(
                "samples every {:.0} ms: a radar measures every one of them; --resample HZ takes fewer",
                1e3 * step_s
            ));
        }
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An ArduPilot log of `positions` positions, seven bytes each.
    fn log(positions: usize) -> Vec<u8> {
        let mut bytes = dataflash::MAGIC.to_vec();
        bytes.extend([1, 7]);
        for (text, length) in [("XKF1", 4), ("BBBB", 16), ("TimeUS,PN,PE,PD", 64)] {
            bytes.extend(text.bytes());
            bytes.resize(bytes.len() + length - text.len(), 0);
        }
        bytes.extend(b"\xA3\x95\x01\x01\x02\x03\x04".repeat(positions));
        bytes
    }

    #[test]
    fn a_log_of_more_samples_than_a_flight_has_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.bin");
        std::fs::write(&path, log(SAMPLES_MAX + 1)).unwrap();
        let error = read_flight(&path, &ReadOptions::default()).unwrap_err();
        let said = format!("{}: more than {SAMPLES_MAX} samples", path.display());
        assert_eq!(error.to_string(), said);
        // As many as there may be, though all of one time.
        let refused = parse(&log(SAMPLES_MAX), "long.bin", &ReadOptions::default());
        assert!(matches!(refused, Err((None, FlightFileCause::Track(_)))));
    }
}
