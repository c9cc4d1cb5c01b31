//! Variances that the curvature of the measurement function adds to its noise.
//!
//! Half the trace of `(Hessian P)^2` per component: the second-order filter's term (Bar-Shalom, Li
//! and Kirubarajan 2001, section 10.3.2). The range-rate's Hessian by position alone is left out:
//! it is smaller by the ratio of the speed to the range.

use super::motion::{Covariance, State};
use super::sight::HORIZONTAL_FLOOR_M2;
use crate::scalar::Scalar;

/// Variances to add to those of elevation [rad^2], azimuth [rad^2], range [m^2] and range-rate
/// [m^2/s^2] at a predicted state.
pub fn curvature<S: Scalar>(state: &State<S>, covariance: &Covariance<S>) -> [S; 4] {
    let (zero, half, two) = (S::constant(0.0), S::constant(0.5), S::constant(2.0));
    let (x, y, z) = (state[0], state[1], state[2]);
    let rho2 = (x * x + y * y).max(S::constant(HORIZONTAL_FLOOR_M2));
    let rho = rho2.sqrt();
    let range2 = rho2 + z * z;
    let range = range2.sqrt();
    let (c, s) = (x / rho, y / rho);
    let (cos_el, sin_el) = (rho / range, z / range);
    let lateral = [-s, c, zero];
    let upward = [-(sin_el * c), -(sin_el * s), cos_el];
    let radial = [c, s, zero];
    let along = [cos_el * c, cos_el * s, sin_el];
    // P_block b for the four blocks' right-hand vectors that occur.
    let times = |i: usize, j: usize, b: &[S; 3]| -> [S; 3] {
        core::array::from_fn(|row| {
            let mut sum = zero;
            for column in 0..3 {
                sum = sum + covariance[i + row][j + column] * b[column];
            }
            sum
        })
    };
    let dot = |a: &[S; 3], b: &[S; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (pl, pu) = (times(0, 0, &lateral), times(0, 0, &upward));
    let (ll, uu, lu) = (dot(&lateral, &pl), dot(&upward, &pu), dot(&lateral, &pu));
    let (rr, rl) = (dot(&radial, &times(0, 0, &radial)), dot(&radial, &pl));
    let (aa, au) = (dot(&along, &times(0, 0, &along)), dot(&along, &pu));
    let (vl, vu) = (times(3, 3, &lateral), times(3, 3, &upward));
    let (vll, vuu, vlu) = (dot(&lateral, &vl), dot(&upward, &vu), dot(&lateral, &vu));
    let (cl, cu) = (times(0, 3, &lateral), times(0, 3, &upward));
    let (cll, cuu) = (dot(&lateral, &cl), dot(&upward, &cu));
    let (clu, cul) = (dot(&lateral, &cu), dot(&upward, &cl));
    let elevation_sway = half * ll * ll * (sin_el * sin_el) / (cos_el * cos_el);
    [
        (aa * uu + au * au + elevation_sway) / (range2 * range2),
        (rr * ll + rl * rl) / (rho2 * rho2),
        half * (ll * ll + uu * uu + two * lu * lu) / range2,
        (ll * vll + uu * vuu + two * lu * vlu + cll * cll + cuu * cuu + two * clu * cul) / range2,
    ]
}
