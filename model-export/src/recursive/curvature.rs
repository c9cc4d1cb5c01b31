//! What the curvature of the measurement adds to its noise.

use super::carry::MEASUREMENT;
use super::line_of_sight::LineOfSight;
use super::motion::Matrix;
use super::scalar::Scalar;

/// Variances that the curvature of the measurement adds: half the trace of `(Hessian P)^2`, the
/// second-order filter's term (Bar-Shalom, Li and Kirubarajan 2001, section 10.3.2).
///
/// The range-rate's Hessian by position alone is left out: it is smaller by the ratio of the
/// speed to the range.
pub fn curvature<S: Scalar>(
    covariance: &Matrix<S>,
    sight: &LineOfSight<S>,
    z: S,
) -> [S; MEASUREMENT] {
    let zero = S::constant(0.0);
    let half = S::constant(0.5);
    let (c, s) = (sight.cosine, sight.sine);
    let (rho, range) = (sight.horizontal_m, sight.range_m);
    let (cos_el, sin_el) = (rho / range, z / range);
    let radial = [c, s, zero];
    let lateral = [-s, c, zero];
    let upward = [-(sin_el * c), -(sin_el * s), cos_el];
    let along = [cos_el * c, cos_el * s, sin_el];
    let form = |a: &[S; 3], i: usize, b: &[S; 3], j: usize| {
        let mut sum = zero;
        for row in 0..3 {
            for column in 0..3 {
                sum = sum + a[row] * covariance[i + row][j + column] * b[column];
            }
        }
        sum
    };
    let (ll, uu, lu) = (
        form(&lateral, 0, &lateral, 0),
        form(&upward, 0, &upward, 0),
        form(&lateral, 0, &upward, 0),
    );
    let (rr, rl) = (form(&radial, 0, &radial, 0), form(&radial, 0, &lateral, 0));
    let (aa, au) = (form(&along, 0, &along, 0), form(&along, 0, &upward, 0));
    let (vll, vuu, vlu) = (
        form(&lateral, 3, &lateral, 3),
        form(&upward, 3, &upward, 3),
        form(&lateral, 3, &upward, 3),
    );
    let (cll, cuu, clu, cul) = (
        form(&lateral, 0, &lateral, 3),
        form(&upward, 0, &upward, 3),
        form(&lateral, 0, &upward, 3),
        form(&upward, 0, &lateral, 3),
    );
    let two = S::constant(2.0);
    let range2 = range * range;
    let rho2 = sight.horizontal_m2;
    let elevation_sway = half * ll * ll * sin_el * sin_el / (cos_el * cos_el);
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
    use crate::recursive::observation::observe;

    const STATE_AT: [f64; 9] = [12.0, -21.0, 9.0, 1.5, -0.7, 0.4, 0.3, 0.2, -0.1];

    fn expected(state: &[f64; 9]) -> [f64; 4] {
        observe(state, &LineOfSight::to([state[0], state[1], state[2]])).0
    }

    #[test]
    fn curvature_equals_the_numerical_hessian() {
        // The covariance is isotropic here so that the neglected cross terms vanish.
        let mut isotropic = [[0.0; 9]; 9];
        for i in 0..6 {
            isotropic[i][i] = if i < 3 { 0.8 } else { 0.5 };
        }
        let got = curvature(&isotropic, &LineOfSight::to([12.0, -21.0, 9.0]), 9.0);
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
