//! Two methods on the same flights: the difference per flight and how sure it is.

use serde::Serialize;

use crate::scoring::bootstrap::{FlightSum, Interval, interval_95, mean};

/// How much method `a` differs from method `b` on the same steps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PairedDifference {
    /// Mean of `a - b` over all steps; negative if `a` is smaller.
    pub difference: f64,
    /// Its 95% interval, by cluster.
    pub interval: Interval,
    /// Clusters on which `a` is smaller.
    pub wins: u64,
    /// Clusters compared: what is drawn together, all runs of a flight or all flights of a recording.
    pub clusters: u64,
}

impl PairedDifference {
    /// Compares sums of the same steps, cluster by cluster.
    ///
    /// # Panics
    /// If the two do not hold the same clusters with the same numbers of steps.
    pub fn new(a: &[FlightSum], b: &[FlightSum], seed: u64) -> Self {
        assert_eq!(a.len(), b.len(), "the same clusters");
        let differences: Vec<_> = a
            .iter()
            .zip(b)
            .map(|(a, b)| {
                assert_eq!(a.count, b.count, "the same steps");
                FlightSum {
                    sum: a.sum - b.sum,
                    count: a.count,
                }
            })
            .collect();
        Self {
            difference: mean(&differences),
            interval: interval_95(&differences, seed),
            wins: differences.iter().filter(|own| own.sum < 0.0).count() as u64,
            clusters: differences.iter().filter(|own| own.count > 0).count() as u64,
        }
    }

    /// Whether the interval lies on one side of zero.
    pub fn decided(&self) -> bool {
        self.interval.high < 0.0 || self.interval.low > 0.0
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::random_source::RandomSource;

    use super::PairedDifference;
    use crate::scoring::bootstrap::{FlightSum, interval_95};

    /// Flights differ by metres, the methods by a tenth: unpaired intervals overlap, the paired
    /// one decides.
    #[test]
    fn pairing_sees_through_the_differences_between_flights() {
        let mut random = RandomSource::new(3, &[]);
        let mut flights = |shift: f64, wobble: f64| -> Vec<FlightSum> {
            let mut level = RandomSource::new(9, &[]);
            let flight = |()| {
                let metres = 5.0 + 2.0 * level.normal() + shift + wobble * random.normal();
                FlightSum {
                    sum: 100.0 * metres,
                    count: 100,
                }
            };
            std::iter::repeat_n((), 40).map(flight).collect()
        };
        let (a, b) = (flights(-0.1, 0.05), flights(0.0, 0.05));
        assert!(interval_95(&a, 1).high > interval_95(&b, 1).low);
        let paired = PairedDifference::new(&a, &b, 1);
        assert!(
            (paired.difference + 0.1).abs() < 0.04,
            "{}",
            paired.difference
        );
        assert!(paired.decided() && paired.interval.high < 0.0);
        assert!(paired.wins > 30 && paired.clusters == 40);
        let swapped = PairedDifference::new(&b, &a, 1);
        assert_eq!(swapped.difference, -paired.difference);
    }

    #[test]
    fn equal_methods_are_undecided() {
        let flights = [
            FlightSum { sum: 1.0, count: 2 },
            FlightSum { sum: 4.0, count: 2 },
        ];
        let paired = PairedDifference::new(&flights, &flights, 1);
        assert_eq!(paired.difference, 0.0);
        assert!(!paired.decided());
        assert_eq!(paired.wins, 0);
    }
}
