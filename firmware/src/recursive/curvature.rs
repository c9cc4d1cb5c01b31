//! Variances that the curvature of the measurement function adds to its noise.
//!
//! Half the trace of `(Hessian P)^2` per component: the second-order filter's term (Bar-Shalom, Li
//! and Kirubarajan 2001, section 10.3.2). Two small parts are left out: the range-rate's Hessian by
//! position alone, smaller by the ratio of the speed to the range, and of the elevation the product of
//! swaying to the side with what is along and upward, `2 tan(el) (along' P lateral) (upward' P lateral)
//! / range^4`, a few per cent of the term.

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
    // P_block b for the blocks' right-hand vectors that occur.
    let times = |block: &[[S; 3]; 3], b: &[S; 3]| -> [S; 3] {
        block.map(|[x, y, z]| zero + x * b[0] + y * b[1] + z * b[2])
    };
    let places = block::<S, 0, 0>(covariance);
    let velocities = block::<S, 3, 3>(covariance);
    let between = block::<S, 0, 3>(covariance);
    let dot = |a: &[S; 3], b: &[S; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (pl, pu) = (times(&places, &lateral), times(&places, &upward));
    let (ll, uu, lu) = (dot(&lateral, &pl), dot(&upward, &pu), dot(&lateral, &pu));
    let (rr, rl) = (dot(&radial, &times(&places, &radial)), dot(&radial, &pl));
    let (aa, au) = (dot(&along, &times(&places, &along)), dot(&along, &pu));
    let (vl, vu) = (times(&velocities, &lateral), times(&velocities, &upward));
    let (vll, vuu, vlu) = (dot(&lateral, &vl), dot(&upward, &vu), dot(&lateral, &vu));
    let (cl, cu) = (times(&between, &lateral), times(&between, &upward));
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

/// Three rows from `I` on and three columns from `J` on.
fn block<S: Scalar, const I: usize, const J: usize>(p: &Covariance<S>) -> [[S; 3]; 3] {
    [
        [p[I][J], p[I][J + 1], p[I][J + 2]],
        [p[I + 1][J], p[I + 1][J + 1], p[I + 1][J + 2]],
        [p[I + 2][J], p[I + 2][J + 1], p[I + 2][J + 2]],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::{axes, predict};
    use crate::recursive::state::tests::covariance;
    use nalgebra::{SMatrix, SVector};

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

    /// A full covariance: half the trace of `(Hessian P)^2`, the Hessian by differences; that of the
    /// range-rate by position and velocity is the derivative of the line of sight.
    #[test]
    fn curvature_of_a_full_covariance_is_half_a_trace() {
        let full = covariance(6);
        let p = SMatrix::<f64, 6, 6>::from_fn(|i, j| full[i][j]);
        let got = curvature(&STATE_AT, &full);
        // Left out of the elevation: how its swaying to the side goes with what is along and upward.
        let [elevation, azimuth, range, _] = expected(&STATE_AT);
        let [along, upward, lateral] = axes(elevation, azimuth).map(SVector::<f64, 3>::from);
        let beside = p.fixed_view::<3, 3>(0, 0) * lateral;
        let left_out =
            2.0 * elevation.tan() * along.dot(&beside) * upward.dot(&beside) / range.powi(4);
        let h = 1e-3;
        for component in 0..4 {
            let hessian = SMatrix::<f64, 6, 6>::from_fn(|a, b| {
                if component == 3 && (a < 3) == (b < 3) {
                    return 0.0;
                }
                let at = |p: f64, q: f64| {
                    let mut state = STATE_AT;
                    state[a] += p * h;
                    state[b] += q * h;
                    expected(&state)[component]
                };
                (at(1.0, 1.0) - at(1.0, -1.0) - at(-1.0, 1.0) + at(-1.0, -1.0)) / (4.0 * h * h)
            });
            let product = hessian * p;
            let mut half = 0.5 * (product * product).trace();
            if component == 0 {
                half -= left_out;
            }
            let ratio = got[component] / half;
            assert!((ratio - 1.0).abs() < 1e-5, "{component}: {ratio}");
        }
    }

    /// Near the vertical the horizontal distance counts as a centimetre.
    #[test]
    fn curvature_near_the_zenith_is_that_of_a_centimetre() {
        let mut covariance = [[0.0; 9]; 9];
        for axis in 0..3 {
            covariance[axis][axis] = 0.01;
        }
        let mut state = [0.0_f64; 9];
        (state[0], state[2]) = (0.01, 5.0);
        let edge = curvature(&state, &covariance);
        assert!((edge[1] / (1e-4 / 1e-8) - 1.0).abs() < 1e-9, "{edge:?}");
        state[0] = 0.0;
        let got = curvature(&state, &covariance);
        assert!(got.iter().all(|value: &f64| value.is_finite()));
    }
}
