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

use libm::{cosf, expm1f, sinf};
use nalgebra::{SMatrix, SVector};

use super::schedule::Schedule;
use super::sight::LineOfSight;

/// Position [m], velocity [m/s], acceleration [m/s^2]; east, north, up each.
pub type State = SVector<f32, 9>;
/// Covariance of a [`State`].
pub type Covariance = SMatrix<f32, 9, 9>;

/// The transition's entries that are neither zero nor one.
struct Transition {
    dt_s: f32,
    f1: f32,
    f2: f32,
    kept: f32,
    damping: [f32; 3],
    half: (f32, f32),
    full: (f32, f32),
}

impl Transition {
    fn new(schedule: &Schedule, dt_s: f32) -> Self {
        let fade = expm1f(-schedule.decay_hz * dt_s);
        let f1 = -fade / schedule.decay_hz;
        let half = 0.5 * schedule.turn_radps * dt_s;
        let (c, s) = (cosf(half), sinf(half));
        let [level, vertical] = schedule.damping_hz2;
        Self {
            dt_s,
            f1,
            f2: (dt_s - f1) / schedule.decay_hz,
            kept: 1.0 + fade,
            damping: [level, level, vertical],
            half: (c, s),
            full: (c * c - s * s, 2.0 * s * c),
        }
    }

    /// The transition matrix times one column.
    fn apply(&self, x: &[f32; 9]) -> [f32; 9] {
        let turned = |(c, s): (f32, f32)| [c * x[6] - s * x[7], s * x[6] + c * x[7], x[8]];
        let (half, full) = (turned(self.half), turned(self.full));
        let mut moved = [0.0; 9];
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

/// Moves a state and its covariance ahead by `dt_s`.
pub fn predict(
    state: &State,
    covariance: &Covariance,
    sight: &LineOfSight,
    schedule: &Schedule,
    dt_s: f32,
) -> (State, Covariance) {
    let transition = Transition::new(schedule, dt_s);
    let mut moved = State::from(transition.apply(&(*state).into()));
    let jerk = sight.world(schedule.jerk_mps3);
    for axis in 0..3 {
        moved[3 + axis] += transition.f2 * jerk[axis];
        moved[6 + axis] += transition.f1 * jerk[axis];
    }
    // F P, then F (F P)': two passes over columns, the second on rows of the first.
    let mut half = Covariance::zeros();
    for column in 0..9 {
        let x: [f32; 9] = core::array::from_fn(|row| covariance[(row, column)]);
        for (row, value) in transition.apply(&x).into_iter().enumerate() {
            half[(row, column)] = value;
        }
    }
    let mut spread = Covariance::zeros();
    for row in 0..9 {
        let x: [f32; 9] = core::array::from_fn(|column| half[(row, column)]);
        let values = transition.apply(&x);
        for column in 0..=row {
            spread[(row, column)] = values[column];
        }
    }
    add_noise(&mut spread, sight, schedule, dt_s);
    for row in 0..9 {
        for column in 0..row {
            spread[(column, row)] = spread[(row, column)];
        }
    }
    (moved, spread)
}

/// Adds the process noise to the lower triangle.
fn add_noise(covariance: &mut Covariance, sight: &LineOfSight, schedule: &Schedule, dt_s: f32) {
    let dt2 = dt_s * dt_s;
    let dt3 = dt2 * dt_s;
    let jerk = sight.world_covariance(schedule.jerk_noise);
    let acceleration = sight.world_covariance(schedule.acceleration_noise);
    // Blocks (position, velocity, acceleration) of the integrals of white jerk and acceleration.
    let blocks = [
        (0, 0, dt2 * dt3 / 20.0, dt3 / 3.0),
        (1, 0, dt2 * dt2 / 8.0, dt2 * 0.5),
        (1, 1, dt3 / 3.0, dt_s),
        (2, 0, dt3 / 6.0, 0.0),
        (2, 1, dt2 * 0.5, 0.0),
        (2, 2, dt_s, 0.0),
    ];
    for (row, column, by_jerk, by_acceleration) in blocks {
        let [xx, xy, yy, zz] =
            core::array::from_fn(|i| by_jerk * jerk[i] + by_acceleration * acceleration[i]);
        let (r, c) = (3 * row, 3 * column);
        covariance[(r, c)] += xx;
        covariance[(r + 1, c)] += xy;
        covariance[(r + 1, c + 1)] += yy;
        covariance[(r + 2, c + 2)] += zz;
        if row != column {
            covariance[(r, c + 1)] += xy;
        }
    }
    for axis in 0..3 {
        covariance[(axis, axis)] += schedule.velocity_noise * dt_s;
    }
}
