//! Variances that the curvature of the measurement function adds to its noise.
//!
//! Half the trace of `(Hessian P)^2` per component: the second-order filter's term (Bar-Shalom, Li
//! and Kirubarajan 2001, section 10.3.2). The range-rate's Hessian by position alone is left out:
//! it is smaller by the ratio of the speed to the range.

use super::motion::{Covariance, State};
use crate::kernel::sqrt;

/// Squared horizontal distance, m^2, that the terms are bounded at.
const HORIZONTAL_FLOOR_M2: f32 = 1e-4;

/// Variances to add to those of elevation [rad^2], azimuth [rad^2], range [m^2] and range-rate
/// [m^2/s^2] at a predicted state.
pub fn curvature(state: &State, covariance: &Covariance) -> [f32; 4] {
    let (x, y, z) = (state[0], state[1], state[2]);
    let squared = x * x + y * y;
    let rho2 = if squared > HORIZONTAL_FLOOR_M2 {
        squared
    } else {
        HORIZONTAL_FLOOR_M2
    };
    let rho = sqrt(rho2);
    let range2 = rho2 + z * z;
    let range = sqrt(range2);
    let (c, s) = (x / rho, y / rho);
    let (cos_el, sin_el) = (rho / range, z / range);
    let lateral = [-s, c, 0.0];
    let upward = [-(sin_el * c), -(sin_el * s), cos_el];
    let radial = [c, s, 0.0];
    let along = [cos_el * c, cos_el * s, sin_el];
    // P_block b for the four blocks' right-hand vectors that occur.
    let times = |i: usize, j: usize, b: &[f32; 3]| -> [f32; 3] {
        core::array::from_fn(|row| {
            let mut sum = 0.0;
            for column in 0..3 {
                sum += covariance[(i + row, j + column)] * b[column];
            }
            sum
        })
    };
    let dot = |a: &[f32; 3], b: &[f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (pl, pu) = (times(0, 0, &lateral), times(0, 0, &upward));
    let (ll, uu, lu) = (dot(&lateral, &pl), dot(&upward, &pu), dot(&lateral, &pu));
    let (rr, rl) = (dot(&radial, &times(0, 0, &radial)), dot(&radial, &pl));
    let (aa, au) = (dot(&along, &times(0, 0, &along)), dot(&along, &pu));
    let (vl, vu) = (times(3, 3, &lateral), times(3, 3, &upward));
    let (vll, vuu, vlu) = (dot(&lateral, &vl), dot(&upward, &vu), dot(&lateral, &vu));
    let (cl, cu) = (times(0, 3, &lateral), times(0, 3, &upward));
    let (cll, cuu) = (dot(&lateral, &cl), dot(&upward, &cu));
    let (clu, cul) = (dot(&lateral, &cu), dot(&upward, &cl));
    let elevation_sway = 0.5 * ll * ll * (sin_el * sin_el) / (cos_el * cos_el);
    [
        (aa * uu + au * au + elevation_sway) / (range2 * range2),
        (rr * ll + rl * rl) / (rho2 * rho2),
        0.5 * (ll * ll + uu * uu + 2.0 * lu * lu) / range2,
        (ll * vll + uu * vuu + 2.0 * lu * vlu + cll * cll + cuu * cuu + 2.0 * clu * cul) / range2,
    ]
}
