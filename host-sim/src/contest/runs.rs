//! Monte Carlo runs: the same flights again, with new noise and, if they are placed, new places.
//!
//! What an evaluation of few recordings needs: the noise of one run hides what a filter does on a
//! flight. Runs of a flight are not independent, so the bootstrap draws them together.

use bnkf_model_export::flights::flight::Flight;

/// Flights, run after run.
#[derive(Clone, Debug)]
pub struct Runs {
    /// All runs' flights; the first run's keep their names, which give every run its own noise.
    pub flights: Vec<Flight>,
    /// For every flight the number of the one that it is a run of.
    pub segment_of: Vec<usize>,
    /// Flights of the first run.
    pub first: usize,
}

impl Runs {
    /// Joins the `runs` of the same flights; a run may lack some of them.
    pub fn new(runs: Vec<Vec<Flight>>) -> Self {
        let mut joined = Self {
            flights: Vec::new(),
            segment_of: Vec::new(),
            first: runs.first().map_or(0, Vec::len),
        };
        let mut names: Vec<String> = Vec::new();
        for (index, run) in runs.into_iter().enumerate() {
            for mut flight in run {
                let known = names.iter().position(|name| *name == flight.name);
                joined.segment_of.push(known.unwrap_or(names.len()));
                if known.is_none() {
                    names.push(flight.name.clone());
                }
                if index > 0 {
                    flight.name = format!("{}~{}", flight.name, index + 1);
                }
                joined.flights.push(flight);
            }
        }
        joined
    }

    /// The first run: what training and tuning see, however many there are.
    pub fn first(&self) -> &[Flight] {
        &self.flights[..self.first]
    }

    /// How many different flights there are.
    pub fn segments(&self) -> usize {
        self.segment_of.iter().max().map_or(0, |last| last + 1)
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Flight;

    use super::Runs;

    #[test]
    fn runs_share_a_flight_and_differ_in_name() {
        let rows = [
            [0.0, 1.0, 2.0, 3.0],
            [1.0, 2.0, 2.0, 3.0],
            [2.0, 3.0, 2.0, 3.0],
        ];
        let flight = |name: &str| Flight::from_track(name, "recording", &rows).unwrap();
        // `b` has no place in the second run, `c` none in the first.
        let runs = Runs::new(vec![
            vec![flight("a"), flight("b")],
            vec![flight("a"), flight("c")],
            vec![flight("b"), flight("c")],
        ]);
        let names: Vec<_> = runs
            .flights
            .iter()
            .map(|flight| flight.name.as_str())
            .collect();
        assert_eq!(names, ["a", "b", "a~2", "c~2", "b~3", "c~3"]);
        assert_eq!(runs.segment_of, [0, 1, 0, 2, 1, 2]);
        assert_eq!((runs.first().len(), runs.segments()), (2, 3));
        assert!(
            runs.flights
                .iter()
                .all(|flight| flight.source == "recording")
        );
    }
}
