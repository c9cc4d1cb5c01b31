//! Extended Kalman correction with a native polar measurement.

use super::carry::{MEASUREMENT, STATE};
use super::line_of_sight::LineOfSight;
use super::motion::Matrix;
use super::scalar::Scalar;

/// Normalised innovation squared at which a measurement is taken for an outlier: eight standard
/// deviations. Chance (chi-square, four degrees of freedom) would pass 40 once in 20 million; the
/// rest is room for jumps of real logs, which a tighter gate makes the filter lose.
pub const GATE: f64 = 64.0;

/// A corrected state and what the measurement said about it.
#[derive(Clone, Copy, Debug)]
pub struct Corrected<S> {
    /// Position, velocity and acceleration.
    pub state: [S; STATE],
    /// Covariance of `state`.
    pub covariance: Matrix<S>,
    /// Innovation whitened by the Cholesky factor of its covariance; its squares sum to the NIS.
    pub whitened: [S; MEASUREMENT],
    /// One when the measurement was used, zero in a gap or when the gate refused it.
    pub used: S,
}

/// Elevation, azimuth, range and range-rate of a state, and their derivatives by position and
/// velocity (rows: measurements; columns: three of position, three of velocity).
pub fn observe<S: Scalar>(
    state: &[S; STATE],
    sight: &LineOfSight<S>,
) -> ([S; MEASUREMENT], [[S; 6]; MEASUREMENT]) {
    let zero = S::constant(0.0);
    let [x, y, z, vx, vy, vz, ..] = *state;
    let (rho, range) = (sight.horizontal_m, sight.range_m);
    let range2 = range * range;
    let unit = [x / range, y / range, z / range];
    let rate = unit[0] * vx + unit[1] * vy + unit[2] * vz;
    let lean = z / (range2 * rho);
    let across = |velocity: S, along: S| (velocity - rate * along) / range;
    let expected = [z.atan2(rho), y.atan2(x), range, rate];
    let jacobian = [
        [-(x * lean), -(y * lean), rho / range2, zero, zero, zero],
        [
            -(y / sight.horizontal_m2),
            x / sight.horizontal_m2,
            zero,
            zero,
            zero,
            zero,
        ],
        [unit[0], unit[1], unit[2], zero, zero, zero],
        [
            across(vx, unit[0]),
            across(vy, unit[1]),
            across(vz, unit[2]),
            unit[0],
            unit[1],
            unit[2],
        ],
    ];
    (expected, jacobian)
}

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

/// Corrects a predicted state with elevation, azimuth, range and range-rate.
///
/// `measured` is one when there is a measurement and zero in a gap; then nothing changes. Nor does
/// it when the normalised innovation squared reaches [`GATE`].
/// The covariance loses `W' W` with `W = L^-1 H P` and `L L' = S`, which equals Joseph's form in
/// exact arithmetic.
pub fn correct<S: Scalar>(
    state: &[S; STATE],
    covariance: &Matrix<S>,
    measurement: &[S; MEASUREMENT],
    variances: &[S; MEASUREMENT],
    measured: S,
) -> Corrected<S> {
    let zero = S::constant(0.0);
    let sight = LineOfSight::to([state[0], state[1], state[2]]);
    let (expected, jacobian) = observe(state, &sight);
    let curvature = curvature(covariance, &sight, state[2]);
    let innovation: [S; MEASUREMENT] = core::array::from_fn(|i| {
        let difference = measurement[i] - expected[i];
        if i < 2 { difference.wrap() } else { difference }
    });
    // H P: one row of nine for every measurement.
    let mut gained = [[zero; STATE]; MEASUREMENT];
    for i in 0..MEASUREMENT {
        for column in 0..STATE {
            for k in 0..6 {
                gained[i][column] = gained[i][column] + jacobian[i][k] * covariance[k][column];
            }
        }
    }
    let mut spread = [[zero; MEASUREMENT]; MEASUREMENT];
    for i in 0..MEASUREMENT {
        for j in 0..=i {
            for k in 0..6 {
                spread[i][j] = spread[i][j] + gained[i][k] * jacobian[j][k];
            }
        }
        spread[i][i] = spread[i][i] + variances[i] + curvature[i];
    }
    let factor = cholesky(&spread);
    let whitened = forward_substitute(&factor, innovation);
    let nis = whitened.iter().fold(zero, |sum, &y| sum + y * y);
    // A step from one to zero at the gate, narrow enough to be one.
    let used = measured * ((S::constant(GATE) - nis) * S::constant(1e6)).clamp(0.0, 1.0);
    let mut whitened_rows = [[zero; STATE]; MEASUREMENT];
    for column in 0..STATE {
        let rows = forward_substitute(&factor, core::array::from_fn(|i| gained[i][column]));
        for i in 0..MEASUREMENT {
            whitened_rows[i][column] = rows[i];
        }
    }
    let mut corrected = *state;
    let mut remaining = *covariance;
    for row in 0..STATE {
        let mut shift = zero;
        for i in 0..MEASUREMENT {
            shift = shift + whitened_rows[i][row] * whitened[i];
        }
        corrected[row] = state[row] + used * shift;
        for column in 0..=row {
            let mut loss = zero;
            for i in 0..MEASUREMENT {
                loss = loss + whitened_rows[i][row] * whitened_rows[i][column];
            }
            remaining[row][column] = covariance[row][column] - used * loss;
            remaining[column][row] = remaining[row][column];
        }
    }
    Corrected {
        state: corrected,
        covariance: remaining,
        whitened,
        used,
    }
}

