//! The flights of a run: read, cut into segments, placed, and seen from the radar.

use std::path::{Path, PathBuf};

use crate::flights::csv::options::ReadOptions;
use crate::flights::data_hash::FlightsHash;
use crate::flights::flight::Flight;
use crate::flights::folder::{FlightFolderError, flight_files, for_each_flight};
use crate::flights::placement::place;
use crate::flights::segment::{SegmentError, segments};
use crate::flights::suspicion::suspicions;
use crate::flights::volume::Volume;

/// What is done with flights before they are used.
#[derive(Clone, Debug, PartialEq)]
pub struct Preparation {
    /// How the files are read.
    pub reading: ReadOptions,
    /// Length of the segments that flights are cut into, seconds; 0 keeps them whole.
    pub segment_s: f64,
    /// Volume that every segment is moved into, rigidly and at random; `None` leaves them.
    pub volume: Option<Volume>,
    /// Where the models expect flights; those that are elsewhere raise a suspicion.
    pub expected: Volume,
    /// Position of the radar in the flights' frame, metres.
    pub radar_m: [f64; 3],
    /// Seed of the placement.
    pub seed: u64,
}

/// Flights that are ready to be sampled.
#[derive(Clone, Debug)]
pub struct FlightSet {
    /// Number of flights before cutting.
    pub flights: usize,
    /// The segments, in the radar's frame.
    pub segments: Vec<Flight>,
    /// Segments that do not fit into the volume, and why.
    pub unplaced: Vec<String>,
    /// What was assumed about the files and which stay whole (`note: ...`), and what is suspicious about the flights
    /// (`warning: ...`): to be said.
    pub remarks: Vec<String>,
    /// SHA-256 of the flights as they came.
    pub sha256: String,
}

