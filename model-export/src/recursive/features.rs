//! What the network reads before a prediction.

use super::carry::{Carry, MEAN_TIMES_S, MEANS, MEASUREMENT, MEMORY};
use super::line_of_sight::LineOfSight;
use super::scalar::Scalar;

/// Features, the network's own memory included.
pub const FEATURES: usize = 55 + MEMORY;

/// Normalised features are kept within this many standard deviations.
pub const FEATURE_LIMIT: f64 = 4.0;

/// Computes the features of a prediction over `dt_s` seconds, before normalisation.
///
/// Vectors run along the level line of sight (radial, lateral, vertical), so the features do not
/// change when everything turns about the vertical.
///
/// | index | feature |
/// |---|---|
/// | 0, 1 | range, height [m] |
/// | 2..5, 5..8 | velocity [m/s], acceleration [m/s^2] |
/// | 8..11, 11..14, 14..17 | ln of the standard deviations of position, velocity, acceleration |
/// | 17..29 | running means of the velocity less the velocity, over `sqrt(2 tau)` |
/// | 29..33, 33..37 | whitened innovation within +-4, its running mean |
/// | 37..41 | ln of 0.05 + the running means of its squares |
/// | 41..45 | ln of the sensor's sigmas: elevation, azimuth, range, range-rate |
/// | 45, 46, 47 | time since the last measurement [s], exp(-age / 1.5 s), ln(dt / 0.1 s) |
/// | 48..51, 51 | v x a and v . a over v^2 + 0.3 |
/// | 52, 53, 54 | speed, ln(v^2 + 0.1), ln(a^2 + 0.1) |
/// | 55.. | memory |
pub fn features<S: Scalar>(carry: &Carry<S>, dt_s: S) -> [S; FEATURES] {
    let c = S::constant;
    let state = &carry.state;
    let sight = LineOfSight::to([state[0], state[1], state[2]]);
    let velocity = sight.level([state[3], state[4], state[5]]);
    let acceleration = sight.level([state[6], state[7], state[8]]);
    let mut list = [c(0.0); FEATURES];
    let mut write = Writer {
        list: &mut list,
        filled: 0,
    };
    write.all([sight.range_m, state[2]]);
    write.all(velocity);
    write.all(acceleration);
    for block in [0, 3, 6] {
        let covariance = core::array::from_fn(|row| {
            core::array::from_fn(|column| carry.covariance[block + row][block + column])
        });
        let variances = sight.level_variances(&covariance);
        write.all(variances.map(|variance| c(0.5) * variance.max(c(1e-10)).ln()));
    }
    for i in 0..MEANS {
        let mean = sight.level(carry.velocity_means[i]);
        let scale = c(1.0 / (2.0 * MEAN_TIMES_S[i]).sqrt());
        write.all::<3>(core::array::from_fn(|axis| {
            scale * (mean[axis] - velocity[axis])
        }));
    }
    write.all::<MEASUREMENT>(carry.innovation.map(|y| y.clamp(-4.0, 4.0)));
    write.all(carry.drift);
    write.all::<MEASUREMENT>(carry.squares.map(|s| (s + c(0.05)).ln()));
    write.all(carry.ln_sigmas);
    write.all([
        carry.coast_s,
        (carry.age_s * c(-1.0 / 1.5)).exp(),
        (dt_s * c(10.0)).ln(),
    ]);
    let speed2 = dot(velocity, velocity);
    let floor = c(0.3) + speed2;
    write.all(cross(velocity, acceleration).map(|x| x / floor));
    write.all([
        dot(velocity, acceleration) / floor,
        (speed2 + c(1e-12)).sqrt(),
        (speed2 + c(0.1)).ln(),
        (dot(acceleration, acceleration) + c(0.1)).ln(),
    ]);
    write.all::<MEMORY>(carry.memory);
    list
}

struct Writer<'a, S> {
    list: &'a mut [S; FEATURES],
    filled: usize,
}

impl<S: Scalar> Writer<'_, S> {
    fn all<const N: usize>(&mut self, values: [S; N]) {
        self.list[self.filled..self.filled + N].copy_from_slice(&values);
        self.filled += N;
    }
}

fn dot<S: Scalar>(a: [S; 3], b: [S; 3]) -> S {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross<S: Scalar>(a: [S; 3], b: [S; 3]) -> [S; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Offset and gain that bring every feature to zero mean and unit deviation.
#[derive(Clone, Debug, PartialEq)]
pub struct Normalisation {
    /// Subtracted first.
    pub offset: [f64; FEATURES],
    /// Multiplied after.
    pub gain: [f64; FEATURES],
}

impl Normalisation {
    /// Leaves the features as they are, within [`FEATURE_LIMIT`].
    pub const IDENTITY: Self = Self {
        offset: [0.0; FEATURES],
        gain: [1.0; FEATURES],
    };

    /// `(feature - offset) * gain`, within [`FEATURE_LIMIT`].
    pub fn apply<S: Scalar>(&self, features: &[S; FEATURES]) -> [S; FEATURES] {
        core::array::from_fn(|i| {
            let centred = features[i] - S::constant(self.offset[i]);
            (centred * S::constant(self.gain[i])).clamp(-FEATURE_LIMIT, FEATURE_LIMIT)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recursive::carry::CARRY;

    fn carry() -> Carry<f64> {
        let flat: Vec<f64> = (0..CARRY)
            .map(|i| 0.3 + ((i * 7) % 11) as f64 * 0.2)
            .collect();
        let mut carry = Carry::unflatten(&flat);
        for i in 0..9 {
            carry.covariance[i][i] += 5.0;
        }
        carry
    }

    /// Turns every world vector and covariance by `angle` about the vertical.
    fn turned(carry: &Carry<f64>, angle: f64) -> Carry<f64> {
        let (s, c) = angle.sin_cos();
        let turn = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]];
        let mut full = [[0.0; 9]; 9];
        for block in 0..3 {
            for i in 0..3 {
                full[3 * block + i][3 * block..3 * block + 3].copy_from_slice(&turn[i]);
            }
        }
        let mut out = *carry;
        for i in 0..9 {
            out.state[i] = (0..9).map(|k| full[i][k] * carry.state[k]).sum();
            for j in 0..9 {
                out.covariance[i][j] = 0.0;
                for k in 0..9 {
                    for l in 0..9 {
                        out.covariance[i][j] += full[i][k] * carry.covariance[k][l] * full[j][l];
                    }
                }
            }
        }
        for (mean, before) in out.velocity_means.iter_mut().zip(&carry.velocity_means) {
            for i in 0..3 {
                mean[i] = (0..3).map(|k| turn[i][k] * before[k]).sum();
            }
        }
        out
    }

    #[test]
    fn features_ignore_a_turn_about_the_vertical() {
        let plain = features(&carry(), 0.1);
        let moved = features(&turned(&carry(), 2.1), 0.1);
        for (i, (a, b)) in plain.iter().zip(moved).enumerate() {
            assert!((a - b).abs() < 1e-12, "feature {i}: {a} {b}");
        }
        assert_ne!(plain[FEATURES - 1], 0.0);
    }

    #[test]
    fn normalised_features_are_bounded() {
        let mut normalisation = Normalisation::IDENTITY;
        normalisation.gain = [1e6; FEATURES];
        let bounded = normalisation.apply(&features(&carry(), 0.1));
        assert!(bounded.iter().all(|f| f.abs() <= FEATURE_LIMIT));
    }
}
