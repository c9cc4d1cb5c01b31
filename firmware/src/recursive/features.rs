//! What the network reads before a prediction.
//!
//! Vectors run along the level line of sight (radial, lateral, vertical), so the features do not
//! change when everything turns about the vertical.

use super::memory::{MEAN_TIMES_S, Memory, NOTES};
use super::sight::LineOfSight;
use super::state::{Covariance, State};
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
    let mut list = [c(0.0); FEATURES];
    let mut writer = Writer { rest: &mut list };
    writer.all([sight.range_m, state[2]]);
    writer.all(velocity);
    writer.all(acceleration);
    let p = covariance;
    for [xx, xy, yy, zz] in [
        [p[0][0], p[0][1], p[1][1], p[2][2]],
        [p[3][3], p[3][4], p[4][4], p[5][5]],
        [p[6][6], p[6][7], p[7][7], p[8][8]],
    ] {
        let variances = sight.level_variances(xx, xy, yy, zz);
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
    writer.all([
        memory.coast_s,
        (-memory.age_s / c(1.5)).exp(),
        (dt_s * c(10.0)).ln(),
    ]);
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
    list
}

/// Fills a list from its beginning.
struct Writer<'a, S> {
    rest: &'a mut [S],
}

impl<S: Scalar> Writer<'_, S> {
    /// What there is no room for any more is left out.
    fn all<const N: usize>(&mut self, values: [S; N]) {
        if let Some((first, rest)) = core::mem::take(&mut self.rest).split_first_chunk_mut() {
            *first = values;
            self.rest = rest;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::Vectors;

    /// A state, its covariance and a memory with every number different and none zero.
    fn filter() -> (State<f64>, Covariance<f64>, Memory<f64>) {
        let mut count = 0.0;
        let mut next = || {
            count += 1.0;
            0.3 + (count * 7.0) % 11.0 * 0.2
        };
        let state = core::array::from_fn(|_| next());
        let mut covariance = [[0.0; 9]; 9];
        for row in 0..9 {
            for column in 0..=row {
                covariance[row][column] = next();
                covariance[column][row] = covariance[row][column];
            }
            covariance[row][row] += 5.0;
        }
        let mut memory = Memory::start([0.01, 0.02, 3.0, 0.5], [1.0, 2.0, 0.5]);
        let vectors = Vectors::whole([0.0; 4], [0.012, 0.02, 3.0, 0.5]);
        memory.measured([1.2, -4.6, 0.4, -0.9], &vectors);
        memory.stepped(
            0.1,
            0.0,
            [1.5, 1.5, -0.5],
            &[0.3, -0.7, 1.1, 0.2, 0.5, 2.0, -1.0, 0.1, 0.4],
        );
        (state, covariance, memory)
    }

    fn of(
        state: &State<f64>,
        covariance: &Covariance<f64>,
        memory: &Memory<f64>,
    ) -> [f64; FEATURES] {
        let sight = LineOfSight::to([state[0], state[1], state[2]]);
        features(state, covariance, memory, &sight, 0.2)
    }

    /// Turns every world vector and covariance by `angle` about the vertical.
    fn turned(
        (state, covariance, memory): &(State<f64>, Covariance<f64>, Memory<f64>),
        angle: f64,
    ) -> (State<f64>, Covariance<f64>, Memory<f64>) {
        let (s, c) = angle.sin_cos();
        let turn = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]];
        let full = |i: usize, j: usize| {
            if i / 3 == j / 3 {
                turn[i % 3][j % 3]
            } else {
                0.0
            }
        };
        let moved = core::array::from_fn(|i| (0..9).map(|k| full(i, k) * state[k]).sum());
        let spread = core::array::from_fn(|i| {
            core::array::from_fn(|j| {
                let mut sum = 0.0;
                for k in 0..9 {
                    for l in 0..9 {
                        sum += full(i, k) * covariance[k][l] * full(j, l);
                    }
                }
                sum
            })
        });
        let mut memory = *memory;
        for mean in &mut memory.velocity_means {
            let before = *mean;
            *mean = core::array::from_fn(|i| (0..3).map(|k| turn[i][k] * before[k]).sum());
        }
        (moved, spread, memory)
    }

    #[test]
    fn features_ignore_a_turn_about_the_vertical() {
        let plain = filter();
        let moved = turned(&plain, 2.1);
        let plain = of(&plain.0, &plain.1, &plain.2);
        let moved = of(&moved.0, &moved.1, &moved.2);
        for (i, (a, b)) in plain.iter().zip(moved).enumerate() {
            assert!((a - b).abs() < 1e-12, "feature {i}: {a} {b}");
        }
    }

    /// Each line of the table in `BLOB.md`, written again in plain words.
    #[test]
    fn every_feature_has_its_place() {
        // A target due east: the level frame is the world's.
        let (_, covariance, memory) = filter();
        let state = [30.0, 0.0, 12.0, 1.0, -2.0, 0.5, 0.3, 0.4, -0.2];
        let got = of(&state, &covariance, &memory);
        let (v, a) = ([1.0, -2.0, 0.5], [0.3, 0.4, -0.2]);
        let mut expected = std::vec![30.0_f64.hypot(12.0), 12.0];
        expected.extend(v);
        expected.extend(a);
        expected.extend((0..9).map(|i| covariance[i][i].sqrt().ln()));
        for (mean, tau) in memory.velocity_means.iter().zip(MEAN_TIMES_S) {
            expected.extend((0..3).map(|i| (mean[i] - v[i]) / (2.0 * tau).sqrt()));
        }
        expected.extend([1.2, -4.0, 0.4, -0.9]);
        expected.extend(memory.drift);
        expected.extend(memory.squares.map(|s| (s + 0.05).ln()));
        expected.extend([0.012_f64, 0.02, 3.0, 0.5].map(f64::ln));
        expected.extend([0.1, (-0.1_f64 / 1.5).exp(), 2.0_f64.ln()]);
        let (v2, a2) = (5.25, 0.29);
        let cross = [
            v[1] * a[2] - v[2] * a[1],
            v[2] * a[0] - v[0] * a[2],
            v[0] * a[1] - v[1] * a[0],
        ];
        expected.extend(cross.map(|x| x / (v2 + 0.3)));
        expected.push((0.3 - 0.8 - 0.1) / (v2 + 0.3));
        expected.extend([f64::sqrt(v2), f64::ln(v2 + 0.1), f64::ln(a2 + 0.1)]);
        expected.extend(memory.notes);
        assert_eq!(expected.len(), FEATURES);
        for (i, (got, expected)) in got.into_iter().zip(expected).enumerate() {
            assert!(
                (got - expected).abs() < 1e-12,
                "feature {i}: {got} {expected}"
            );
        }
    }

    #[test]
    fn a_variance_of_nothing_has_a_feature() {
        let (state, _, memory) = filter();
        let list = of(&state, &[[0.0; 9]; 9], &memory);
        assert!((list[8] - 0.5 * 1e-10_f64.ln()).abs() < 1e-12);
        // Nor has a speed of nothing none.
        let mut still = state;
        still[3..6].fill(0.0);
        let list = of(&still, &[[0.0; 9]; 9], &memory);
        assert!(list.iter().all(|feature| feature.is_finite()));
    }
}
