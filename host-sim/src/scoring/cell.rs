//! One cell of the table: every scored step of one method at one noise level and one rate.

use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::NoiseLevel;
use bnkf_model_export::scoring::means::Sums;
use bnkf_model_export::scoring::step_score::StepScore;
use serde::{Deserialize, Serialize};

use crate::filter::Fate;
use crate::method::Method;
use crate::scoring::binned::BinSums;
use crate::scoring::median::median;

/// A cell with its place in the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cell {
    /// Row.
    pub method: Method,
    /// Noise level of the readings.
    pub noise: NoiseLevel,
    /// Part of the samples that were measured.
    pub rate: SamplingRate,
    /// What was measured.
    #[serde(flatten)]
    pub metrics: CellMetrics,
    /// The steps by the target's true speed and acceleration.
    pub bins: Vec<BinSums>,
}

/// A scored step and how it came about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScoredStep {
    /// The scores; those of the held estimate if the step diverged.
    pub score: StepScore,
    /// The filter refused the step or its estimate was unusable.
    pub diverged: bool,
    /// What became of its reading; `None` without one and for methods without a gate.
    pub fate: Option<Fate>,
    /// The flight was not tracked at this step; see [`crate::contest::loss`].
    pub not_tracked: bool,
    /// The method answered, and said that it was not trained for this.
    pub outside: bool,
}

impl ScoredStep {
    /// A usable step of a method without a gate.
    pub fn tracked(score: StepScore) -> Self {
        Self {
            score,
            diverged: false,
            fate: None,
            not_tracked: false,
            outside: false,
        }
    }
}

/// Metrics over all scored steps, divergences included: nothing is dropped.
///
/// Values over no steps are NaN, written as `null` in JSON.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellMetrics {
    /// Number of scored steps.
    pub steps: u64,
    /// Mean Euclidean distance, metres.
    pub ed_mean_m: f64,
    /// Median Euclidean distance, metres.
    pub ed_median_m: f64,
    /// Mean Mahalanobis distance D (ideal 1.596).
    pub d_mean: f64,
    /// Mean squared Mahalanobis distance D^2 (ideal 3).
    pub nees_mean: f64,
    /// Fraction of steps with the truth inside the 90% ellipsoid (ideal 0.9).
    pub coverage90: f64,
    /// Mean negative log-likelihood of the truth, nats; each step counts as
    /// [`StepScore::surprise`] has it.
    pub nll: f64,
    /// Median determinant of the position covariance, m^6.
    pub det_p_median_m6: f64,
    /// Steps whose estimate was refused or unusable.
    pub diverged: u64,
    /// Readings that the method's gate rejected.
    pub rejected: u64,
    /// Readings with which another track took over or the method started anew.
    pub restarted: u64,
    /// Steps at which the flight was not tracked: divergences, and steps after mostly rejections
    /// and restarts.
    pub not_tracked: u64,
    /// Steps outside what the method was trained for, by its own word; of methods that do not know none.
    pub outside: u64,
}

impl CellMetrics {
    /// Whether any step was tracked; else the numbers are those of an estimate that was held.
    pub fn is_tracked(&self) -> bool {
        self.not_tracked < self.steps
    }
}

/// Sums and counts over steps, which take one after another: all of a cell but the medians.
#[derive(Clone, Copy, Debug, Default)]
pub struct CellTotals {
    sums: Sums,
    /// Sum of the Mahalanobis distances.
    distance: f64,
    diverged: u64,
    rejected: u64,
    restarted: u64,
    not_tracked: u64,
    outside: u64,
}

/// A cell under construction.
#[derive(Clone, Debug, Default)]
pub struct CellSums {
    totals: CellTotals,
    values: Values,
}

/// Values of steps whose medians are wanted.
#[derive(Clone, Debug, Default)]
pub struct Values {
    error_m: Vec<f64>,
    det_p_m6: Vec<f64>,
}

impl CellMetrics {
    /// Sums up `steps` in their order, so that equal steps give equal bits.
    pub fn new(steps: &[ScoredStep]) -> Self {
        let mut sums = CellSums::default();
        for step in steps {
            sums.add(step);
        }
        sums.metrics()
    }
}

impl Values {
    /// Adds a step.
    pub fn add(&mut self, score: &StepScore) {
        self.error_m.push(score.error_m);
        self.det_p_m6.push(score.det_p_m6);
    }
}

impl CellTotals {
    /// Adds a step.
    pub fn add(&mut self, step: &ScoredStep) {
        self.sums.add(&step.score);
        self.distance += step.score.mahalanobis();
        self.diverged += u64::from(step.diverged);
        self.rejected += u64::from(step.fate == Some(Fate::Rejected));
        self.restarted += u64::from(step.fate == Some(Fate::Restarted));
        self.not_tracked += u64::from(step.not_tracked);
        self.outside += u64::from(step.outside);
    }

    /// What the steps come to; `values` are theirs, in parts.
    pub fn metrics(&self, values: &[&Values]) -> CellMetrics {
        let means = self.sums.means();
        let of = |value: fn(&Values) -> &[f64]| {
            let parts: Vec<_> = values.iter().map(|part| value(part)).collect();
            median(&parts)
        };
        CellMetrics {
            steps: means.steps,
            ed_mean_m: means.distance_m,
            ed_median_m: of(|values| &values.error_m),
            d_mean: self.distance / means.steps as f64,
            nees_mean: means.nees,
            coverage90: means.coverage90,
            nll: means.surprise,
            det_p_median_m6: of(|values| &values.det_p_m6),
            diverged: self.diverged,
            rejected: self.rejected,
            restarted: self.restarted,
            not_tracked: self.not_tracked,
            outside: self.outside,
        }
    }
}

