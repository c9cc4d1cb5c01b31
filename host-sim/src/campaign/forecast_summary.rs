//! The forecasts of one condition: metrics, how sure they are, and every method against every other.

use serde::Serialize;

use crate::filter::HORIZONS_US;
use crate::method::Method;
use crate::scenario::radar::Condition;
use crate::scoring::bootstrap::{FlightSum, Interval, interval_95};
use crate::scoring::forecast::{ForecastCell, ForecastSums, ScoredForecast};
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

/// The forecasts of one method under construction, which take one flight after another.
#[derive(Clone, Debug)]
pub struct ForecastAccount {
    sums: ForecastSums,
    count: usize,
    /// Errors of every cluster at every horizon, metres.
    errors_m: [Vec<FlightSum>; HORIZONS_US.len()],
}

impl ForecastAccount {
    /// Without forecasts yet; there are so many `clusters`.
    pub fn new(clusters: usize) -> Self {
        Self {
            sums: ForecastSums::default(),
            count: 0,
            errors_m: core::array::from_fn(|_| vec![FlightSum::default(); clusters]),
        }
    }

    /// Adds the forecasts of a flight of `cluster`.
    ///
    /// # Panics
    /// If the cluster is beyond what there are.
    pub fn add(&mut self, forecasts: &[ScoredForecast], cluster: usize) {
        self.count += forecasts.len();
        for forecast in forecasts {
            self.sums.add(forecast);
        }
        for (horizon, errors_m) in self.errors_m.iter_mut().enumerate() {
            let own = forecasts.iter().filter(|own| own.horizon == horizon);
            errors_m[cluster].join(FlightSum::of(own.map(|own| own.score.error_m)));
        }
    }
}

/// Sums up what `methods` said of the same flights; of a method that said nothing there is nothing.
pub fn sum_up(
    condition: Condition,
    methods: &[(Method, &ForecastAccount)],
    seed: u64,
) -> (Vec<ForecastSummary>, Vec<ForecastComparison>) {
    let (mut summaries, mut comparisons) = (Vec::new(), Vec::new());
    let told = |(_, account): &&(Method, &ForecastAccount)| account.count > 0;
    let methods: Vec<_> = methods.iter().filter(told).collect();
    for (method, account) in &methods {
        let cells = account.sums.cells(*method, condition);
        for (cell, errors_m) in cells.into_iter().zip(&account.errors_m) {
            summaries.push(ForecastSummary {
                cell,
                ed_interval_m: interval_95(errors_m, seed),
            });
        }
    }
    for (horizon, ahead_us) in HORIZONS_US.into_iter().enumerate() {
        for (index, (a, first)) in methods.iter().enumerate() {
            for (b, second) in &methods[index + 1..] {
                let (first, second) = (&first.errors_m[horizon], &second.errors_m[horizon]);
                comparisons.push(ForecastComparison {
                    a: *a,
                    b: *b,
                    condition,
                    horizon_s: 1e-6 * ahead_us as f64,
                    ed_m: PairedDifference::new(first, second, seed),
                });
            }
        }
    }
    (summaries, comparisons)
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
        let account = |flights: &[Vec<ScoredForecast>]| {
            let mut account = ForecastAccount::new(flights.len());
            for (cluster, forecasts) in flights.iter().enumerate() {
                account.add(forecasts, cluster);
            }
            account
        };
        let (worse, better) = (
            account(&[flight(2.0), flight(4.0)]),
            account(&[flight(1.0), flight(2.0)]),
        );
        let silent = ForecastAccount::new(2);
        let methods = [
            (Method::Imm5, &worse),
            (Method::Ekf, &silent),
            (Method::Recursive, &better),
        ];
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
