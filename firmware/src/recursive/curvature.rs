//! Variances that the curvature of the measurement function adds to its noise.
//!
//! Half the trace of `(Hessian P)^2` per component: the second-order filter's term (Bar-Shalom, Li
//! and Kirubarajan 2001, section 10.3.2). The range-rate's Hessian by position alone is left out:
//! it is smaller by the ratio of the speed to the range.

use super::state::{Covariance, State};
use crate::radar::HORIZONTAL_FLOOR_M2;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::predict;

    const STATE_AT: [f64; 9] = [12.0, -21.0, 9.0, 1.5, -0.7, 0.4, 0.3, 0.2, -0.1];

    fn expected(state: &[f64; 9]) -> [f64; 4] {
        predict(
            [state[0], state[1], state[2]],
            [state[3], state[4], state[5]],
        )
        .measurement
    }

    #[test]
    fn curvature_equals_the_numerical_hessian() {
        // The covariance is isotropic here so that the neglected cross terms vanish.
        let mut isotropic = [[0.0; 9]; 9];
        for i in 0..6 {
            isotropic[i][i] = if i < 3 { 0.8 } else { 0.5 };
        }
        let got = curvature(&STATE_AT, &isotropic);
        let h = 1e-3;
        for i in 0..4 {
            let mut product = [[0.0; 6]; 6];
            for a in 0..6 {
                for b in 0..6 {
                    let at = |p: f64, q: f64| {
                        let mut state = STATE_AT;
                        state[a] += p * h;
                        state[b] += q * h;
                        expected(&state)[i]
                    };
                    let hessian = (at(1.0, 1.0) - at(1.0, -1.0) - at(-1.0, 1.0) + at(-1.0, -1.0))
                        / (4.0 * h * h);
                    product[a][b] = hessian * isotropic[b][b];
                }
            }
            let mut trace = 0.0;
            for a in 0..6 {
                for b in 0..6 {
                    trace += 0.5 * product[a][b] * product[b][a];
                }
            }
            // The range-rate's Hessian by position is left out: a few per cent here.
            let tolerance = if i == 3 { 0.05 } else { 1e-4 };
            assert!(
                (got[i] / trace - 1.0).abs() < tolerance,
                "{i}: {} {trace}",
                got[i]
            );
        }
    }
}
