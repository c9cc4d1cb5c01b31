//! Prediction of position, velocity and acceleration under a [`Schedule`].
//!
//! The acceleration decays at `decay`, turns about the vertical at `turn` and is driven by the mean
//! jerk less damping times velocity; velocity and position are its integrals. With
//! `f1 = (1 - e) / decay` and `f2 = (dt - f1) / decay`, `e = exp(-decay dt)`, and `R(x)` the turn
//! by `x`:
//!
//! ```text
//! a' = e R(turn dt) a + f1 (jerk - damping v)
//! v' = v + f1 R(turn dt / 2) a + f2 (jerk - damping v)
//! p' = p + dt v + f2 R(turn dt / 2) a
//! ```
//!
//! The noise is that of white jerk, white acceleration and white velocity, integrated over `dt`.

use super::densities::Densities;
use super::schedule::Schedule;
use super::sight::LineOfSight;
use super::state::{Covariance, State};
use crate::scalar::Scalar;

/// The transition's entries that are neither zero nor one.
struct Transition<S> {
    dt_s: S,
    f1: S,
    f2: S,
    kept: S,
    damping: [S; 3],
    half: (S, S),
    full: (S, S),
}

impl<S: Scalar> Transition<S> {
    fn new(schedule: &Schedule<S>, dt_s: S) -> Self {
        let constant = S::constant;
        let fade = (-schedule.decay_hz * dt_s).exp_m1();
        let f1 = -fade / schedule.decay_hz;
        let half = constant(0.5) * schedule.turn_radps * dt_s;
        let (s, c) = half.sin_cos();
        let [level, vertical] = schedule.damping_hz2;
        Self {
            dt_s,
            f1,
            f2: (dt_s - f1) / schedule.decay_hz,
            kept: constant(1.0) + fade,
            damping: [level, level, vertical],
            half: (c, s),
            full: (c * c - s * s, constant(2.0) * s * c),
        }
    }

    /// The transition matrix times one column.
    // By value and inlined: in registers.
    #[inline(always)]
    fn apply(&self, x: [S; 9]) -> [S; 9] {
        let turned = |(c, s): (S, S)| [c * x[6] - s * x[7], s * x[6] + c * x[7], x[8]];
        let (half, full) = (turned(self.half), turned(self.full));
        let mut moved = [S::constant(0.0); 9];
        for axis in 0..3 {
            let velocity = x[3 + axis];
            let braking = self.damping[axis] * velocity;
            moved[axis] = x[axis] + self.dt_s * velocity + self.f2 * half[axis];
            moved[3 + axis] = velocity + self.f1 * half[axis] - self.f2 * braking;
            moved[6 + axis] = self.kept * full[axis] - self.f1 * braking;
        }
        moved
    }
}

/// Moves a state and its covariance ahead by `dt_s`, in place.
pub fn predict<S: Scalar>(
    state: &mut State<S>,
    covariance: &mut Covariance<S>,
    sight: &LineOfSight<S>,
    schedule: &Schedule<S>,
    dt_s: S,
) {
    let transition = Transition::new(schedule, dt_s);
    *state = transition.apply(*state);
    let jerk = sight.world(schedule.jerk_mps3);
    for axis in 0..3 {
        state[3 + axis] = state[3 + axis] + transition.f2 * jerk[axis];
        state[6 + axis] = state[6 + axis] + transition.f1 * jerk[axis];
    }
    // A symmetric covariance has its columns as rows, so then row i holds column i of F P, and the whole is
    // P F'; its columns become those of F P F'.
    for column in covariance.iter_mut() {
        *column = transition.apply(*column);
    }
    for column in 0..9 {
        let values = transition.apply(core::array::from_fn(|row| covariance[row][column]));
        for (row, value) in covariance.iter_mut().zip(values) {
            row[column] = value;
        }
    }
    add_noise(covariance, sight, &schedule.noise, dt_s);
}

/// Adds process noise to the lower triangle, and makes the upper one its mirror image.
pub fn add_noise<S: Scalar>(
    covariance: &mut Covariance<S>,
    sight: &LineOfSight<S>,
    noise: &Densities<S>,
    dt_s: S,
) {
    let constant = S::constant;
    let dt2 = dt_s * dt_s;
    let dt3 = dt2 * dt_s;
    let jerk = sight.world_covariance(noise.jerk);
    let acceleration = sight.world_covariance(noise.acceleration);
    // Blocks (position, velocity, acceleration) of the integrals of white jerk and acceleration.
    let weighed = |by_jerk: S, by_acceleration: S| {
        core::array::from_fn(|i| by_jerk * jerk[i] + by_acceleration * acceleration[i])
    };
    let p = covariance;
    let zero = constant(0.0);
    add_block::<S, 0, 0>(p, weighed(dt2 * dt3 / constant(20.0), dt3 / constant(3.0)));
    add_block::<S, 3, 0>(p, weighed(dt2 * dt2 / constant(8.0), dt2 * constant(0.5)));
    add_block::<S, 3, 3>(p, weighed(dt3 / constant(3.0), dt_s));
    add_block::<S, 6, 0>(p, weighed(dt3 / constant(6.0), zero));
    add_block::<S, 6, 3>(p, weighed(dt2 * constant(0.5), zero));
    add_block::<S, 6, 6>(p, weighed(dt_s, zero));
    let covariance = p;
    for axis in 0..3 {
        covariance[axis][axis] = covariance[axis][axis] + noise.velocity * dt_s;
    }
    for row in 0..9 {
        for column in 0..row {
            covariance[column][row] = covariance[row][column];
        }
    }
}

