//! The position that a tracker's estimate says, in double precision.

use bnkf::Estimate;
use nalgebra::{Matrix3, Vector3};

/// Position, m, and its covariance, m^2.
pub fn position(estimate: &Estimate) -> (Vector3<f64>, Matrix3<f64>) {
    let covariance = &estimate.covariance_m2;
    (
        Vector3::from(estimate.position_m).map(f64::from),
        Matrix3::from_fn(|row, column| f64::from(covariance[row][column])),
    )
}
