//! Prediction of position, velocity and acceleration under a [`Schedule`].

use super::carry::STATE;
use super::line_of_sight::LineOfSight;
use super::scalar::Scalar;
use super::schedule::Schedule;

/// A square matrix over the state.
pub type Matrix<S> = [[S; STATE]; STATE];

/// Moves a state (position, velocity, acceleration) and its covariance ahead by `dt_s`.
///
/// The acceleration decays at `decay`, turns about the vertical at `turn` and is driven by the mean
/// jerk less damping times velocity; velocity and position are its integrals. With
/// `f1 = (1 - e) / decay` and `f2 = (dt - f1) / decay`, `e = exp(-decay dt)`, `R(x)` the turn by
/// `x` and `a`, `v` for acceleration and velocity:
///
/// ```text
/// a' = e R(turn dt) a + f1 (jerk - damping v)
/// v' = v + f1 R(turn dt / 2) a + f2 (jerk - damping v)
/// p' = p + dt v + f2 R(turn dt / 2) a
/// ```
///
/// The noise is that of white jerk, white acceleration and white velocity, integrated over `dt`.
pub fn predict<S: Scalar>(
    state: &[S; STATE],
    covariance: &Matrix<S>,
    sight: &LineOfSight<S>,
    schedule: &Schedule<S>,
    dt_s: S,
) -> ([S; STATE], Matrix<S>) {
    let (transition, drive) = transition(sight, schedule, dt_s);
    let mut predicted = drive;
    for row in 0..STATE {
        for column in 0..STATE {
            predicted[row] = predicted[row] + transition[row][column] * state[column];
        }
    }
    let mut spread = propagate(&transition, covariance);
    add_noise(&mut spread, sight, schedule, dt_s);
    (predicted, spread)
}

/// The matrix that acts on the state and what the mean jerk adds to it.
fn transition<S: Scalar>(
    sight: &LineOfSight<S>,
    schedule: &Schedule<S>,
    dt_s: S,
) -> (Matrix<S>, [S; STATE]) {
    let (zero, one) = (S::constant(0.0), S::constant(1.0));
    let fade = (-(schedule.decay_hz * dt_s)).exp_m1();
    let f1 = -fade / schedule.decay_hz;
    let f2 = (dt_s - f1) / schedule.decay_hz;
    let kept = one + fade;
    let half = S::constant(0.5) * schedule.turn_radps * dt_s;
    let (c, s) = (half.cos(), half.sin());
    let half_turn = [[c, -s, zero], [s, c, zero], [zero, zero, one]];
    let (c2, s2) = (c * c - s * s, S::constant(2.0) * s * c);
    let full_turn = [[c2, -s2, zero], [s2, c2, zero], [zero, zero, one]];
    let mut matrix = [[zero; STATE]; STATE];
    for axis in 0..3 {
        let damping = schedule.damping_hz2[axis / 2];
        matrix[axis][axis] = one;
        matrix[axis][3 + axis] = dt_s;
        matrix[3 + axis][3 + axis] = one - damping * f2;
        matrix[6 + axis][3 + axis] = -(damping * f1);
        for from in 0..3 {
            matrix[axis][6 + from] = f2 * half_turn[axis][from];
            matrix[3 + axis][6 + from] = f1 * half_turn[axis][from];
            matrix[6 + axis][6 + from] = kept * full_turn[axis][from];
        }
    }
    let jerk = sight.world(schedule.jerk_mps3);
    let mut drive = [zero; STATE];
    for axis in 0..3 {
        drive[3 + axis] = f2 * jerk[axis];
        drive[6 + axis] = f1 * jerk[axis];
    }
    (matrix, drive)
}

/// `F P F'`, both triangles equal.
fn propagate<S: Scalar>(transition: &Matrix<S>, covariance: &Matrix<S>) -> Matrix<S> {
    let zero = S::constant(0.0);
    let mut moved = [[zero; STATE]; STATE];
    let mut spread = [[zero; STATE]; STATE];
    for row in 0..STATE {
        for column in 0..STATE {
            for k in 0..STATE {
                moved[row][column] =
                    moved[row][column] + transition[row][k] * covariance[k][column];
            }
        }
    }
    for row in 0..STATE {
        for column in 0..=row {
            for k in 0..STATE {
                spread[row][column] = spread[row][column] + moved[row][k] * transition[column][k];
            }
            spread[column][row] = spread[row][column];
        }
    }
    spread
}