/// Why there are no flights.
#[derive(Debug, thiserror::Error)]
pub enum FlightSetError {
    /// A file or folder cannot be read, or a file is not a flight.
    #[error(transparent)]
    Read(#[from] FlightFolderError),
    /// The segment length makes no sense.
    #[error(transparent)]
    Segment(#[from] SegmentError),
    /// No segment fits into the volume.
    #[error("{}: none of {segments} segments fits into the volume; the first: {first}", path.display())]
    NothingPlaced {
        /// Where the flights came from.
        path: PathBuf,
        /// How many there are.
        segments: usize,
        /// Why the first does not fit.
        first: String,
    },
}

impl FlightSet {
    /// The files that [`FlightSet::read`] reads: what a command that does so must not write over.
    ///
    /// # Errors
    /// There are none, or a folder cannot be read.
    pub fn files(path: &Path) -> Result<Vec<PathBuf>, FlightSetError> {
        Ok(flight_files(path)?)
    }

    /// Reads the flights of a folder or of one file and prepares them.
    ///
    /// # Errors
    /// See [`FlightSetError`].
    pub fn read(path: &Path, preparation: &Preparation) -> Result<Self, FlightSetError> {
        let mut set = SetInParts::default();
        for_each_flight(path, &preparation.reading, |file| {
            for note in file.notes {
                set.notes.push((note, file.flight.name.clone()));
            }
            Ok::<_, FlightSetError>(set.add(&file.flight, preparation)?)
        })?;
        let set = set.finish(preparation);
        if set.segments.is_empty() {
            return Err(FlightSetError::NothingPlaced {
                path: path.to_owned(),
                segments: set.unplaced.len(),
                first: set.unplaced.first().cloned().unwrap_or_default(),
            });
        }
        Ok(set)
    }

    /// Prepares `flights`.
    ///
    /// # Errors
    /// The segment length makes no sense.
    pub fn prepare(flights: &[Flight], preparation: &Preparation) -> Result<Self, SegmentError> {
        let mut set = SetInParts::default();
        for flight in flights {
            set.add(flight, preparation)?;
        }
        Ok(set.finish(preparation))
    }
}

/// A set under construction, which takes one flight after another: a whole one is there only beside its segments.
#[derive(Default)]
struct SetInParts {
    flights: usize,
    segments: Vec<Flight>,
    unplaced: Vec<String>,
    /// What is to be said, and of which flight.
    notes: Vec<(String, String)>,
    hash: FlightsHash,
}

impl SetInParts {
    fn add(&mut self, flight: &Flight, preparation: &Preparation) -> Result<(), SegmentError> {
        self.flights += 1;
        self.hash.add(flight);
        let cut = segments(flight, preparation.segment_s)?;
        if cut.has_holes {
            let note = format!(
                "no segment of {} s has room between its holes: kept whole, holes and all",
                preparation.segment_s
            );
            self.notes.push((note, flight.name.clone()));
        }
        for segment in cut.segments {
            let placed = match &preparation.volume {
                Some(volume) => place(&segment, volume, preparation.seed),
                None => Ok(segment),
            };
            match placed {
                Ok(segment) => self.segments.push(segment.seen_from(preparation.radar_m)),
                Err(error) => self.unplaced.push(error.to_string()),
            }
        }
        Ok(())
    }

    fn finish(self, preparation: &Preparation) -> FlightSet {
        let warnings = suspicions(&self.segments, &preparation.expected);
        let warnings = warnings.iter().map(|warning| format!("warning: {warning}"));
        let notes = grouped(&self.notes).into_iter();
        FlightSet {
            flights: self.flights,
            remarks: notes.chain(warnings).collect(),
            segments: self.segments,
            unplaced: self.unplaced,
            sha256: self.hash.finish(),
        }
    }
}

/// Every note once, with the file or the number of files that it is about.
fn grouped(notes: &[(String, String)]) -> Vec<String> {
    let mut texts: Vec<&str> = Vec::new();
    for (text, _) in notes {
        if !texts.contains(&text.as_str()) {
            texts.push(text);
        }
    }
    let line = |text: &str| {
        let mut files = notes
            .iter()
            .filter(|note| note.0 == text)
            .map(|note| &note.1);
        let first = files.next().map_or("", String::as_str);
        match files.count() {
            0 => format!("note: {first}: {text}"),
            more => format!("note: {first} and {more} more: {text}"),
        }
    };
    texts.into_iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use crate::flights::csv::options::ReadOptions;
    use crate::flights::flight::Flight;
    use crate::flights::volume::Volume;

    use super::{FlightSet, FlightSetError, Preparation};

    const AS_IS: Preparation = Preparation {
        reading: ReadOptions {
            time_unit: None,
            frame: None,
            columns: None,
            resample: None,
        },
        expected: Volume::PAPER,
        segment_s: 5.0,
        volume: None,
        radar_m: [0.0; 3],
        seed: 1,
    };

    /// A slow climb of `climb_m` over ten seconds.
    fn flight(name: &str, climb_m: f64) -> Flight {
        let row = |i: i32| {
            let part = f64::from(i) / 100.0;
            [10.0 * part, 3.0 * part, 0.0, climb_m * part]
        };
        Flight::from_track(name, name, &(0..=100).map(row).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn without_a_volume_segments_stay_and_the_radar_moves() {
        let preparation = Preparation {
            radar_m: [1.0, 2.0, -3.0],
            ..AS_IS
        };
        let set = FlightSet::prepare(&[flight("a", 1.0)], &preparation).unwrap();
        assert_eq!((set.flights, set.segments.len()), (1, 2));
        assert_eq!(set.segments[0].samples[0].position_m, [-1.0, -2.0, 3.0]);
    }

    #[test]
    fn flights_that_stay_whole_with_their_holes_are_said_once() {
        let holed = |name: &str| {
            let mut flight = flight(name, 1.0);
            let behind = flight.samples.iter_mut().skip(40);
            behind.for_each(|sample| sample.time_s += 20.0);
            flight
        };
        let preparation = Preparation {
            segment_s: 15.0,
            ..AS_IS
        };
        let flights = [holed("a"), holed("b"), flight("short", 1.0)];
        let set = FlightSet::prepare(&flights, &preparation).unwrap();
        assert_eq!(set.segments.len(), 3);
        let notes: Vec<_> = set
            .remarks
            .iter()
            .filter(|r| r.starts_with("note"))
            .collect();
        let said = "note: a and 1 more: no segment of 15 s has room between its holes: kept whole, holes and all";
        assert_eq!(notes, [said]);
    }

    #[test]
    fn what_does_not_fit_is_listed() {
        let preparation = Preparation {
            volume: Some(Volume::PAPER),
            ..AS_IS
        };
        let set = FlightSet::prepare(&[flight("flat", 1.0), flight("tower", 90.0)], &preparation)
            .unwrap();
        assert_eq!(set.segments.len(), 2);
        assert!(set.segments.iter().all(|segment| segment.source == "flat"));
        for sample in set.segments.iter().flat_map(|segment| &segment.samples) {
            assert!(Volume::PAPER.contains(sample.position_m));
        }
        assert_eq!(set.unplaced.len(), 2);
        assert!(set.unplaced[0].contains("tower#1"), "{}", set.unplaced[0]);
    }

    #[test]
    fn errors_name_file_and_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bad.csv");
        std::fs::write(
            &path,
            "timestamp,tx,ty,tz\n0,1,2,3\n0.1,oops,2,3\n0.2,1,2,3\n",
        )
        .unwrap();
        let error = FlightSet::read(folder.path(), &AS_IS).unwrap_err();
        assert!(error.to_string().contains("bad.csv:3: "), "{error}");

        std::fs::write(
            &path,
            "timestamp,tx,ty,tz\n0,0,0,0\n1,0,0,50\n2,0,0,99\n3,0,0,150\n",
        )
        .unwrap();
        let preparation = Preparation {
            volume: Some(Volume::PAPER),
            ..AS_IS
        };
        let error = FlightSet::read(&path, &preparation).unwrap_err();
        assert!(
            matches!(error, FlightSetError::NothingPlaced { segments: 1, .. }),
            "{error}"
        );
    }

    #[test]
    fn what_was_assumed_is_said_once_for_all_files() {
        let folder = tempfile::tempdir().unwrap();
        let row = |i: i32| format!("{},{},0,12\n", 100 * i, 30.0 + 0.2 * f64::from(i));
        let rows: String = (0..60).map(row).collect();
        for name in ["a.csv", "b.csv", "c.csv"] {
            let text = format!("timestamp,tx,ty,tz\n{rows}");
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let set = FlightSet::read(folder.path(), &AS_IS).unwrap();
        assert_eq!(set.remarks.len(), 1, "{:?}", set.remarks);
        assert!(
            set.remarks[0].starts_with("note: a.csv and 2 more: `timestamp` read as milliseconds"),
            "{:?}",
            set.remarks
        );
        assert!((set.segments[0].duration_s() - 4.9).abs() < 1e-9);
    }
}
