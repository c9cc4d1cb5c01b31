//! A filter's belief: mean and covariance of an N-dimensional state.

use nalgebra::{SMatrix, SVector, Vector3};

use super::discrete::Discrete;
use crate::filter::{FilterError, Nis, PositionEstimate};

/// Mean and covariance of a state whose first six entries are position (m) and velocity (m/s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian<const N: usize> {
    /// Mean.
    pub mean: SVector<f64, N>,
    /// Covariance, symmetric.
    pub covariance: SMatrix<f64, N, N>,
}

impl<const N: usize> Gaussian<N> {
    /// Mean position, m.
    pub fn position_m(&self) -> Vector3<f64> {
        self.mean.fixed_rows::<3>(0).into_owned()
    }

    /// Mean velocity, m/s.
    pub fn velocity_mps(&self) -> Vector3<f64> {
        self.mean.fixed_rows::<3>(3).into_owned()
    }

    /// The belief one `step` later.
    #[must_use]
    pub fn predicted(&self, step: &Discrete<N>) -> Self {
        let f = &step.transition;
        Self {
            mean: f * self.mean,
            covariance: symmetric(&(f * self.covariance * f.transpose() + step.noise)),
        }
    }

    /// The position part.
    ///
    /// # Errors
    /// The mean or the covariance is not finite.
    pub fn position_estimate(&self, nis: Option<Nis>) -> Result<PositionEstimate, FilterError> {
        let finite = |x: &f64| x.is_finite();
        if !self.mean.iter().all(finite) || !self.covariance.iter().all(finite) {
            return Err(FilterError::NotFinite);
        }
        let covariance_m2 = self.covariance.fixed_view::<3, 3>(0, 0).into_owned();
        Ok(PositionEstimate {
            nis,
            ..PositionEstimate::new(self.position_m(), covariance_m2)
        })
    }
}

/// The mean of a matrix and its transpose: rounding leaves products slightly asymmetric, and
/// nothing in a filter's recursion damps that.
pub fn symmetric<const N: usize>(m: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    (m + m.transpose()) * 0.5
}
