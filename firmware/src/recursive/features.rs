//! What the network reads before a prediction.
//!
//! Vectors run along the level line of sight (radial, lateral, vertical), so the features do not
//! change when everything turns about the vertical.

use super::memory::{MEAN_TIMES_S, Memory, NOTES};
use super::motion::{Covariance, State};
use super::sight::LineOfSight;
use crate::scalar::Scalar;

/// Features, the network's notes included.
pub const FEATURES: usize = 55 + NOTES;

/// Normalised features are kept within this many standard deviations.
pub const FEATURE_LIMIT: f64 = 4.0;

/// The features of a prediction over `dt_s` seconds, before normalisation; `BLOB.md` lists them.
pub fn features<S: Scalar>(
    state: &State<S>,
    covariance: &Covariance<S>,
    memory: &Memory<S>,
    sight: &LineOfSight<S>,
    dt_s: S,
) -> [S; FEATURES] {
    let c = S::constant;
    let velocity = sight.level([state[3], state[4], state[5]]);
    let acceleration = sight.level([state[6], state[7], state[8]]);
    let mut writer = Writer {
        list: [c(0.0); FEATURES],
        filled: 0,
    };
    writer.all([sight.range_m, state[2]]);
    writer.all(velocity);
    writer.all(acceleration);
    for block in [0, 3, 6] {
        let entry = |row: usize, column: usize| covariance[block + row][block + column];
        let variances = sight.level_variances(entry(0, 0), entry(0, 1), entry(1, 1), entry(2, 2));
        writer.all(variances.map(|v| c(0.5) * v.max(c(1e-10)).ln()));
    }
    for (mean, time_s) in memory.velocity_means.iter().zip(MEAN_TIMES_S) {
        let mean = sight.level(*mean);
        let scale = c(1.0) / (c(2.0) * c(time_s)).sqrt();
        writer.all::<3>(core::array::from_fn(|axis| {
            scale * (mean[axis] - velocity[axis])
        }));
    }
    writer.all(memory.innovation.map(|y| y.clamp(-4.0, 4.0)));
    writer.all(memory.drift);
    writer.all(memory.squares.map(|square| (square + c(0.05)).ln()));
    writer.all(memory.ln_sigmas);
    writer.all([memory.coast_s, (-memory.age_s / c(1.5)).exp(), (dt_s * c(10.0)).ln()]);
    let (v, a) = (velocity, acceleration);
    let dot = |a: [S; 3], b: [S; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let speed2 = dot(v, v);
    let floor = c(0.3) + speed2;
    writer.all([
        (v[1] * a[2] - v[2] * a[1]) / floor,
        (v[2] * a[0] - v[0] * a[2]) / floor,
        (v[0] * a[1] - v[1] * a[0]) / floor,
        dot(v, a) / floor,
        (speed2 + c(1e-12)).sqrt(),
        (speed2 + c(0.1)).ln(),
        (dot(a, a) + c(0.1)).ln(),
    ]);
    writer.all(memory.notes);
    writer.list
}

struct Writer<S> {
    list: [S; FEATURES],
    filled: usize,
}

impl<S: Scalar> Writer<S> {
    fn all<const N: usize>(&mut self, values: [S; N]) {
        self.list[self.filled..self.filled + N].copy_from_slice(&values);
        self.filled += N;
    }
}
