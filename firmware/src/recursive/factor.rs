//! What the network says about where the target is and how it moves, beside how it will move.
//!
//! A motion model forgets the population after the first measurement; a factor does not. It says of
//! five numbers (horizontal range, height, and velocity along the level line of sight: radial,
//! lateral, vertical) that they lie near the population's, shifted by so many of its deviations, and
//! how much that counts for a tenth of a second. The estimate is the product of the prediction, the
//! factor and the likelihood; the paper's filter, in which the network's answer replaces the
//! prediction, is the limit of a factor whose weight grows without bound.
//!
//! Far from the population the network knows nothing of places, and the factor lets go.

use super::population::Population;
use super::sight::LineOfSight;
use super::state::{Covariance, State};
use crate::ekf::subtract_outer;
use crate::scalar::Scalar;

/// Numbers that a factor is about.
pub const FACTORS: usize = 5;
/// Outputs of the network that are a factor: shift and weight of each number.
pub const FACTOR_OUTPUTS: usize = 2 * FACTORS;
/// Largest shift, in deviations of the population.
const SHIFT_MAX: f64 = 5.0;
/// Bounds of the logarithm of a weight.
const LN_WEIGHT: (f64, f64) = (-11.0, 3.0);
/// Logarithm of the weight where the network answers zero.
const LN_WEIGHT_ZERO: f64 = -5.0;
/// Time that weights count for, s.
const WEIGHT_TIME_S: f64 = 0.1;
/// Deviations of the population at which the factor's weight is halved.
const PRESENCE_SIGMAS: f64 = 2.6;
/// Deviations over [`PRESENCE_SIGMAS`] beyond which they are counted no further.
const FAR: f64 = 32.0;

/// A Gaussian factor on [`FACTORS`] linear functions of the state.
#[derive(Clone, Copy, Debug)]
pub struct Factor<S> {
    /// Shift of every mean, in deviations of the population.
    pub shifts: [S; FACTORS],
    /// Weight of every number for a tenth of a second: one is worth one draw from the population.
    pub weights: [S; FACTORS],
}

impl<S: Scalar> Factor<S> {
    /// Reads a factor from [`FACTOR_OUTPUTS`] outputs of the network, which are clamped.
    pub fn read(outputs: &[S]) -> Self {
        Self {
            shifts: core::array::from_fn(|i| outputs[2 * i].clamp(-SHIFT_MAX, SHIFT_MAX)),
            weights: core::array::from_fn(|i| {
                let ln = outputs[2 * i + 1] + S::constant(LN_WEIGHT_ZERO);
                ln.clamp(LN_WEIGHT.0, LN_WEIGHT.1).exp()
            }),
        }
    }

    /// Fuses the factor with a prediction over `dt_s`, one number after the other.
    pub fn fuse(
        &self,
        state: &mut State<S>,
        covariance: &mut Covariance<S>,
        population: &Population<S>,
        dt_s: S,
    ) {
        let c = S::constant;
        let zero = c(0.0);
        let sight = LineOfSight::to([state[0], state[1], state[2]]);
        let radial = [sight.cosine, sight.sine, zero];
        let lateral = [-sight.sine, sight.cosine, zero];
        let upward = [zero, zero, c(1.0)];
        let p = population;
        let numbers = [
            (false, radial, p.horizontal_m, p.horizontal_sigma_m),
            (false, upward, p.height_m, p.height_sigma_m),
            (true, radial, zero, p.horizontal_sigma_mps),
            (true, lateral, zero, p.horizontal_sigma_mps),
            (true, upward, zero, p.vertical_sigma_mps),
        ];
        let present = presence(state, &sight, population) * dt_s * c(1.0 / WEIGHT_TIME_S);
        for (i, (of_velocity, axis, mean, sigma)) in numbers.into_iter().enumerate() {
            let along = |x: &[S; 9]| {
                let [px, py, pz, vx, vy, vz, ..] = *x;
                let [x, y, z] = if of_velocity {
                    [vx, vy, vz]
                } else {
                    [px, py, pz]
                };
                axis[0] * x + axis[1] * y + axis[2] * z
            };
            // A symmetric covariance has its rows as columns.
            let cross: [S; 9] = core::array::from_fn(|row| along(&covariance[row]));
            let weight = self.weights[i] * present;
            let per_variance = weight / (weight * along(&cross) + sigma * sigma);
            let away = mean + self.shifts[i] * sigma - along(state);
            let gain = cross.map(|cross| cross * per_variance);
            for (value, gain) in state.iter_mut().zip(gain) {
                *value = *value + gain * away;
            }
            subtract_outer(covariance, &gain, &cross);
        }
    }
}

