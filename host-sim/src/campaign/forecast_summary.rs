//! The forecasts of one condition: metrics, how sure they are, and every method against every other.

use serde::Serialize;

use crate::filter::HORIZONS_US;
use crate::method::Method;
use crate::scenario::radar::Condition;
use crate::scoring::bootstrap::{FlightSum, Interval, interval_95};
use crate::scoring::forecast::{ForecastCell, ScoredForecast};
use crate::scoring::paired::PairedDifference;

/// One method's forecasts of one horizon under one condition.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ForecastSummary {
    /// Place and metrics.
    #[serde(flatten)]
    pub cell: ForecastCell,
    /// 95% interval of the mean ED by bootstrap, metres.
    pub ed_interval_m: Interval,
}

/// The paired difference of two methods' forecasts.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ForecastComparison {
    /// First method.
    pub a: Method,
    /// Second method.
    pub b: Method,
    /// The condition.
    #[serde(flatten)]
    pub condition: Condition,
    /// How far ahead, s.
    pub horizon_s: f64,
    /// Difference of the ED, `a - b`, metres: negative if `a` is better.
    #[serde(flatten)]
    pub ed_m: PairedDifference,
}

/// One method's forecasts on one flight.
#[derive(Clone, Copy, Debug)]
pub struct FlightForecasts<'a> {
    /// The forecasts.
    pub forecasts: &'a [ScoredForecast],
    /// Number of the cluster that is drawn as a whole by the bootstrap.
    pub cluster: usize,
}

/// Sums up what `methods` said of the same flights; of a method that said nothing there is nothing.
pub fn sum_up(
    condition: Condition,
    methods: &[(Method, Vec<FlightForecasts<'_>>)],
    seed: u64,
) -> (Vec<ForecastSummary>, Vec<ForecastComparison>) {
    let (mut summaries, mut comparisons) = (Vec::new(), Vec::new());
    let mut sums: Vec<(Method, [Vec<FlightSum>; HORIZONS_US.len()])> = Vec::new();
    for (method, flights) in methods {
        let all: Vec<_> = flights.iter().flat_map(|flight| flight.forecasts).collect();
        if all.is_empty() {
            continue;
        }
        let cells = ForecastCell::all(*method, condition, &all);
        let own = core::array::from_fn(|horizon| error_sums(flights, horizon));
        for (cell, sums) in cells.into_iter().zip(&own) {
            summaries.push(ForecastSummary {
                cell,
                ed_interval_m: interval_95(sums, seed),
            });
        }
        sums.push((*method, own));
    }
    for (horizon, ahead_us) in HORIZONS_US.into_iter().enumerate() {
        for (index, (a, first)) in sums.iter().enumerate() {
            for (b, second) in &sums[index + 1..] {
                comparisons.push(ForecastComparison {
                    a: *a,
                    b: *b,
                    condition,
                    horizon_s: 1e-6 * ahead_us as f64,
                    ed_m: PairedDifference::new(&first[horizon], &second[horizon], seed),
                });
            }
        }
    }
    (summaries, comparisons)
}

/// Errors of every cluster at one horizon, metres.
fn error_sums(flights: &[FlightForecasts<'_>], horizon: usize) -> Vec<FlightSum> {
    let count = flights.iter().map(|flight| flight.cluster + 1).max();
    let mut sums = vec![FlightSum::default(); count.unwrap_or(0)];
    for flight in flights {
        let own = flight.forecasts.iter();
        let own = own.filter(|forecast| forecast.horizon == horizon);
        let own = FlightSum::of(own.map(|forecast| forecast.score.error_m));
        let sum = &mut sums[flight.cluster];
        sum.sum += own.sum;
        sum.count += own.count;
    }
    sums
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
    use bnkf_model_export::scoring::step_score::StepScore;

    use super::*;

    #[test]
    fn methods_are_compared_at_every_horizon() {
        let condition = Condition {
            table: NoiseTable::Radians,
            noise: NoiseLevel::Low,
            rate: SamplingRate::HALF,
        };
        let flight = |error_m: f64| -> Vec<ScoredForecast> {
            let forecast = |horizon: usize| ScoredForecast {
                horizon,
                score: StepScore {
                    error_m: error_m * (1.0 + horizon as f64),
                    mahalanobis_squared: 3.0,
                    det_p_m6: 1.0,
                },
                diverged: false,
            };
            [0, 1, 2, 0].map(forecast).to_vec()
        };
        let (worse, better) = ([flight(2.0), flight(4.0)], [flight(1.0), flight(2.0)]);
        fn of(flights: &[Vec<ScoredForecast>; 2]) -> Vec<FlightForecasts<'_>> {
            flights
                .iter()
                .enumerate()
                .map(|(cluster, forecasts)| FlightForecasts { forecasts, cluster })
                .collect()
        }
        let methods = [(Method::Imm5, of(&worse)), (Method::Recursive, of(&better))];
        let (summaries, comparisons) = sum_up(condition, &methods, 1);
        assert_eq!((summaries.len(), comparisons.len()), (6, 3));
        assert_eq!(summaries[0].cell.metrics.ed_mean_m, 3.0);
        assert_eq!(summaries[5].cell.metrics.ed_mean_m, 4.5);
        let interval = summaries[0].ed_interval_m;
        assert_eq!((interval.low, interval.high), (2.0, 4.0));
        for (comparison, difference_m) in comparisons.iter().zip([1.5, 3.0, 4.5]) {
            assert_eq!(comparison.ed_m.difference, difference_m);
            assert_eq!(
                (comparison.a, comparison.b),
                (Method::Imm5, Method::Recursive)
            );
        }
        assert_eq!(comparisons[2].horizon_s, 2.0);
    }
}