/// Adds the entries xx, xy, yy and zz of a symmetric block, whose other two are zero; of one on the
/// diagonal the lower triangle.
fn add_block<S: Scalar, const ROW: usize, const COLUMN: usize>(
    covariance: &mut Covariance<S>,
    [xx, xy, yy, zz]: [S; 4],
) {
    let mut add = |row: usize, column: usize, value: S| {
        covariance[row][column] = covariance[row][column] + value;
    };
    add(ROW, COLUMN, xx);
    add(ROW + 1, COLUMN, xy);
    add(ROW + 1, COLUMN + 1, yy);
    add(ROW + 2, COLUMN + 2, zz);
    if ROW != COLUMN {
        add(ROW, COLUMN + 1, xy);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recursive::population::Base;
    use crate::recursive::schedule::SCHEDULE as OUTPUTS;
    use crate::recursive::state::tests::covariance;
    use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

    type Matrix9 = SMatrix<f64, 9, 9>;
    type Vector9 = SVector<f64, 9>;

    fn predict(
        state: &State<f64>,
        covariance: &Covariance<f64>,
        sight: &LineOfSight<f64>,
        schedule: &Schedule<f64>,
        dt_s: f64,
    ) -> (State<f64>, Covariance<f64>) {
        let (mut state, mut covariance) = (*state, *covariance);
        super::predict(&mut state, &mut covariance, sight, schedule, dt_s);
        (state, covariance)
    }

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

    /// The transition and the noise as matrices, written out from the formulas above.
    #[test]
    fn a_prediction_is_what_its_formulas_say() {
        let schedule = Schedule {
            decay_hz: 0.7,
            damping_hz2: [0.05, 0.11],
            turn_radps: 1.3,
            jerk_mps3: [0.4, -0.9, 0.6],
            noise: Densities {
                jerk: [1.5, 0.6, 2.5],
                acceleration: [0.3, 0.8, 0.2],
                velocity: 0.05,
            },
            sensor_scale: [1.0; 3],
        };
        let state = [20.0, 10.0, 8.0, 1.0, -2.0, 0.3, 1.1, 0.5, 0.2];
        let prior = covariance(2);
        let dt = 0.4_f64;
        let (moved, spread) = predict(&state, &prior, &sight(), &schedule, dt);

        let e = (-0.7 * dt).exp();
        let f1 = (1.0 - e) / 0.7;
        let f2 = (dt - f1) / 0.7;
        let turn = |angle: f64| {
            let (s, c) = angle.sin_cos();
            Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
        };
        let damping = Matrix3::from_diagonal(&[0.05, 0.05, 0.11].into());
        let one = Matrix3::identity();
        let mut f = Matrix9::identity();
        let mut set = |row: usize, column: usize, block: Matrix3<f64>| {
            let mut place = f.fixed_view_mut::<3, 3>(3 * row, 3 * column);
            place.copy_from(&block);
        };
        set(0, 1, one * dt);
        set(0, 2, turn(0.65 * dt) * f2);
        set(1, 1, one - damping * f2);
        set(1, 2, turn(0.65 * dt) * f1);
        set(2, 1, damping * -f1);
        set(2, 2, turn(1.3 * dt) * e);
        // The level frame: cosine 2 and sine 1 over the root of five.
        let (c, s) = (0.8_f64.sqrt(), 0.2_f64.sqrt());
        let level = Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
        let jerk = level.transpose() * Vector3::new(0.4, -0.9, 0.6);
        let mut expected = f * Vector9::from(state);
        for axis in 0..3 {
            expected[3 + axis] += f2 * jerk[axis];
            expected[6 + axis] += f1 * jerk[axis];
        }
        // Integrals of white noise, one, two and three times.
        let world =
            |density: [f64; 3]| level.transpose() * Matrix3::from_diagonal(&density.into()) * level;
        let (jerk, acceleration) = (world([1.5, 0.6, 2.5]), world([0.3, 0.8, 0.2]));
        let by_jerk = [
            [dt.powi(5) / 20.0, dt.powi(4) / 8.0, dt.powi(3) / 6.0],
            [dt.powi(4) / 8.0, dt.powi(3) / 3.0, dt.powi(2) / 2.0],
            [dt.powi(3) / 6.0, dt.powi(2) / 2.0, dt],
        ];
        let by_acceleration = [
            [dt.powi(3) / 3.0, dt.powi(2) / 2.0, 0.0],
            [dt.powi(2) / 2.0, dt, 0.0],
            [0.0; 3],
        ];
        let prior = Matrix9::from_fn(|i, j| prior[i][j]);
        let mut covariance = f * prior * f.transpose();
        for i in 0..9 {
            for j in 0..9 {
                let (block, at) = ((i / 3, j / 3), (i % 3, j % 3));
                covariance[(i, j)] += by_jerk[block.0][block.1] * jerk[at];
                covariance[(i, j)] += by_acceleration[block.0][block.1] * acceleration[at];
            }
        }
        for axis in 0..3 {
            covariance[(axis, axis)] += 0.05 * dt;
        }
        for i in 0..9 {
            assert!((moved[i] - expected[i]).abs() < 1e-12, "{i}");
            for j in 0..9 {
                assert!((spread[i][j] - covariance[(i, j)]).abs() < 1e-12, "{i} {j}");
            }
        }
    }
}