/// One inside the population, zero far outside.
fn presence<S: Scalar>(state: &State<S>, sight: &LineOfSight<S>, population: &Population<S>) -> S {
    let horizontal = sight.cosine * state[0] + sight.sine * state[1];
    let sixteenth_power = |value: S, mean: S, sigma: S| {
        let z = (value - mean) / (sigma * S::constant(PRESENCE_SIGMAS));
        let squared = {
            let z = z.clamp(-FAR, FAR);
            z * z
        };
        let fourth = squared * squared;
        let eighth = fourth * fourth;
        eighth * eighth
    };
    let p = population;
    let one = S::constant(1.0);
    one / (one
        + sixteenth_power(horizontal, p.horizontal_m, p.horizontal_sigma_m)
        + sixteenth_power(state[2], p.height_m, p.height_sigma_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recursive::state::tests::covariance;
    use nalgebra::{SMatrix, SVector};

    const P: Population<f64> = Population::PAPER;

    /// 30 m away to the south-west, 14 m up: inside the population.
    const INSIDE: State<f64> = [-18.0, -24.0, 14.0, 1.0, -0.5, 0.2, 0.3, 0.1, -0.2];

    fn outputs() -> [f64; FACTOR_OUTPUTS] {
        [0.5, 6.0, -0.3, 5.5, 1.0, 7.0, -1.5, 5.0, 0.2, 6.5]
    }

    /// The product of Gaussians in information form, as one joint update.
    #[test]
    fn fusing_is_the_product_of_gaussians() {
        let (mut state, mut matrix) = (INSIDE, covariance(3));
        let prior = SMatrix::<f64, 9, 9>::from_fn(|i, j| matrix[i][j]);
        let factor = Factor::read(&outputs());
        let dt_s = 0.2;
        let sight = LineOfSight::to([state[0], state[1], state[2]]);
        let present = presence(&state, &sight, &P);
        assert!(present > 0.95);
        let mut rows = SMatrix::<f64, 5, 9>::zeros();
        let (c, s) = (-0.6, -0.8);
        for (row, block) in [(0, 0), (2, 3)] {
            (rows[(row, block)], rows[(row, block + 1)]) = (c, s);
        }
        rows[(1, 2)] = 1.0;
        (rows[(3, 3)], rows[(3, 4)]) = (-s, c);
        rows[(4, 5)] = 1.0;
        let means = [P.horizontal_m, P.height_m, 0.0, 0.0, 0.0];
        let sigmas = [
            P.horizontal_sigma_m,
            P.height_sigma_m,
            P.horizontal_sigma_mps,
            P.horizontal_sigma_mps,
            P.vertical_sigma_mps,
        ];
        let target = SVector::<f64, 5>::from_fn(|i, _| means[i] + factor.shifts[i] * sigmas[i]);
        let precision = SMatrix::<f64, 5, 5>::from_fn(|i, j| {
            if i == j {
                factor.weights[i] * present * 2.0 / (sigmas[i] * sigmas[i])
            } else {
                0.0
            }
        });
        let information = prior.try_inverse().expect("definite");
        let posterior = (information + rows.transpose() * precision * rows)
            .try_inverse()
            .expect("definite");
        let x = SVector::<f64, 9>::from_row_slice(&state);
        let expected = posterior * (information * x + rows.transpose() * precision * target);
        factor.fuse(&mut state, &mut matrix, &P, dt_s);
        for i in 0..9 {
            assert!((state[i] - expected[i]).abs() < 1e-9, "{i}");
            for j in 0..9 {
                assert!((matrix[i][j] - posterior[(i, j)]).abs() < 1e-9, "{i} {j}");
            }
        }
    }

    #[test]
    fn without_weight_nothing_changes() {
        let (mut state, mut matrix) = (INSIDE, covariance(3));
        let factor = Factor {
            shifts: [1.0; FACTORS],
            weights: [0.0; FACTORS],
        };
        factor.fuse(&mut state, &mut matrix, &P, 0.1);
        assert_eq!(state, INSIDE);
        assert_eq!(matrix, covariance(3));
    }

    #[test]
    fn outside_the_population_it_lets_go() {
        let strong = Factor {
            shifts: [0.0; FACTORS],
            weights: [20.0; FACTORS],
        };
        let moved = |place: [f64; 3]| {
            let mut state = INSIDE;
            state[..3].copy_from_slice(&place);
            let before = state;
            let mut matrix = covariance(3);
            strong.fuse(&mut state, &mut matrix, &P, 0.1);
            (0..9).fold(0.0, |m: f64, i| m.max((state[i] - before[i]).abs()))
        };
        assert!(moved([-18.0, -24.0, 20.0]) > 0.1);
        for far in [[200.0, 0.0, 14.0], [-18.0, -24.0, 150.0], [0.1, 0.0, -90.0]] {
            assert!(moved(far) < 1e-3, "{far:?}");
        }
        assert!(moved([1e7, -1e7, 1e7]) < 1e-3);
        let mut far = INSIDE.map(|x| x as f32);
        (far[0], far[2]) = (9e6, -9e6);
        let single: Covariance<f32> = covariance(3).map(|row| row.map(|x| x as f32));
        let mut matrix = single;
        let population = P.known::<f32>();
        Factor {
            shifts: [5.0; FACTORS],
            weights: [20.0; FACTORS],
        }
        .fuse(&mut far, &mut matrix, &population, 0.1);
        assert!(far.iter().all(|x| x.is_finite()));
        assert_eq!(far[0], 9e6);
    }

    #[test]
    fn outputs_have_their_places_and_bounds() {
        let factor = Factor::read(&outputs());
        assert_eq!(factor.shifts, [0.5, -0.3, 1.0, -1.5, 0.2]);
        for (weight, ln) in factor.weights.into_iter().zip([1.0, 0.5, 2.0, 0.0, 1.5]) {
            assert!((weight - f64::exp(ln)).abs() < 1e-12);
        }
        let wild = Factor::read(&[1e30; FACTOR_OUTPUTS]);
        assert_eq!(wild.shifts, [5.0; FACTORS]);
        assert!((wild.weights[0] - 3.0_f64.exp()).abs() < 1e-12);
        let wild = Factor::read(&[-1e30_f64; FACTOR_OUTPUTS]);
        assert_eq!(wild.shifts, [-5.0; FACTORS]);
        assert!((wild.weights[4] - (-11.0_f64).exp()).abs() < 1e-12);
    }

    /// Two halves of an interval weigh as much as the whole.
    #[test]
    fn weights_are_per_time() {
        let factor = Factor {
            shifts: [0.0; FACTORS],
            weights: [0.3; FACTORS],
        };
        let (mut whole, mut whole_matrix) = (INSIDE, covariance(3));
        factor.fuse(&mut whole, &mut whole_matrix, &P, 0.1);
        let (mut parts, mut parts_matrix) = (INSIDE, covariance(3));
        factor.fuse(&mut parts, &mut parts_matrix, &P, 0.05);
        factor.fuse(&mut parts, &mut parts_matrix, &P, 0.05);
        for i in 0..9 {
            // The line of sight turns a little between the halves.
            assert!((whole[i] - parts[i]).abs() < 2e-3, "{i}");
            assert!(
                (whole_matrix[i][i] - parts_matrix[i][i]).abs() < 2e-3,
                "{i}"
            );
        }
    }

    /// The sixteenth power of the deviations, counted in 2.6 of the population's.
    #[test]
    fn presence_is_what_its_formula_says() {
        for state in [INSIDE, [40.0, 9.0, 24.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]] {
            let sight = LineOfSight::to([state[0], state[1], state[2]]);
            let z = [
                (state[0].hypot(state[1]) - P.horizontal_m) / (2.6 * P.horizontal_sigma_m),
                (state[2] - P.height_m) / (2.6 * P.height_sigma_m),
            ];
            let expected = 1.0 / (1.0 + z[0].powi(16) + z[1].powi(16));
            assert!((presence(&state, &sight, &P) - expected).abs() < 1e-12);
        }
    }
}