impl CellSums {
    /// Adds a step.
    pub fn add(&mut self, step: &ScoredStep) {
        self.totals.add(step);
        self.values.add(&step.score);
    }

    /// What the steps so far come to.
    pub fn metrics(&self) -> CellMetrics {
        self.totals.metrics(&[&self.values])
    }

    /// The values of its steps.
    pub fn values(&self) -> &Values {
        &self.values
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::scoring::step_score::StepScore;
    use nalgebra::{Cholesky, Matrix3, Vector3};
    use rand_core::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::{CellMetrics, ScoredStep};
    use crate::filter::Fate;

    fn step(error_m: f64, mahalanobis_squared: f64, det_p_m6: f64, diverged: bool) -> ScoredStep {
        let score = StepScore {
            error_m,
            mahalanobis_squared,
            det_p_m6,
        };
        ScoredStep {
            diverged,
            not_tracked: diverged,
            ..ScoredStep::tracked(score)
        }
    }

    #[test]
    fn rejections_restarts_and_losses_are_counted_apart() {
        let gated = |fate, not_tracked| ScoredStep {
            fate,
            not_tracked,
            ..step(1.0, 3.0, 1.0, false)
        };
        let cell = CellMetrics::new(&[
            gated(Some(Fate::Used), false),
            gated(Some(Fate::Rejected), true),
            gated(Some(Fate::Restarted), true),
            gated(Some(Fate::Rejected), false),
            ScoredStep {
                outside: true,
                ..gated(None, true)
            },
        ]);
        let counts = [
            cell.diverged,
            cell.rejected,
            cell.restarted,
            cell.not_tracked,
            cell.outside,
        ];
        assert_eq!(counts, [0, 2, 1, 3, 1]);
    }

    #[test]
    fn four_steps_by_hand() {
        let cell = CellMetrics::new(&[
            step(1.0, 4.0, 2.0, false),
            step(2.0, 1.0, 8.0, false),
            step(3.0, 9.0, 1.0, true),
            step(10.0, 0.25, 4.0, false),
        ]);
        assert_eq!(cell.steps, 4);
        assert_eq!(cell.ed_mean_m, 4.0);
        assert_eq!(cell.ed_median_m, 2.5);
        assert_eq!(cell.d_mean, (2.0 + 1.0 + 3.0 + 0.5) / 4.0);
        assert_eq!(cell.nees_mean, 14.25 / 4.0);
        assert_eq!(cell.coverage90, 0.75);
        assert_eq!(cell.det_p_median_m6, 3.0);
        // Half of D^2 + ln det P (on average ln 2^6 / 4) + 3 ln(2 pi).
        let nll = 0.5 * (14.25 / 4.0 + 64_f64.ln() / 4.0 + 3.0 * std::f64::consts::TAU.ln());
        assert!((cell.nll - nll).abs() < 1e-14, "{}", cell.nll);
        assert_eq!((cell.diverged, cell.not_tracked), (1, 1));
    }

    #[test]
    fn no_steps_have_no_mean() {
        let cell = CellMetrics::new(&[]);
        assert_eq!(cell.steps, 0);
        assert!(cell.nll.is_nan() && cell.ed_mean_m.is_nan() && cell.ed_median_m.is_nan());
        let json = serde_json::to_value(cell).unwrap();
        assert!(json["nees_mean"].is_null());
    }

    /// Standard normal by Box-Muller.
    fn normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
        let unit = |bits: u64| ((bits >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
        let (u, v) = (unit(rng.next_u64()), unit(rng.next_u64()));
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    /// A linear Gaussian measurement update is exact, so its estimates must score as ideal:
    /// 60,000 draws give standard errors .010 (NEES), .0027 (D) and .0012 (coverage); allow four.
    #[test]
    fn an_exact_filter_scores_as_ideal() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(20_260_101);
        let prior = Matrix3::new(4.0, 1.2, -0.5, 1.2, 2.0, 0.3, -0.5, 0.3, 1.0);
        let noise = Matrix3::new(1.0, 0.4, 0.0, 0.4, 3.0, 0.2, 0.0, 0.2, 0.5);
        let prior_root = Cholesky::new(prior).unwrap().l();
        let noise_root = Cholesky::new(noise).unwrap().l();
        let gain = prior * (prior + noise).try_inverse().unwrap();
        let posterior = (Matrix3::identity() - gain) * prior;
        let steps: Vec<_> = (0..60_000)
            .map(|_| {
                let mut draw = || Vector3::from_fn(|_, _| normal(&mut rng));
                let truth = prior_root * draw();
                let estimate = gain * (truth + noise_root * draw());
                let score = StepScore::new(&estimate, &posterior, &truth).unwrap();
                ScoredStep::tracked(score)
            })
            .collect();
        let cell = CellMetrics::new(&steps);
        assert!((cell.nees_mean - 3.0).abs() < 0.04, "{}", cell.nees_mean);
        assert!((cell.d_mean - 1.595_77).abs() < 0.011, "{}", cell.d_mean);
        assert!((cell.coverage90 - 0.9).abs() < 0.005, "{}", cell.coverage90);
        let det = posterior.determinant();
        assert!((cell.det_p_median_m6 / det - 1.0).abs() < 1e-12);
        // The entropy of the posterior; the scores' deviation is sqrt(3/2), four of 60,000 are .02.
        let entropy = 0.5 * (3.0 + det.ln() + 3.0 * std::f64::consts::TAU.ln());
        assert!((cell.nll - entropy).abs() < 0.02, "{}", cell.nll);
    }
}