fn add_noise<S: Scalar>(
    covariance: &mut Matrix<S>,
    sight: &LineOfSight<S>,
    schedule: &Schedule<S>,
    dt_s: S,
) {
    let c = S::constant;
    let dt2 = dt_s * dt_s;
    let dt3 = dt2 * dt_s;
    // For each pair of blocks (position, velocity, acceleration): the integrals of white jerk.
    let jerk = sight.world_covariance(schedule.jerk_noise);
    let acceleration = sight.world_covariance(schedule.acceleration_noise);
    let jerk_factors = [
        [
            dt2 * dt3 * c(1.0 / 20.0),
            dt2 * dt2 * c(1.0 / 8.0),
            dt3 * c(1.0 / 6.0),
        ],
        [dt2 * dt2 * c(1.0 / 8.0), dt3 * c(1.0 / 3.0), dt2 * c(0.5)],
        [dt3 * c(1.0 / 6.0), dt2 * c(0.5), dt_s],
    ];
    let acceleration_factors = [[dt3 * c(1.0 / 3.0), dt2 * c(0.5)], [dt2 * c(0.5), dt_s]];
    for (row, factors) in jerk_factors.iter().enumerate() {
        for (column, &factor) in factors.iter().enumerate() {
            for i in 0..3 {
                for j in 0..3 {
                    let mut noise = factor * jerk[i][j];
                    if row < 2 && column < 2 {
                        noise = noise + acceleration_factors[row][column] * acceleration[i][j];
                    }
                    let entry = &mut covariance[3 * row + i][3 * column + j];
                    *entry = *entry + noise;
                }
            }
        }
    }
    for axis in 0..3 {
        covariance[axis][axis] = covariance[axis][axis] + schedule.velocity_noise * dt_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recursive::schedule::{Base, OUTPUTS};

    fn sight() -> LineOfSight<f64> {
        LineOfSight::to([20.0, 10.0, 8.0])
    }

    #[test]
    fn a_turn_keeps_the_size_of_the_acceleration() {
        let mut outputs = [0.0; OUTPUTS];
        outputs[0] = -3.0;
        outputs[1] = -5.0;
        outputs[2] = -5.0;
        outputs[3] = 1.3;
        let schedule = Schedule::read(&outputs, &Base::DRONE);
        let state = [20.0, 10.0, 8.0, 0.0, 0.0, 0.0, 1.0, 0.5, 0.2];
        let (predicted, _) = predict(&state, &[[0.0; 9]; 9], &sight(), &schedule, 0.1);
        let kept = (-schedule.decay_hz * 0.1_f64).exp();
        let before = state[6].hypot(state[7]);
        assert!((predicted[6].hypot(predicted[7]) - kept * before).abs() < 1e-12);
        assert!((predicted[8] - kept * 0.2).abs() < 1e-12);
    }

    #[test]
    fn small_steps_compose_to_a_large_one() {
        // Without a turn the acceleration part is exact for every step length.
        let mut outputs = [0.0; OUTPUTS];
        outputs[1] = -5.0;
        outputs[2] = -5.0;
        let mut schedule = Schedule::read(&outputs, &Base::DRONE);
        schedule.damping_hz2 = [0.0; 2];
        let start = [20.0, 10.0, 8.0, 1.0, -2.0, 0.3, 1.0, 0.5, 0.2];
        let (once, _) = predict(&start, &[[0.0; 9]; 9], &sight(), &schedule, 0.4);
        let mut state = start;
        for _ in 0..4 {
            (state, _) = predict(&state, &[[0.0; 9]; 9], &sight(), &schedule, 0.1);
        }
        for (a, b) in once.iter().zip(state) {
            assert!((a - b).abs() < 1e-12);
        }
    }

    #[test]
    fn covariance_grows_and_stays_symmetric() {
        let schedule = Schedule::read(&[0.1; OUTPUTS], &Base::DRONE);
        let mut covariance = [[0.0; 9]; 9];
        for axis in 0..9 {
            covariance[axis][axis] = 1.0;
        }
        let (_, spread) = predict(&[1.0; 9], &covariance, &sight(), &schedule, 0.1);
        for i in 0..9 {
            assert!(i >= 6 || spread[i][i] > 1.0);
            for j in 0..9 {
                assert!((spread[i][j] - spread[j][i]).abs() < 1e-15);
            }
        }
    }
}