/// Lower factor `L` of `L L'`, reading the lower triangle. Pivots are kept above 1e-14.
pub fn cholesky<S: Scalar, const N: usize>(matrix: &[[S; N]; N]) -> [[S; N]; N] {
    let mut factor = [[S::constant(0.0); N]; N];
    for row in 0..N {
        for column in 0..=row {
            let mut rest = matrix[row][column];
            for k in 0..column {
                rest = rest - factor[row][k] * factor[column][k];
            }
            factor[row][column] = if row == column {
                rest.max(S::constant(1e-14)).sqrt()
            } else {
                rest / factor[column][column]
            };
        }
    }
    factor
}

/// Solves `L w = y`.
pub fn forward_substitute<S: Scalar, const N: usize>(factor: &[[S; N]; N], y: [S; N]) -> [S; N] {
    let mut w = y;
    for row in 0..N {
        for k in 0..row {
            w[row] = w[row] - factor[row][k] * w[k];
        }
        w[row] = w[row] / factor[row][row];
    }
    w
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATE_AT: [f64; 9] = [12.0, -21.0, 9.0, 1.5, -0.7, 0.4, 0.3, 0.2, -0.1];

    fn expected(state: &[f64; 9]) -> [f64; 4] {
        observe(state, &LineOfSight::to([state[0], state[1], state[2]])).0
    }

    /// A dense covariance, positive definite by construction.
    fn covariance() -> Matrix<f64> {
        let mut matrix = [[0.0; 9]; 9];
        for i in 0..9 {
            for j in 0..9 {
                matrix[i][j] = 0.08 * ((i * j) as f64 * 0.7).cos() / (1.0 + i.abs_diff(j) as f64);
            }
            matrix[i][i] += 0.6;
        }
        matrix
    }

    #[test]
    fn jacobian_equals_central_differences() {
        let (_, jacobian) = observe(&STATE_AT, &LineOfSight::to([12.0, -21.0, 9.0]));
        for k in 0..6 {
            let (mut high, mut low) = (STATE_AT, STATE_AT);
            high[k] += 1e-5;
            low[k] -= 1e-5;
            for i in 0..4 {
                let difference = (expected(&high)[i] - expected(&low)[i]) / 2e-5;
                assert!((jacobian[i][k] - difference).abs() < 1e-9, "{i} {k}");
            }
        }
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

    #[test]
    fn the_covariance_is_josephs() {
        let (sigmas, measurement) = ([0.05, 0.04, 2.0, 0.3], [0.3, -1.0, 27.0, 1.0]);
        let before = covariance();
        let sight = LineOfSight::to([12.0, -21.0, 9.0]);
        let corrected = correct(
            &STATE_AT,
            &before,
            &measurement,
            &sigmas.map(|s: f64| s * s),
            1.0,
        );
        let (_, jacobian) = observe(&STATE_AT, &sight);
        let curvature = curvature(&before, &sight, 9.0);
        // The optimal gain makes Joseph's form stationary: the trace cannot fall by moving it.
        let noise: [f64; 4] = core::array::from_fn(|i| sigmas[i] * sigmas[i] + curvature[i]);
        let gain = |row: usize, i: usize| {
            // P' H' R^-1 is the gain of the corrected covariance.
            (0..6)
                .map(|k| corrected.covariance[row][k] * jacobian[i][k])
                .sum::<f64>()
                / noise[i]
        };
        for row in 0..9 {
            for column in 0..9 {
                let mut joseph = 0.0;
                for a in 0..9 {
                    for b in 0..9 {
                        let kept = |r: usize, c: usize| {
                            let kh: f64 = if c < 6 {
                                (0..4).map(|i| gain(r, i) * jacobian[i][c]).sum()
                            } else {
                                0.0
                            };
                            f64::from(u8::from(r == c)) - kh
                        };
                        joseph += kept(row, a) * before[a][b] * kept(column, b);
                    }
                }
                for i in 0..4 {
                    joseph += gain(row, i) * noise[i] * gain(column, i);
                }
                assert!((joseph - corrected.covariance[row][column]).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn an_outlier_is_not_used() {
        let mut measurement = expected(&STATE_AT);
        let sigmas = [0.05, 0.04, 2.0, 0.3];
        let before = covariance();
        assert_eq!(
            correct(
                &STATE_AT,
                &before,
                &measurement,
                &sigmas.map(|s: f64| s * s),
                1.0
            )
            .used,
            1.0
        );
        measurement[2] += 60.0;
        let corrected = correct(
            &STATE_AT,
            &before,
            &measurement,
            &sigmas.map(|s: f64| s * s),
            1.0,
        );
        assert_eq!((corrected.used, corrected.state), (0.0, STATE_AT));
        assert!(corrected.whitened[2] > 10.0);
    }

    #[test]
    fn a_gap_changes_nothing() {
        let before = covariance();
        let corrected = correct(&STATE_AT, &before, &[0.0; 4], &[0.1; 4], 0.0);
        assert_eq!(corrected.state, STATE_AT);
        assert_eq!(corrected.covariance, before);
    }
}
