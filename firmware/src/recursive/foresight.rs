//! How well forecasts of one target have come true, and what that is worth for the next: how sure they
//! are, and how much of an acceleration they go on with.
//!
//! A network that serves all targets makes forecasts too wide for those that fly as planned and too
//! narrow for restless ones. So the track writes down where it expects the target a second later, one
//! forecast after the other. For a filter that is what it says it is, the later estimate `x` lies from the
//! forecast `f` by (orthogonality of innovations)
//!
//! ```text
//! E |x - f|^2 = tr P_f - tr P
//! ```
//!
//! the growth of the variance on the way. The ratio of what was found to what was expected, held by
//! a prior at one, scales the growth of later forecasts. Where estimates are poor, `P_f` hardly
//! exceeds `P`, a comparison says nothing, and weighs nothing.
//!
//! Nor do all targets keep up what they began: some turn on as built-in flights do, some brake and stop.
//! A forecast is where the target would be if it went straight on, `c = p + v t`, and what the model adds to
//! that, `u = f - c`, acceleration most of all. How much of `u` came true is a coefficient `k`, the
//! regression of `x - c` on `u`, by its prior `b` of the blob, which is one unless the model was tuned:
//!
//! ```text
//! k = (b + sum g (x - c)' u / tr P_f) / (1 + sum g u' u / tr P_f),   g = 1 - tr P / tr P_f
//! ```
//!
//! and later forecasts are `c + k u`. It says nothing of the step, nor of the first second of a gap: those the network
//! knows. A longer gap bends as a forecast does ([`Target::bend`]): for targets that go straight on where the network's
//! turn back, `k` is near zero. What is open of `k`, the regression's variance `.3 / (1 + sum g u' u / tr P_f)`, stays open all the way
//! and is added along `u`.
//!
//! [`Target::bend`]: super::target::Target::bend

use super::state::{Covariance, State, position_variance};
use super::steady::Steady;

/// How far ahead a forecast is looked at again, s. After half a second a target that will turn has come
/// true, and what is learned from it is wrong for two.
pub const AHEAD_S: f32 = 1.0;
/// The same, microseconds.
const AHEAD_US: u64 = 1_000_000;
/// Latest after its time that it is, microseconds; the estimate is then followed back along its
/// velocity and acceleration.
const LATE_MAX_US: u64 = 500_000;
/// Weight of the ratio of one at the start, some ten comparisons: of 2.5 and 5 the better in likelihood of
/// forecasts over built-in, calm, sharply turning and agile flights of our own (docs/choices.md).
const PRIOR: f32 = 5.0;
/// What is left of earlier comparisons at the next: those of the last twenty count.
const KEPT: f32 = 0.95;
/// Coefficient at the start where a blob says nothing of it: the network's forecasts as they are.
pub const BEND_WHOLE: f64 = 1.0;
/// Weight of the coefficient at the start: of one and two, which flights of our own could not tell
/// apart, the sooner learned (docs/choices.md).
const BEND_PRIOR: f32 = 1.0;
/// Variance of the coefficient at the start: of .1, .3 and 1 the middle one, by what built-in flights gain and lose
/// (docs/choices.md).
const BEND_VARIANCE: f32 = 0.3;
/// What is left of earlier comparisons of what acceleration adds at the next: the last ten seconds count.
/// Targets change what they are about sooner than how well they are known.
const BEND_KEPT: f32 = 0.9;
/// Most that one comparison weighs in them.
const BEND_WEIGHT_MAX: f32 = 25.0;
/// Most times what was forecast that is taken to have come true, forward or back.
const BEND_FOUND_MAX: f32 = 3.0;
/// Bounds of the coefficient.
const BEND: (f32, f32) = (0.0, 1.5);
/// Largest square of one comparison, in its forecast's variance.
const SQUARE_MAX: f32 = 6.0;
/// Bounds of the scale.
const SCALE: (f32, f32) = (0.2, 5.0);

/// The open forecast of a track, and how earlier ones came out.
#[derive(Clone, Copy, Debug)]
pub struct Foresight {
    /// When the open forecast is due, microseconds; none is open at [`NONE`].
    pub(crate) due_us: u64,
    /// Where the target would be without acceleration, m, from the sensor as the track's position.
    pub(crate) position_m: [f32; 3],
    /// What acceleration is to add to that, m.
    pub(crate) bend_m: [f32; 3],
    /// Sum of the forecast's variances, m^2.
    pub(crate) variance_m2: f32,
    /// Squares that were found, each in its forecast's variance.
    pub(crate) found: f32,
    /// What they were expected to be.
    pub(crate) expected: f32,
    /// What was found of bends, along them, each in its forecast's variance.
    pub(crate) followed: f32,
    /// Their squares.
    pub(crate) bent: f32,
}

/// No forecast is open.
const NONE: u64 = 0;
/// None is to be opened.
const NEVER: u64 = u64::MAX;

impl Foresight {
    /// Nothing was forecast yet.
    pub const START: Self = Self {
        due_us: NONE,
        position_m: [0.0; 3],
        bend_m: [0.0; 3],
        variance_m2: 0.0,
        found: 0.0,
        expected: 0.0,
        followed: 0.0,
        bent: 0.0,
    };

    /// Whether a track that is at `time_us` can have come to this.
    pub(crate) fn is_sound(&self, time_us: u64) -> bool {
        let sums = 1.01 / (1.0 - KEPT);
        let bends = 1.01 * BEND_WEIGHT_MAX / (1.0 - BEND_KEPT);
        self.due_us <= due_us(time_us)
            && squared(&self.position_m).is_finite()
            && squared(&self.bend_m).is_finite()
            // What an open forecast is compared by divides.
            && (self.is_idle() || self.variance_m2 > 0.0)
            && self.variance_m2.is_finite()
            && (0.0..=SQUARE_MAX * sums).contains(&self.found)
            && (0.0..=sums).contains(&self.expected)
            && (0.0..=bends).contains(&self.bent)
            && self.followed.abs() <= 1.01 * BEND_FOUND_MAX * self.bent + f32::MIN_POSITIVE
    }

