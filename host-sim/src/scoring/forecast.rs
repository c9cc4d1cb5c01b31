//! Scores of forecasts: one method, one condition, one horizon.

use bnkf_model_export::scoring::means::Sums;
use bnkf_model_export::scoring::step_score::StepScore;
use serde::{Deserialize, Serialize};

use crate::filter::HORIZONS_US;
use crate::method::Method;
use crate::scenario::radar::Condition;

/// A scored forecast.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScoredForecast {
    /// Which of [`HORIZONS_US`] it looked ahead.
    pub horizon: usize,
    /// Its scores beside the truth of then.
    pub score: StepScore,
    /// There was no usable forecast; the scores are those of the last usable estimate.
    pub diverged: bool,
}

/// One method's forecasts of one horizon.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ForecastCell {
    /// The method.
    pub method: Method,
    /// The condition: noise table, noise level, sampling rate.
    #[serde(flatten)]
    pub condition: Condition,
    /// How far ahead, s.
    pub horizon_s: f64,
    /// What they were worth.
    #[serde(flatten)]
    pub metrics: ForecastMetrics,
}

/// Metrics over all forecasts, divergences included. Values over none are NaN, `null` in JSON.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ForecastMetrics {
    /// Number of forecasts.
    pub forecasts: u64,
    /// Mean Euclidean distance, metres.
    pub ed_mean_m: f64,
    /// Mean squared Mahalanobis distance (ideal 3).
    pub nees_mean: f64,
    /// Fraction with the truth inside the 90% ellipsoid (ideal 0.9).
    pub coverage90: f64,
    /// Mean negative log-likelihood of the truth, nats, see [`StepScore::surprise`].
    pub nll: f64,
    /// Forecasts that were refused or unusable.
    pub diverged: u64,
}

/// Forecasts of every horizon under construction, which take one after another.
#[derive(Clone, Debug, Default)]
pub struct ForecastSums([(Sums, u64); HORIZONS_US.len()]);

impl ForecastSums {
    /// Adds a forecast.
    pub fn add(&mut self, forecast: &ScoredForecast) {
        let (sums, diverged) = &mut self.0[forecast.horizon];
        sums.add(&forecast.score);
        *diverged += u64::from(forecast.diverged);
    }

    /// A cell for every horizon.
    pub fn cells(&self, method: Method, condition: Condition) -> [ForecastCell; HORIZONS_US.len()] {
        core::array::from_fn(|horizon| {
            let (sums, diverged) = self.0[horizon];
            let means = sums.means();
            ForecastCell {
                method,
                condition,
                horizon_s: 1e-6 * HORIZONS_US[horizon] as f64,
                metrics: ForecastMetrics {
                    forecasts: means.steps,
                    ed_mean_m: means.distance_m,
                    nees_mean: means.nees,
                    coverage90: means.coverage90,
                    nll: means.surprise,
                    diverged,
                },
            }
        })
    }
}

impl ForecastCell {
    /// A cell for every horizon of `forecasts`, summed up in their order.
    pub fn all(
        method: Method,
        condition: Condition,
        forecasts: &[&ScoredForecast],
    ) -> [Self; HORIZONS_US.len()] {
        let mut sums = ForecastSums::default();
        for forecast in forecasts {
            sums.add(forecast);
        }
        sums.cells(method, condition)
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};

    use super::*;

    #[test]
    fn horizons_are_kept_apart() {
        let forecast = |horizon, error_m: f64, diverged| ScoredForecast {
            horizon,
            score: StepScore {
                error_m,
                mahalanobis_squared: error_m * error_m,
                det_p_m6: 1.0,
            },
            diverged,
        };
        let all = [
            forecast(0, 1.0, false),
            forecast(1, 2.0, true),
            forecast(0, 3.0, false),
        ];
        let condition = Condition {
            table: NoiseTable::Radians,
            noise: NoiseLevel::Low,
            rate: SamplingRate::FULL,
        };
        let all: Vec<_> = all.iter().collect();
        let [near, middle, far] = ForecastCell::all(Method::Imm5, condition, &all);
        assert_eq!((near.horizon_s, far.horizon_s), (0.5, 2.0));
        let m = near.metrics;
        assert_eq!((m.forecasts, m.ed_mean_m, m.nees_mean), (2, 2.0, 5.0));
        // 1 lies within 6.25, 9 does not.
        assert_eq!((m.coverage90, m.diverged), (0.5, 0));
        assert_eq!(
            (middle.metrics.ed_mean_m, middle.metrics.diverged),
            (2.0, 1)
        );
        assert!(far.metrics.forecasts == 0 && far.metrics.ed_mean_m.is_nan());
        let json = serde_json::to_value(far).unwrap();
        assert!(json["ed_mean_m"].is_null() && json["horizon_s"] == 2.0);
    }
}
