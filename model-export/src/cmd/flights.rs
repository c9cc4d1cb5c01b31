//! `model-export flights`: writes built-in flights as files.

use super::flight_source::{BUILTIN_SEED, flight_count};
use crate::atomic_file::AtomicWriteError;
use crate::flights::csv::write_flight_csv;
use crate::flights::flight::Flight;
use crate::flights::generator::{GeneratorError, GeneratorSettings, generate};
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Writes built-in flights of 15 s as CSV files, one a flight: timestamp,tx,ty,tz.
///
/// The folder appears with all of its files or not at all.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Number of flights
    #[arg(long, value_name = "N", value_parser = flight_count)]
    builtin: usize,
    /// Seed of the flights
    #[arg(long, value_name = "SEED", default_value_t = BUILTIN_SEED)]
    builtin_seed: u64,
    /// The folder to make; it must not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Why no folder was written.
#[derive(Debug, thiserror::Error)]
pub enum FlightsError {
    /// The flights cannot be generated.
    #[error("--builtin: {0}")]
    Generator(#[from] GeneratorError),
    /// Something of that name would be lost.
    #[error("{}: exists already", .0.display())]
    Exists(PathBuf),
    /// The folder cannot be made.
    #[error("{}: cannot make this folder: {cause}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        #[source]
        cause: std::io::Error,
    },
    /// A flight cannot be written.
    #[error(transparent)]
    Write(#[from] AtomicWriteError),
    /// Standard output was closed.
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
}

/// Runs the command.
///
/// # Errors
/// See [`FlightsError`].
pub fn run(args: &Args) -> Result<(), FlightsError> {
    let flights = generate(&GeneratorSettings {
        flights: args.builtin,
        seed: args.builtin_seed,
        ..GeneratorSettings::default()
    })?;
    write_folder(&args.out, &flights)?;
    let positions: usize = flights.iter().map(|flight| flight.samples.len()).sum();
    writeln!(
        std::io::stdout(),
        "{}: {} flights ({positions} positions)",
        args.out.display(),
        flights.len(),
    )?;
    Ok(())
}

/// Writes the files into a folder beside `path`, which then takes the name.
fn write_folder(path: &Path, flights: &[Flight]) -> Result<(), FlightsError> {
    if path.symlink_metadata().is_ok() {
        return Err(FlightsError::Exists(path.to_owned()));
    }
    let folder = |cause| FlightsError::Folder {
        path: path.to_owned(),
        cause,
    };
    let parent = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".bnkf-");
    // A temporary folder is private by default; a result is as readable as any other.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o777));
    }
    let unfinished = builder.tempdir_in(parent).map_err(folder)?;
    for flight in flights {
        write_flight_csv(
            &unfinished.path().join(format!("{}.csv", flight.name)),
            flight,
        )?;
    }
    std::fs::rename(unfinished.path(), path).map_err(folder)?;
    // It has another name now: nothing is left to remove.
    let _moved = unfinished.keep();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{FlightsError, run, write_folder};
    use crate::flights::csv::options::ReadOptions;
    use crate::flights::flight_file::FlightFile;
    use crate::flights::folder::read_flights;
    use crate::flights::generator::{GeneratorSettings, generate};
    use clap::Parser as _;
    use std::path::Path;

    #[derive(clap::Parser)]
    #[command(no_binary_name = true)]
    struct Line {
        #[command(flatten)]
        args: super::Args,
    }

    fn flights() -> Vec<crate::flights::flight::Flight> {
        let settings = GeneratorSettings {
            flights: 3,
            ..GeneratorSettings::default()
        };
        generate(&settings).unwrap()
    }

    #[test]
    fn what_is_written_reads_back_to_the_last_bit() {
        let folder = tempfile::tempdir().unwrap();
        let (path, flights) = (folder.path().join("flights"), flights());
        write_folder(&path, &flights).unwrap();
        let mut read = read_flights(&path, &ReadOptions::default()).unwrap();
        assert_eq!(read.len(), 3);
        for flight in &flights {
            let name = format!("{}.csv", flight.name);
            let at = read
                .iter()
                .position(|file| file.flight.name == name)
                .unwrap();
            let FlightFile { flight: other, .. } = read.remove(at);
            assert_eq!(other.samples.len(), 150);
            for (read, written) in other.samples.iter().zip(&flight.samples) {
                assert_eq!(read.time_s, written.time_s);
                assert_eq!(read.position_m, written.position_m);
            }
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    /// docs/sample-flights/README.md names the command.
    #[test]
    fn the_sample_in_the_documentation_is_what_the_command_writes() {
        let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/sample-flights");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flights");
        let out = path.to_str().unwrap();
        let Line { args } = Line::parse_from(["--builtin", "12", "--out", out]);
        run(&args).unwrap();
        let written = std::fs::read_dir(&path).unwrap();
        let mut files = 0;
        for entry in written {
            let entry = entry.unwrap();
            let (ours, kept) = (entry.path(), sample.join(entry.file_name()));
            assert_eq!(std::fs::read(ours).unwrap(), std::fs::read(kept).unwrap());
            files += 1;
        }
        assert_eq!(files, 12);
        let kept = std::fs::read_dir(&sample).unwrap();
        assert_eq!(kept.count(), files + 1, "the flights and a README.md");
    }

    #[test]
    fn a_folder_is_whole_or_absent_and_never_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let taken = folder.path().join("taken");
        std::fs::create_dir(&taken).unwrap();
        let error = write_folder(&taken, &flights()).unwrap_err();
        assert!(matches!(error, FlightsError::Exists(_)), "{error}");
        assert_eq!(std::fs::read_dir(&taken).unwrap().count(), 0);

        let missing = folder.path().join("missing").join("flights");
        let error = write_folder(&missing, &flights()).unwrap_err();
        assert!(
            error.to_string().contains("cannot make this folder"),
            "{error}"
        );

        // The last flight has no possible file name: nothing of the first two is left.
        let mut bad = flights();
        bad[2].name = "no/such/folder".to_owned();
        let path = folder.path().join("half");
        write_folder(&path, &bad).unwrap_err();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
