//! What one estimate is worth beside the truth: distance, consistency, size of the covariance.

use nalgebra::{Cholesky, Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// 90% quantile of chi-square for three degrees of freedom: a covariance is honest if 90% of the
/// squared Mahalanobis distances lie below it.
pub const QUANTILE_90_DOF_3: f64 = 6.251_388_631_170_325;

/// What a step counts at most by [`StepScore::surprise`]: far from every truth the Gaussian of an
/// estimate says nothing but that it is wrong.
pub const SURPRISE_MAX_NATS: f64 = 60.0;

/// Scores of one estimate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepScore {
    /// Euclidean distance to the truth (ED), metres.
    pub error_m: f64,
    /// Squared Mahalanobis distance `D^2 = e' P^-1 e`; chi-square with 3 degrees of freedom, mean 3,
    /// if the covariance is right.
    pub mahalanobis_squared: f64,
    /// Determinant of the position covariance, m^6.
    pub det_p_m6: f64,
}

/// Why an estimate cannot be scored. The run counts it as a divergence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unusable {
    /// A coordinate is NaN or infinite, or so large that its square is.
    #[error("the position is not finite")]
    Position,
    /// An element is NaN or infinite.
    #[error("the covariance is not finite")]
    Covariance,
    /// The Cholesky factorisation or the determinant failed.
    #[error("the covariance is not positive definite")]
    NotPositiveDefinite,
}

impl StepScore {
    /// What an estimate without a score counts: no numbers, so that no mean hides it.
    pub const UNUSABLE: Self = Self {
        error_m: f64::NAN,
        mahalanobis_squared: f64::NAN,
        det_p_m6: f64::NAN,
    };

    /// Scores `position_m` and its `covariance_m2` against `truth_m`, all in one frame.
    ///
    /// # Errors
    /// If no finite score exists.
    pub fn new(
        position_m: &Vector3<f64>,
        covariance_m2: &Matrix3<f64>,
        truth_m: &Vector3<f64>,
    ) -> Result<Self, Unusable> {
        let error = position_m - truth_m;
        let error_m = error.norm();
        if !error_m.is_finite() {
            return Err(Unusable::Position);
        }
        if !covariance_m2.iter().all(|element| element.is_finite()) {
            return Err(Unusable::Covariance);
        }
        let factor = Cholesky::new(*covariance_m2).ok_or(Unusable::NotPositiveDefinite)?;
        let whitened = factor
            .l()
            .solve_lower_triangular(&error)
            .ok_or(Unusable::NotPositiveDefinite)?;
        let mahalanobis_squared = whitened.norm_squared();
        let det_p_m6 = factor.determinant();
        if !(mahalanobis_squared.is_finite() && det_p_m6.is_finite() && det_p_m6 > 0.0) {
            return Err(Unusable::NotPositiveDefinite);
        }
        Ok(Self {
            error_m,
            mahalanobis_squared,
            det_p_m6,
        })
    }

    /// Mahalanobis distance D; its mean is `2 sqrt(2 / pi) = 1.596` if the covariance is right.
    pub fn mahalanobis(&self) -> f64 {
        self.mahalanobis_squared.sqrt()
    }

    /// Whether the truth lies inside the 90% ellipsoid of the estimate.
    pub fn covered_90(&self) -> bool {
        self.mahalanobis_squared <= QUANTILE_90_DOF_3
    }

    /// Negative log-likelihood of the truth under the estimate's Gaussian, nats.
    pub fn negative_log_likelihood(&self) -> f64 {
        0.5 * (self.mahalanobis_squared + self.det_p_m6.ln() + 3.0 * core::f64::consts::TAU.ln())
    }

