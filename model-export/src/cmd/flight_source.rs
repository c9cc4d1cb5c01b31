//! Which flights a subcommand works on.

use super::remarks;
use crate::flights::csv::options::ReadOptions;
use crate::flights::flight::Flight;
use crate::flights::generator::{GeneratorError, GeneratorSettings, generate};
use crate::flights::segment::PAPER_SEGMENT_S;
use crate::flights::set::{FlightSet, FlightSetError, Preparation};
use crate::flights::volume::Volume;
use std::path::PathBuf;

/// Most built-in flights: a gigabyte.
const BUILTIN_MAX: usize = 100_000;
/// Their seed by default.
pub const BUILTIN_SEED: u64 = 7001;

/// Flights of a folder, or built-in ones.
#[derive(Clone, Debug, clap::Args)]
pub struct FlightSource {
    /// Folder of flight files (.csv or .txt: timestamp,tx,ty,tz), or one file
    #[arg(long, value_name = "PATH", conflicts_with = "builtin")]
    pub flights: Option<PathBuf>,
    /// How they are read.
    #[command(flatten)]
    pub reading: ReadOptions,
    /// Number of built-in flights of 15 s, instead of a folder
    #[arg(long, value_name = "N", value_parser = flight_count,
        conflicts_with_all = ["time_unit", "frame", "columns", "resample", "segment_s", "place"])]
    pub builtin: Option<usize>,
    /// Seed of the built-in flights
    #[arg(
        long,
        value_name = "SEED",
        default_value_t = BUILTIN_SEED,
        requires = "builtin"
    )]
    pub builtin_seed: u64,
    /// Length of the segments that flights are cut into, seconds; 0 keeps them whole
    #[arg(long, value_name = "S", default_value_t = PAPER_SEGMENT_S, requires = "flights")]
    pub segment_s: f64,
    /// Moves every segment at random (yaw, mirror, shift) into the paper's volume
    #[arg(long, requires = "flights")]
    pub place: bool,
}

/// Why there are no flights.
#[derive(Debug, thiserror::Error)]
pub enum FlightSourceError {
    /// A folder cannot be read or prepared.
    #[error(transparent)]
    Folder(#[from] FlightSetError),
    /// Built-in flights cannot be generated.
    #[error("--builtin: {0}")]
    Generator(#[from] GeneratorError),
    /// Neither a folder nor a number of built-in flights.
    #[error("name the flights: --flights PATH or --builtin N")]
    Nothing,
}

/// Flights and where they came from.
#[derive(Clone, Debug)]
pub struct NamedFlights {
    /// The folder, or the generator and its seed.
    pub source: String,
    /// The flights, cut and placed.
    pub flights: Vec<Flight>,
}

impl FlightSource {
    /// The files that [`FlightSource::load`] reads.
    ///
    /// # Errors
    /// There are none, or the folder cannot be read.
    pub fn files(&self) -> Result<Vec<PathBuf>, FlightSourceError> {
        let files = self.flights.as_deref().map(FlightSet::files);
        Ok(files.transpose()?.unwrap_or_default())
    }

    /// Reads or generates the flights; `seed` places them. Segments that do not fit into the
    /// volume are named on standard error and left out.
    ///
    /// # Errors
    /// See [`FlightSourceError`].
    pub fn load(&self, seed: u64) -> Result<NamedFlights, FlightSourceError> {
        if let Some(path) = &self.flights {
            let preparation = Preparation {
                reading: self.reading.clone(),
                expected: Volume::PAPER,
                segment_s: self.segment_s,
                volume: self.place.then_some(Volume::PAPER),
                radar_m: [0.0; 3],
                seed,
            };
            let set = FlightSet::read(path, &preparation)?;
            remarks::say(&set.remarks, &set.unplaced);
            return Ok(NamedFlights {
                source: path.display().to_string(),
                flights: set.segments,
            });
        }
        builtin(
            self.builtin.ok_or(FlightSourceError::Nothing)?,
            self.builtin_seed,
        )
    }

    /// As [`FlightSource::load`], with `count` built-in flights of seed `builtin_seed` where the
    /// command names none.
    ///
    /// # Errors
    /// See [`FlightSourceError`].
    pub fn load_or_builtin(
        &self,
        count: usize,
        builtin_seed: u64,
        seed: u64,
    ) -> Result<NamedFlights, FlightSourceError> {
        match (&self.flights, self.builtin) {
            (None, None) => builtin(count, builtin_seed),
            _ => self.load(seed),
        }
    }
}

/// A number of built-in flights, as an option's value.
///
/// # Errors
/// What is wrong with `text`.
pub fn flight_count(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if (1..=BUILTIN_MAX).contains(&count) => Ok(count),
        Ok(_) => Err(format!("not 1 to {BUILTIN_MAX} flights")),
        Err(error) => Err(error.to_string()),
    }
}

/// So many built-in flights.
///
/// # Errors
/// The generator refuses the number.
pub fn builtin(flights: usize, seed: u64) -> Result<NamedFlights, FlightSourceError> {
    let settings = GeneratorSettings {
        flights,
        seed,
        ..GeneratorSettings::default()
    };
    Ok(NamedFlights {
        source: format!("{flights} built-in flights, seed {seed}"),
        flights: generate(&settings)?,
    })
}
