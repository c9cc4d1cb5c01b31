//! The scores of one method at one noise level, and which estimates they leave out.

use bnkf_model_export::scoring::step_score::StepScore;
use serde::{Deserialize, Serialize};

use super::departure::Departure;
use super::recipe::Recipe;
use crate::scoring::median::median;

/// Limits above which the published code leaves an estimate out: error, D and det P.
const ERROR_MAX_M: f64 = 1000.0;
const DISTANCE_MAX: f64 = 10_000.0;
const DETERMINANT_MAX_M6: f64 = 100_000.0;

/// Scores of the estimates of one method, as they come.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    scores: Vec<StepScore>,
    dropped: usize,
    unusable: usize,
}

/// What the scores come to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Estimates that count.
    pub scored: usize,
    /// Estimates left out as outliers.
    pub dropped: usize,
    /// Steps without a usable estimate or covariance; they do not count.
    pub unusable: usize,
    /// Mean distance to the truth (ED), metres.
    pub error_m: f64,
    /// Mean Mahalanobis distance D; 1.596 if the covariance is right.
    pub distance: f64,
    /// Mean of its square D^2; 3 if the covariance is right.
    pub distance_squared: f64,
    /// Mean det P, m^6.
    pub det_p_mean_m6: f64,
    /// Median det P, m^6.
    pub det_p_median_m6: f64,
}

impl Tally {
    /// Takes one estimate's score, `None` if it has none.
    pub fn add(&mut self, score: Option<StepScore>, recipe: &Recipe) {
        match score {
            None => self.unusable += 1,
            Some(score) if recipe.departs(Departure::OutliersDropped) && is_outlier(&score) => {
                self.dropped += 1;
            }
            Some(score) => self.scores.push(score),
        }
    }

    /// Adds the estimates of another tally.
    pub fn append(&mut self, mut other: Self) {
        self.scores.append(&mut other.scores);
        self.dropped += other.dropped;
        self.unusable += other.unusable;
    }

    /// Means and the median; zero where nothing counts.
    pub fn summary(&self) -> Summary {
        let mean = |value: fn(&StepScore) -> f64| {
            // Not `sum`: of nothing it is -0.
            let sum = self.scores.iter().map(value).fold(0.0, |sum, x| sum + x);
            sum / self.scores.len().max(1) as f64
        };
        let determinants: Vec<f64> = self.scores.iter().map(|score| score.det_p_m6).collect();
        Summary {
            scored: self.scores.len(),
            dropped: self.dropped,
            unusable: self.unusable,
            error_m: mean(|score| score.error_m),
            distance: mean(StepScore::mahalanobis),
            distance_squared: mean(|score| score.mahalanobis_squared),
            det_p_mean_m6: mean(|score| score.det_p_m6),
            det_p_median_m6: if determinants.is_empty() {
                0.0
            } else {
                median(&[&determinants])
            },
        }
    }
}

fn is_outlier(score: &StepScore) -> bool {
    score.error_m > ERROR_MAX_M
        || score.mahalanobis() > DISTANCE_MAX
        || score.det_p_m6 > DETERMINANT_MAX_M6
}

#[cfg(test)]
mod tests {
    use super::{Recipe, StepScore, Tally};

    fn score(error_m: f64, distance: f64, det_p_m6: f64) -> StepScore {
        StepScore {
            error_m,
            mahalanobis_squared: distance * distance,
            det_p_m6,
        }
    }

    #[test]
    fn exactly_what_passes_a_limit_is_dropped_and_only_if_asked() {
        let kept = [
            score(1000.0, 1.0, 1.0),
            score(1.0, 10_000.0, 1.0),
            score(1.0, 1.0, 100_000.0),
        ];
        let outliers = [
            score(1000.1, 1.0, 1.0),
            score(1.0, 10_001.0, 1.0),
            score(1.0, 1.0, 100_000.1),
        ];
        for (recipe, scored, dropped) in [(Recipe::PAPER, 6, 0), (Recipe::REFERENCE_CODE, 3, 3)] {
            let mut tally = Tally::default();
            for score in kept.iter().chain(&outliers) {
                tally.add(Some(*score), &recipe);
            }
            tally.add(None, &recipe);
            let summary = tally.summary();
            assert_eq!((summary.scored, summary.dropped), (scored, dropped));
            assert_eq!(summary.unusable, 1);
        }
    }

    #[test]
    fn means_and_median_by_hand() {
        let (mut one, mut two) = (Tally::default(), Tally::default());
        one.add(Some(score(1.0, 2.0, 9.0)), &Recipe::PAPER);
        two.add(Some(score(3.0, 4.0, 1.0)), &Recipe::PAPER);
        two.add(Some(score(5.0, 0.0, 2.0)), &Recipe::PAPER);
        one.append(two);
        let summary = one.summary();
        assert_eq!((summary.error_m, summary.distance), (3.0, 2.0));
        assert!((summary.distance_squared - 20.0 / 3.0).abs() < 1e-12);
        assert_eq!((summary.det_p_mean_m6, summary.det_p_median_m6), (4.0, 2.0));
        assert!(Tally::default().summary().error_m.is_sign_positive());
    }
}
