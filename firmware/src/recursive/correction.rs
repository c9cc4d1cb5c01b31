//! The correction of a predicted state with a measurement, and the gate before it.

use super::curvature::curvature;
use super::motion::{Covariance, State};
use crate::ekf::{Corrected, correct_polar};
use crate::measurement::Vectors;
use crate::scalar::Scalar;

/// Normalised innovation squared (four degrees of freedom) beyond which a measurement is not used:
/// eight standard deviations. Chance (chi-square) would pass 40 once in 20 million; the rest is room
/// for jumps of real targets, which a tighter gate makes the filter lose.
pub const GATE_NIS: f64 = 64.0;

/// Corrects with what was measured of elevation, azimuth, range and range-rate; `scale`
/// multiplies their variances (angles, range, range-rate), and the curvature adds to them. Also
/// returns the whitened innovations (see [`correct_polar`]). Nothing is gated or checked.
pub fn correct<S: Scalar>(
    state: &State<S>,
    covariance: &Covariance<S>,
    vectors: &Vectors<S>,
    scale: [S; 3],
) -> (Corrected<S, 9>, [S; 4]) {
    let curvature = curvature(state, covariance);
    let [angles, range, range_rate] = scale;
    let scale = [angles, angles, range, range_rate];
    let variances =
        core::array::from_fn(|i| vectors.sigmas[i] * vectors.sigmas[i] * scale[i] + curvature[i]);
    correct_polar(state, covariance, vectors, &variances)
}
