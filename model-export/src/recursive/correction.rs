//! Extended Kalman correction with a native polar measurement.

use super::carry::{MEASUREMENT, STATE};
use super::cholesky::{cholesky, forward_substitute};
use super::curvature::curvature;
use super::line_of_sight::LineOfSight;
use super::motion::Matrix;
use super::observation::observe;
use super::scalar::Scalar;

/// Normalised innovation squared at which a measurement is taken for an outlier, the tracker's:
/// eight standard deviations. Chance (chi-square, four degrees of freedom) would pass 40 once in 20
/// million; the rest is room for jumps of real logs, which a tighter gate makes the filter lose.
pub const GATE: f64 = bnkf::recursive::GATE_NIS as f64;

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
