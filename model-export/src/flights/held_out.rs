//! Which flights are held out of training.

use crate::flights::flight::Flight;
use crate::random_source::RandomSource;
use crate::seed;
use std::collections::BTreeSet;

/// Training flights and the flights that training is stopped by.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    /// Flights to learn from.
    pub training: Vec<Flight>,
    /// Flights that only measure.
    pub validation: Vec<Flight>,
    /// The recordings; `None` when there is only one and its last segments are held out.
    pub sources: Option<Sources>,
}

/// The recordings that flights were cut from.
#[derive(Clone, Debug, PartialEq)]
pub struct Sources {
    /// Their number.
    pub all: usize,
    /// Those that are held out whole.
    pub held_out: Vec<String>,
}

/// Fewer than two flights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0} flights: at least two are needed, one of them to stop training by")]
pub struct HeldOutError(pub usize);

/// Holds out about `fraction` of the recordings, at least one and never all: segments of one
/// recording resemble each other, so a split between them would measure memory.
///
/// # Errors
/// There is nothing to split.
pub fn hold_out(flights: Vec<Flight>, fraction: f64, seed: u64) -> Result<HeldOut, HeldOutError> {
    if flights.len() < 2 {
        return Err(HeldOutError(flights.len()));
    }
    let sources: BTreeSet<String> = flights.iter().map(|flight| flight.source.clone()).collect();
    let mut sources: Vec<String> = sources.into_iter().collect();
    let share = |count: usize| ((count as f64 * fraction).round() as usize).clamp(1, count - 1);
    if sources.len() == 1 {
        let mut training = flights;
        let validation = training.split_off(training.len() - share(training.len()));
        return Ok(HeldOut {
            training,
            validation,
            sources: None,
        });
    }
    RandomSource::new(seed, &[seed::name_id("held out")]).shuffle(&mut sources);
    let all = sources.len();
    sources.truncate(share(all));
    let (validation, training) = flights
        .into_iter()
        .partition(|flight| sources.contains(&flight.source));
    Ok(HeldOut {
        training,
        validation,
        sources: Some(Sources {
            all,
            held_out: sources,
        }),
    })
}

#[cfg(test)]
mod tests {
    use super::{HeldOutError, Sources, hold_out};
    use crate::flights::flight::Flight;

    fn flight(name: &str, source: &str) -> Flight {
        let rows = [[0.0; 4], [1.0; 4], [2.0; 4]];
        Flight::from_track(name, source, &rows).unwrap()
    }

    #[test]
    fn recordings_are_held_out_whole() {
        let flights: Vec<Flight> = (0..40)
            .map(|i| flight(&format!("{i}"), &format!("file {}", i % 10)))
            .collect();
        let split = hold_out(flights, 0.2, 1).unwrap();
        assert_eq!((split.training.len(), split.validation.len()), (32, 8));
        let Sources {
            all,
            held_out: sources,
        } = split.sources.unwrap();
        assert_eq!((all, sources.len()), (10, 2));
        assert!(split.validation.iter().all(|f| sources.contains(&f.source)));
        assert!(split.training.iter().all(|f| !sources.contains(&f.source)));
    }

    #[test]
    fn at_least_one_recording_stays_on_each_side() {
        for fraction in [0.0, 0.5, 1.0] {
            let split = hold_out(vec![flight("a", "a"), flight("b", "b")], fraction, 3).unwrap();
            assert_eq!((split.training.len(), split.validation.len()), (1, 1));
        }
    }

    #[test]
    fn one_recording_gives_its_last_segments() {
        let flights = (0..5).map(|i| flight(&format!("a#{i}"), "a")).collect();
        let split = hold_out(flights, 0.2, 1).unwrap();
        assert_eq!(split.sources, None);
        assert_eq!(split.validation[0].name, "a#4");
        assert_eq!(
            hold_out(vec![flight("a", "a")], 0.2, 1),
            Err(HeldOutError(1))
        );
    }
}
