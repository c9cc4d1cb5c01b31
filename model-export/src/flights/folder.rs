//! A folder of flight files.

use crate::flights::csv::options::ReadOptions;
use crate::flights::csv::{FlightFile, FlightFileError, read_flight_csv};
use std::path::{Path, PathBuf};

/// Most samples of all files together: 56 hours at 100 Hz.
pub const SAMPLES_MAX: usize = 20_000_000;

/// Why a folder gives no flights.
#[derive(Debug, thiserror::Error)]
pub enum FlightFolderError {
    /// The folder is missing or cannot be read.
    #[error("{}: cannot read: {cause}", path.display())]
    Io {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        #[source]
        cause: std::io::Error,
    },
    /// No file ends in `.csv` or `.txt`.
    #[error("{}: no .csv or .txt file in this folder", .0.display())]
    NoFlights(PathBuf),
    /// Beyond [`SAMPLES_MAX`].
    #[error("{}: more than {SAMPLES_MAX} samples in its files", .0.display())]
    TooManySamples(PathBuf),
    /// One of the files is not a flight.
    #[error(transparent)]
    File(#[from] FlightFileError),
}

/// Reads every `.csv` and `.txt` file of a folder, sorted by name; or the one file that `path` is.
///
/// Sub-folders, hidden files and other endings (a README.md, a LICENSE) are passed over; a `.csv`
/// or `.txt` file that is not a flight is an error, so no flight goes missing unnoticed.
///
/// # Errors
/// See [`FlightFolderError`].
pub fn read_flights(
    path: &Path,
    options: &ReadOptions,
) -> Result<Vec<FlightFile>, FlightFolderError> {
    let io = |cause| FlightFolderError::Io {
        path: path.to_owned(),
        cause,
    };
    if !std::fs::metadata(path).map_err(io)?.is_dir() {
        return Ok(vec![read_flight_csv(path, options)?]);
    }
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(io)? {
        let file = entry.map_err(io)?.path();
        if is_flight_name(&file) && !file.is_dir() {
            files.push(file);
        }
    }
    if files.is_empty() {
        return Err(FlightFolderError::NoFlights(path.to_owned()));
    }
    files.sort();
    let mut flights = Vec::with_capacity(files.len());
    let mut samples = 0;
    for file in &files {
        let read = read_flight_csv(file, options)?;
        samples += read.flight.samples.len();
        if samples > SAMPLES_MAX {
            return Err(FlightFolderError::TooManySamples(path.to_owned()));
        }
        flights.push(read);
    }
    Ok(flights)
}

fn is_flight_name(path: &Path) -> bool {
    let hidden = path
        .file_name()
        .is_none_or(|name| name.as_encoded_bytes().starts_with(b"."));
    let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
    !hidden && ending.is_some_and(|ending| ending == "csv" || ending == "txt")
}

#[cfg(test)]
mod tests {
    use super::{FlightFile, FlightFolderError};
    use std::path::Path;

    fn read_flights(path: &Path) -> Result<Vec<FlightFile>, FlightFolderError> {
        super::read_flights(path, &Default::default())
    }

    const GOOD: &str = "timestamp,tx,ty,tz\n0.0,1,2,3\n0.1,1.5,2,3\n0.2,2,2,3\n";

    #[test]
    fn flights_come_sorted_and_other_files_are_passed_over() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["b.csv", "a.txt", "C.CSV", "z9.csv", "z10.csv"] {
            std::fs::write(folder.path().join(name), GOOD).unwrap();
        }
        for name in ["README.md", "LICENSE", ".hidden.csv", "._b.csv", "csv"] {
            std::fs::write(folder.path().join(name), "not a flight").unwrap();
        }
        std::fs::create_dir(folder.path().join("folder.csv")).unwrap();
        let flights = read_flights(folder.path()).unwrap();
        let names: Vec<&str> = flights
            .iter()
            .map(|file| file.flight.name.as_str())
            .collect();
        assert_eq!(names, ["C.CSV", "a.txt", "b.csv", "z10.csv", "z9.csv"]);
    }

    #[test]
    fn one_file_of_any_ending_is_a_folder_of_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.log");
        std::fs::write(&path, GOOD).unwrap();
        assert_eq!(read_flights(&path).unwrap().len(), 1);
    }

    #[test]
    fn a_bad_flight_file_an_empty_and_a_missing_folder_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let empty = read_flights(folder.path()).unwrap_err();
        assert!(matches!(empty, FlightFolderError::NoFlights(_)), "{empty}");
        std::fs::write(folder.path().join("README.md"), "hello").unwrap();
        read_flights(folder.path()).unwrap_err();

        std::fs::write(folder.path().join("a.csv"), GOOD).unwrap();
        std::fs::write(folder.path().join("b.csv"), "hello").unwrap();
        let bad = read_flights(folder.path()).unwrap_err().to_string();
        assert!(
            bad.contains("b.csv:1: column `timestamp` is missing from the header"),
            "{bad}"
        );

        let missing = read_flights(&folder.path().join("none")).unwrap_err();
        assert!(matches!(missing, FlightFolderError::Io { .. }), "{missing}");
    }
}