    /// Negative log-likelihood of the truth, nats, at most [`SURPRISE_MAX_NATS`]; that much too where
    /// there is none.
    pub fn surprise(&self) -> f64 {
        let nats = self.negative_log_likelihood();
        if nats < SURPRISE_MAX_NATS {
            nats
        } else {
            SURPRISE_MAX_NATS
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};

    use super::{SURPRISE_MAX_NATS, StepScore, Unusable};
    use crate::recursive::step::position_surprise;

    #[test]
    fn a_diagonal_covariance_by_hand() {
        let score = StepScore::new(
            &Vector3::new(4.0, 2.0, 7.0),
            &Matrix3::from_diagonal(&Vector3::new(4.0, 1.0, 9.0)),
            &Vector3::new(2.0, 4.0, 4.0),
        )
        .unwrap();
        assert!((score.error_m - 17.0_f64.sqrt()).abs() < 1e-15);
        // 2^2 / 4 + 2^2 / 1 + 3^2 / 9
        assert!((score.mahalanobis_squared - 6.0).abs() < 1e-14);
        assert!((score.mahalanobis() - 6.0_f64.sqrt()).abs() < 1e-14);
        assert!((score.det_p_m6 - 36.0).abs() < 1e-12);
        assert!(score.covered_90());
    }

    #[test]
    fn a_correlated_covariance_by_hand() {
        // Inverse of [[2, 1], [1, 2]] is [[2, -1], [-1, 2]] / 3, its determinant 3.
        let covariance = Matrix3::new(2.0, 1.0, 0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 0.25);
        let score = StepScore::new(
            &Vector3::new(1.0, -2.0, 0.5),
            &covariance,
            &Vector3::zeros(),
        )
        .unwrap();
        // (2 * 1 + 2 * 2 + 2 * 4) / 3 + 0.25 / 0.25
        assert!((score.mahalanobis_squared - (14.0 / 3.0 + 1.0)).abs() < 1e-14);
        assert!((score.det_p_m6 - 0.75).abs() < 1e-14);
    }

    #[test]
    fn the_likelihood_is_what_the_training_minimises() {
        let covariance = Matrix3::new(2.0, 0.7, -0.3, 0.7, 1.5, 0.2, -0.3, 0.2, 0.4);
        let (position, truth) = (Vector3::new(4.0, 2.0, 7.0), Vector3::new(3.0, 4.0, 7.1));
        let score = StepScore::new(&position, &covariance, &truth).unwrap();
        let (mut state, mut full) = ([0.0; 9], [[0.0; 9]; 9]);
        for row in 0..3 {
            state[row] = position[row];
            for column in 0..3 {
                full[row][column] = covariance[(row, column)];
            }
        }
        let taught = position_surprise(&state, &full, truth.into());
        let nats = score.negative_log_likelihood();
        assert!((nats / taught - 1.0).abs() < 1e-13, "{nats} {taught}");
        assert_eq!(score.surprise(), nats);
    }

    #[test]
    fn a_surprise_has_a_limit() {
        let at = |error_m: f64| {
            let position = Vector3::new(error_m, 0.0, 0.0);
            StepScore::new(&position, &Matrix3::identity(), &Vector3::zeros()).unwrap()
        };
        // 1.5 ln(2 pi) is 2.7568.
        assert!((at(0.0).surprise() - 2.756_815_599_614_018).abs() < 1e-14);
        assert!(at(10.6).surprise() < SURPRISE_MAX_NATS);
        assert_eq!(at(10.7).surprise(), SURPRISE_MAX_NATS);
        assert!(at(10.7).negative_log_likelihood() > SURPRISE_MAX_NATS);
        assert_eq!(StepScore::UNUSABLE.surprise(), SURPRISE_MAX_NATS);
        assert!(!StepScore::UNUSABLE.covered_90());
    }

    #[test]
    fn the_edge_of_the_ellipsoid_counts_as_inside() {
        let at = |d2: f64| {
            StepScore::new(
                &Vector3::new(d2.sqrt(), 0.0, 0.0),
                &Matrix3::identity(),
                &Vector3::zeros(),
            )
            .unwrap()
            .covered_90()
        };
        assert!(at(6.2513));
        assert!(!at(6.2514));
    }

    #[test]
    fn what_has_no_score_is_named() {
        let zero = Vector3::zeros();
        let unit = Matrix3::identity();
        let nan = Vector3::new(0.0, f64::NAN, 0.0);
        assert_eq!(StepScore::new(&nan, &unit, &zero), Err(Unusable::Position));
        let huge = Vector3::new(1e200, 0.0, 0.0);
        assert_eq!(StepScore::new(&huge, &unit, &zero), Err(Unusable::Position));
        let infinite = unit * f64::INFINITY;
        assert_eq!(
            StepScore::new(&zero, &infinite, &zero),
            Err(Unusable::Covariance)
        );
        let flat = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.0));
        assert_eq!(
            StepScore::new(&zero, &flat, &zero),
            Err(Unusable::NotPositiveDefinite)
        );
        // Its determinant underflows, and the logarithm of that is no likelihood.
        let tiny = unit * 1e-110;
        assert_eq!(
            StepScore::new(&zero, &tiny, &zero),
            Err(Unusable::NotPositiveDefinite)
        );
        let indefinite = Matrix3::new(1.0, 2.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        assert_eq!(
            StepScore::new(&zero, &indefinite, &zero),
            Err(Unusable::NotPositiveDefinite)
        );
    }
}
