//! Percentile intervals of a mean over steps, by drawing whole flights again with replacement.
//!
//! Steps of one flight are alike, so they are no independent draws; flights are.

use bnkf_model_export::random_source::RandomSource;
use bnkf_model_export::seed;
use serde::{Deserialize, Serialize};

/// Number of resamples.
pub const RESAMPLES: usize = 2000;

/// Ends of an interval that holds 95% of the resampled means.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// 2.5% quantile.
    pub low: f64,
    /// 97.5% quantile.
    pub high: f64,
}

/// Sum and number of the values of one flight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FlightSum {
    /// Sum of the values.
    pub sum: f64,
    /// How many there are.
    pub count: u64,
}

impl FlightSum {
    /// Sums `values` up.
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        values.fold(Self::default(), |total, value| Self {
            sum: total.sum + value,
            count: total.count + 1,
        })
    }

    /// Adds the values of another part.
    pub fn join(&mut self, part: Self) {
        self.sum += part.sum;
        self.count += part.count;
    }
}

/// Mean of all values of all flights; NaN without values.
pub fn mean(flights: &[FlightSum]) -> f64 {
    let sum: f64 = flights.iter().map(|flight| flight.sum).sum();
    let count: u64 = flights.iter().map(|flight| flight.count).sum();
    sum / count as f64
}

/// 95% interval of [`mean`]; NaN at both ends without values. Equal flights and `seed` give equal
/// bits.
pub fn interval_95(flights: &[FlightSum], seed: u64) -> Interval {
    if flights.iter().all(|flight| flight.count == 0) {
        return Interval {
            low: f64::NAN,
            high: f64::NAN,
        };
    }
    let mut random = RandomSource::new(seed, &[seed::name_id("bootstrap")]);
    let mut means = Vec::with_capacity(RESAMPLES);
    while means.len() < RESAMPLES {
        let draws: Vec<_> = flights
            .iter()
            .map(|_| flights[random.below(flights.len())])
            .collect();
        // A resample of flights without any value has no mean: draw again.
        if draws.iter().any(|flight| flight.count > 0) {
            means.push(mean(&draws));
        }
    }
    means.sort_unstable_by(f64::total_cmp);
    let at = |part: f64| means[((RESAMPLES - 1) as f64 * part).round() as usize];
    Interval {
        low: at(0.025),
        high: at(0.975),
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::random_source::RandomSource;

    use super::{FlightSum, interval_95, mean};

    #[test]
    fn means_weigh_flights_by_their_steps() {
        let flights = [
            FlightSum {
                sum: 10.0,
                count: 10,
            },
            FlightSum { sum: 4.0, count: 2 },
        ];
        assert_eq!(mean(&flights), 14.0 / 12.0);
        assert_eq!(
            FlightSum::of([1.0, 2.5].into_iter()),
            FlightSum { sum: 3.5, count: 2 }
        );
    }

    #[test]
    fn equal_flights_leave_no_doubt() {
        let flights = [FlightSum { sum: 3.0, count: 2 }; 8];
        let interval = interval_95(&flights, 1);
        assert_eq!((interval.low, interval.high), (1.5, 1.5));
    }

    #[test]
    fn no_steps_have_no_interval() {
        assert!(interval_95(&[], 1).low.is_nan());
        assert!(interval_95(&[FlightSum::default(); 3], 1).high.is_nan());
    }

    /// Of 400 samples of 30 flights about 95% of the intervals must hold the true mean. Percentile
    /// intervals of 30 values hold it a little less often; 4 standard errors are 4.4%.
    #[test]
    fn the_interval_holds_the_true_mean_as_often_as_it_says() {
        let mut random = RandomSource::new(5, &[]);
        let mut held = 0;
        for trial in 0..400 {
            let flight = |()| FlightSum {
                sum: 10.0 * (3.0 + random.normal()),
                count: 10,
            };
            let flights: Vec<_> = std::iter::repeat_n((), 30).map(flight).collect();
            let interval = interval_95(&flights, trial);
            held += u32::from(interval.low <= 3.0 && 3.0 <= interval.high);
        }
        assert!((360..=396).contains(&held), "{held} of 400");
    }
}
