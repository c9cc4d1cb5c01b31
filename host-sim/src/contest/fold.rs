//! Folds by recording: segments of one flight file never stand on both sides of a split.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::random_source::RandomSource;
use bnkf_model_export::seed;

/// Which fold tests each flight.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Folds {
    /// Number of folds.
    pub count: usize,
    /// Fold of every flight, in the flights' order.
    pub of_flight: Vec<usize>,
}

/// Why flights cannot be divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{folds} folds need 2 or more, and a recording each: there are {sources} recordings")]
pub struct FoldError {
    /// Folds wanted.
    pub folds: usize,
    /// Distinct recordings.
    pub sources: usize,
}

impl Folds {
    /// Deals the recordings out to `count` folds in random order, so that folds differ by one
    /// recording at most.
    ///
    /// # Errors
    /// Fewer than two folds, or fewer recordings than folds.
    pub fn new(flights: &[Flight], count: usize, seed: u64) -> Result<Self, FoldError> {
        let mut sources: Vec<&str> = flights
            .iter()
            .map(|flight| flight.source.as_str())
            .collect();
        sources.sort_unstable();
        sources.dedup();
        if count < 2 || sources.len() < count {
            return Err(FoldError {
                folds: count,
                sources: sources.len(),
            });
        }
        RandomSource::new(seed, &[seed::name_id("folds")]).shuffle(&mut sources);
        let fold_of = |flight: &Flight| {
            let place = sources.iter().position(|source| *source == flight.source);
            place.expect("every source is in the list") % count
        };
        Ok(Self {
            count,
            of_flight: flights.iter().map(fold_of).collect(),
        })
    }

    /// The flights that train the models of `fold`: all that it does not test.
    pub fn training<'a>(&self, flights: &'a [Flight], fold: usize) -> Vec<&'a Flight> {
        let others = flights
            .iter()
            .zip(&self.of_flight)
            .filter(|(_, of)| **of != fold);
        others.map(|(flight, _)| flight).collect()
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Flight;

    use super::{FoldError, Folds};

    fn flights(sources: usize, segments: usize) -> Vec<Flight> {
        let rows = [
            [0.0, 1.0, 2.0, 3.0],
            [1.0, 2.0, 2.0, 3.0],
            [2.0, 3.0, 2.0, 3.0],
        ];
        let name = |i: usize| format!("f{}#{}", i / segments, i % segments);
        let flight =
            |i: usize| Flight::from_track(&name(i), &format!("f{}", i / segments), &rows).unwrap();
        (0..sources * segments).map(flight).collect()
    }

    #[test]
    fn segments_of_a_recording_stay_together_and_folds_are_even() {
        let flights = flights(13, 4);
        let folds = Folds::new(&flights, 5, 7).unwrap();
        for recording in folds.of_flight.chunks(4) {
            assert!(recording.iter().all(|fold| *fold == recording[0]));
        }
        for fold in 0..5 {
            let tested = folds.of_flight.iter().filter(|of| **of == fold).count() / 4;
            assert!((2..=3).contains(&tested));
            let training = folds.training(&flights, fold);
            assert_eq!(training.len(), (13 - tested) * 4);
            for flight in training {
                let index = flights.iter().position(|other| other == flight).unwrap();
                assert_ne!(folds.of_flight[index], fold);
            }
        }
    }

    #[test]
    fn the_division_depends_on_the_seed_alone() {
        let flights = flights(20, 1);
        assert_eq!(Folds::new(&flights, 5, 1), Folds::new(&flights, 5, 1));
        assert_ne!(Folds::new(&flights, 5, 1), Folds::new(&flights, 5, 2));
    }

    #[test]
    fn too_few_recordings_are_refused() {
        let error = Folds::new(&flights(3, 9), 5, 1).unwrap_err();
        assert_eq!(
            error,
            FoldError {
                folds: 5,
                sources: 3
            }
        );
        assert!(Folds::new(&flights(3, 1), 1, 1).is_err());
    }
}