    /// Whether the next forecast is to be written down.
    pub fn is_idle(&self) -> bool {
        self.due_us == NONE
    }

    /// Writes no further forecasts down: for a copy of a track that is thrown away.
    pub fn close(&mut self) {
        self.due_us = NEVER;
    }

    /// Writes down what is expected of a target, at `now`, [`AHEAD_S`] after `time_us`.
    pub fn expect(
        &mut self,
        time_us: u64,
        now: &Steady,
        ahead: &State<f32>,
        covariance: &Covariance<f32>,
    ) {
        let variance_m2 = position_variance(covariance);
        let position_m = now.after(AHEAD_S);
        let bend_m: [f32; 3] = core::array::from_fn(|i| ahead[i] - position_m[i]);
        // Of what overflows nothing is to be learned.
        let known = variance_m2 > 0.0 && variance_m2.is_finite();
        if known && squared(&bend_m).is_finite() {
            self.due_us = due_us(time_us);
            self.position_m = position_m;
            self.bend_m = bend_m;
            self.variance_m2 = variance_m2;
        }
    }

    /// Counts positions from a sensor that is `shift_m` away from the one before.
    pub fn shift(&mut self, shift_m: [f32; 3]) {
        for (position, shift) in self.position_m.iter_mut().zip(shift_m) {
            *position -= shift;
        }
    }

    /// Compares the open forecast, if it is due, with an estimate that a measurement was used for; `bend` is
    /// how much of one comes true before anything is learned.
    pub fn compare(
        &mut self,
        time_us: u64,
        state: &State<f32>,
        covariance: &Covariance<f32>,
        bend: f32,
    ) {
        if self.due_us == NONE || self.due_us == NEVER || time_us < self.due_us {
            return;
        }
        let late_us = time_us - self.due_us;
        self.due_us = NONE;
        if late_us > LATE_MAX_US {
            return;
        }
        let back_s = -1e-6 * late_us as f32;
        let bend = self.bend(bend);
        let (mut square, mut variance_m2) = (0.0, 0.0);
        let (mut along_m2, mut bend_m2) = (0.0, 0.0);
        for axis in 0..3 {
            // Position, velocity and acceleration of one axis, and what each adds.
            let parts = [
                (axis, 1.0),
                (3 + axis, back_s),
                (6 + axis, 0.5 * back_s * back_s),
            ];
            let was_m: f32 = parts.iter().map(|&(i, factor)| factor * state[i]).sum();
            let (found_m, bend_m) = (was_m - self.position_m[axis], self.bend_m[axis]);
            let apart_m = found_m - bend * bend_m;
            square += apart_m * apart_m;
            along_m2 += found_m * bend_m;
            bend_m2 += bend_m * bend_m;
            for (i, a) in parts {
                for (j, b) in parts {
                    variance_m2 += a * b * covariance[i][j];
                }
            }
        }
        // At most one, whatever rounding makes of a variance of nothing.
        let growth = (1.0 - variance_m2 / self.variance_m2).min(1.0);
        if growth > 0.0 {
            // A comparison weighs by what it tells.
            let found = (square / self.variance_m2).min(SQUARE_MAX);
            self.found = KEPT * self.found + growth * found;
            self.expected = KEPT * self.expected + growth * growth;
            let part = if bend_m2 > 0.0 {
                (along_m2 / bend_m2).clamp(-BEND_FOUND_MAX, BEND_FOUND_MAX)
            } else {
                0.0
            };
            let weight = growth * (bend_m2 / self.variance_m2).min(BEND_WEIGHT_MAX);
            self.followed = BEND_KEPT * self.followed + weight * part;
            self.bent = BEND_KEPT * self.bent + weight;
        }
    }

    /// How much of what acceleration adds to a forecast comes true, of which `prior` is known beforehand.
    pub fn bend(&self, prior: f32) -> f32 {
        ((BEND_PRIOR * prior + self.followed) / (BEND_PRIOR + self.bent)).clamp(BEND.0, BEND.1)
    }

    /// Variance of that: the regression's, whose prior is [`BEND_VARIANCE`].
    pub fn bend_variance(&self) -> f32 {
        BEND_VARIANCE / (BEND_PRIOR + self.bent)
    }

    /// What the growth of a forecast's variance is multiplied with.
    pub fn scale(&self) -> f32 {
        ((PRIOR + self.found) / (PRIOR + self.expected)).clamp(SCALE.0, SCALE.1)
    }

    /// Scales the covariance of a forecast from an estimate whose position had this sum of variances.
    pub fn widen(&self, covariance: &mut Covariance<f32>, before_m2: f32) {
        let after_m2 = position_variance(covariance);
        let growth = (1.0 - before_m2 / after_m2).clamp(0.0, 1.0);
        let factor = 1.0 + (self.scale() - 1.0) * growth;
        if factor.is_finite() {
            for value in covariance.iter_mut().flatten() {
                *value *= factor;
            }
        }
    }
}

/// Squared length, m^2; not finite where products with it would not be.
fn squared(vector_m: &[f32; 3]) -> f32 {
    vector_m.iter().map(|x| x * x).sum()
}

/// When a forecast that is made at `time_us` is due.
fn due_us(time_us: u64) -> u64 {
    time_us.saturating_add(AHEAD_US).min(NEVER - 1)
}

#[cfg(test)]
mod tests;
