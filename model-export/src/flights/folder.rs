//! A folder of flight files.

use crate::flights::csv::options::ReadOptions;
use crate::flights::flight_file::{FlightFile, FlightFileError, read_flight_as};
use std::ffi::OsStr;
use std::path::{Component, Path, PathBuf};

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
    /// No file has one of [`ENDINGS`].
    #[error("{}: no .csv, .txt, .tum, .ulg or .bin file in this folder, nor in those inside it", .0.display())]
    NoFlights(PathBuf),
    /// Beyond [`SAMPLES_MAX`].
    #[error("{}: more than {SAMPLES_MAX} samples in its files", .0.display())]
    TooManySamples(PathBuf),
    /// One of the files is not a flight.
    #[error(transparent)]
    File(#[from] FlightFileError),
}

/// Endings of flight files.
pub const ENDINGS: [&str; 5] = ["csv", "txt", "tum", "ulg", "bin"];

/// Reads every flight file of a folder ([`ENDINGS`]), sorted by name; or the one file that `path` is.
///
/// Those of the folders inside it are read, too, sorted by path: so data sets are laid out that have a folder for each
/// part. A flight is named after its file as seen from `path` (`day1/a.csv`), so that files of one name in two folders
/// are two recordings. Hidden files and other endings (a README.md, a LICENSE) are passed
/// over; a file with such an ending that is not a flight is an error, so no flight goes missing unnoticed.
///
/// # Errors
/// See [`FlightFolderError`].
pub fn read_flights(
    path: &Path,
    options: &ReadOptions,
) -> Result<Vec<FlightFile>, FlightFolderError> {
    let mut flights = Vec::new();
    for_each_flight(path, options, |flight| {
        flights.push(flight);
        Ok::<_, FlightFolderError>(())
    })?;
    Ok(flights)
}

/// [`read_flights`] that holds one of them at a time: each is `taken` in its turn.
///
/// # Errors
/// See [`FlightFolderError`]; what `taken` says.
pub fn for_each_flight<E: From<FlightFolderError>>(
    path: &Path,
    options: &ReadOptions,
    mut taken: impl FnMut(FlightFile) -> Result<(), E>,
) -> Result<(), E> {
    let mut samples = 0;
    for file in flight_files(path)? {
        let name = name_within(path, &file);
        let read = read_flight_as(&file, &name, options).map_err(FlightFolderError::from)?;
        samples += read.flight.samples.len();
        if samples > SAMPLES_MAX {
            return Err(FlightFolderError::TooManySamples(path.to_owned()).into());
        }
        taken(read)?;
    }
    Ok(())
}

/// The files that hold the flights of `path`, as [`read_flights`] reads them.
///
/// # Errors
/// A folder cannot be read or has no flights.
pub fn flight_files(path: &Path) -> Result<Vec<PathBuf>, FlightFolderError> {
    let io = |cause| FlightFolderError::Io {
        path: path.to_owned(),
        cause,
    };
    if !std::fs::metadata(path).map_err(io)?.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let (mut files, folders) = contents(path)?;
    for folder in folders {
        files.extend(contents(&folder)?.0);
    }
    if files.is_empty() {
        return Err(FlightFolderError::NoFlights(path.to_owned()));
    }
    files.sort();
    Ok(files)
}

/// What the flight of `file` is called: its path from `folder` on, with `/` on every system.
fn name_within(folder: &Path, file: &Path) -> String {
    let own = file.file_name().unwrap_or(file.as_os_str());
    let parts = file.strip_prefix(folder).unwrap_or(Path::new(""));
    let parts: Vec<&OsStr> = parts.components().map(Component::as_os_str).collect();
    match parts[..] {
        // `folder` is the file itself.
        [] => own.to_string_lossy().into_owned(),
        _ => {
            let parts = parts.iter().map(|part| part.to_string_lossy());
            parts.collect::<Vec<_>>().join("/")
        }
    }
}

/// Flight files and folders of a folder, hidden ones left out.
fn contents(path: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>), FlightFolderError> {
    let io = |cause| FlightFolderError::Io {
        path: path.to_owned(),
        cause,
    };
    let (mut files, mut folders) = (Vec::new(), Vec::new());
    for entry in std::fs::read_dir(path).map_err(io)? {
        let entry = entry.map_err(io)?.path();
        if is_hidden(&entry) {
            continue;
        }
        if entry.is_dir() {
            folders.push(entry);
        } else if is_flight_name(&entry) {
            files.push(entry);
        }
    }
    folders.sort();
    Ok((files, folders))
}

fn is_hidden(path: &Path) -> bool {
    let name = path.file_name();
    name.is_none_or(|name| name.as_encoded_bytes().starts_with(b"."))
}

fn is_flight_name(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
    ending.is_some_and(|ending| ENDINGS.iter().any(|known| ending == *known))
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
    fn folders_inside_a_folder_are_its_parts() {
        let folder = tempfile::tempdir().unwrap();
        for part in ["train", "test", ".cache"] {
            std::fs::create_dir(folder.path().join(part)).unwrap();
            std::fs::write(folder.path().join(part).join("0.txt"), GOOD).unwrap();
        }
        std::fs::write(folder.path().join("README.md"), "a data set").unwrap();
        let names = || {
            let flights = read_flights(folder.path()).unwrap().into_iter();
            let own = flights.map(|file| (file.flight.name, file.flight.source));
            own.map(|(name, source)| {
                assert_eq!(name, source);
                name
            })
            .collect::<Vec<_>>()
        };
        assert_eq!(names(), ["test/0.txt", "train/0.txt"]);
        // One more in the folder itself takes none of them away.
        std::fs::write(folder.path().join("a.csv"), GOOD).unwrap();
        assert_eq!(names(), ["a.csv", "test/0.txt", "train/0.txt"]);
    }

    #[test]
    fn one_file_of_any_ending_is_a_folder_of_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.log");
        std::fs::write(&path, GOOD).unwrap();
        let flights = read_flights(&path).unwrap();
        assert_eq!(flights.len(), 1);
        assert_eq!(flights[0].flight.name, "flight.log");
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
