//! Scores over many steps.

use super::step_score::StepScore;
use serde::Serialize;

/// Sums over steps, in their order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sums {
    steps: u64,
    distance_m: f64,
    nees: f64,
    covered90: u64,
    surprise: f64,
}

/// Means over steps; NaN over none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Means {
    /// Steps.
    pub steps: u64,
    /// Mean distance between estimated and true position, metres.
    pub distance_m: f64,
    /// Mean normalised error squared of the position; three is honest.
    pub nees: f64,
    /// Share of steps whose error lies within the 90% ellipsoid.
    pub coverage90: f64,
    /// Mean of [`StepScore::surprise`], nats.
    pub surprise: f64,
}

impl Sums {
    /// The sums over `scores`.
    pub fn of<'a>(scores: impl IntoIterator<Item = &'a StepScore>) -> Self {
        let mut sums = Self::default();
        for score in scores {
            sums.add(score);
        }
        sums
    }

    /// Adds a step.
    pub fn add(&mut self, score: &StepScore) {
        self.steps += 1;
        self.distance_m += score.error_m;
        self.nees += score.mahalanobis_squared;
        self.covered90 += u64::from(score.covered_90());
        self.surprise += score.surprise();
    }

    /// The sums over the steps of two parts.
    #[must_use]
    pub fn join(self, part: Self) -> Self {
        Self {
            steps: self.steps + part.steps,
            distance_m: self.distance_m + part.distance_m,
            nees: self.nees + part.nees,
            covered90: self.covered90 + part.covered90,
            surprise: self.surprise + part.surprise,
        }
    }

    /// The means.
    #[must_use]
    pub fn means(&self) -> Means {
        let steps = self.steps as f64;
        Means {
            steps: self.steps,
            distance_m: self.distance_m / steps,
            nees: self.nees / steps,
            coverage90: self.covered90 as f64 / steps,
            surprise: self.surprise / steps,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scoring::step_score::SURPRISE_MAX_NATS;

    fn score(error_m: f64, mahalanobis_squared: f64) -> StepScore {
        StepScore {
            error_m,
            mahalanobis_squared,
            // Such that the surprise is half of the squared distance.
            det_p_m6: core::f64::consts::TAU.powi(-3),
        }
    }

    #[test]
    fn four_steps_by_hand_at_once_or_in_parts() {
        let scores = [
            score(1.0, 4.0),
            score(2.0, 6.0),
            score(3.0, 8.0),
            score(10.0, 1e6),
        ];
        let means = Sums::of(&scores).means();
        assert_eq!((means.steps, means.distance_m), (4, 4.0));
        assert_eq!((means.nees, means.coverage90), (250_004.5, 0.5));
        let surprise = (2.0 + 3.0 + 4.0 + SURPRISE_MAX_NATS) / 4.0;
        assert!((means.surprise - surprise).abs() < 1e-12, "{means:?}");
        let parts = Sums::of(&scores[..2]).join(Sums::of(&scores[2..]));
        assert_eq!(parts.means(), means);
    }

    #[test]
    fn what_is_unusable_is_not_hidden() {
        let means = Sums::of(&[score(1.0, 4.0), StepScore::UNUSABLE]).means();
        assert_eq!((means.steps, means.coverage90), (2, 0.5));
        assert!(means.distance_m.is_nan() && means.nees.is_nan());
        assert!((means.surprise - 31.0).abs() < 1e-12);
    }
}
