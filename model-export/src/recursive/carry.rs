//! What one flight carries from one filter step to the next, and its numbers in a row.

use crate::scoring::step_score::StepScore;
use bnkf::measurement::Vectors;
use bnkf::recursive::hypotheses::HYPOTHESES;
use bnkf::recursive::memory::{MEANS, Memory, NOTES};
use bnkf::recursive::population::Population;
use bnkf::recursive::start::start;
use bnkf::recursive::state::{Covariance, State};
use bnkf::scalar::Scalar;
use nalgebra::{Matrix3, Vector3};

/// Position, velocity and acceleration, three numbers each.
pub const STATE: usize = 9;
/// Entries on and below the diagonal of the state covariance.
pub const COVARIANCE: usize = STATE * (STATE + 1) / 2;
/// Elevation, azimuth, range and range-rate.
pub const MEASUREMENT: usize = 4;
/// Numbers in a [`Carry`].
pub const CARRY: usize = STATE + COVARIANCE + 4 * MEASUREMENT + 2 + 3 * MEANS + NOTES + HYPOTHESES;

/// Filter state, its covariance and the statistics that the network reads.
///
/// Frame: x east, y north, z up, radar at the origin; metres, seconds, radians.
#[derive(Clone, Copy, Debug)]
pub struct Carry<S> {
    /// Position (m), velocity (m/s), acceleration (m/s^2).
    pub state: State<S>,
    /// Covariance of `state`; both triangles hold the same numbers.
    pub covariance: Covariance<S>,
    /// Statistics of the flight so far.
    pub memory: Memory<S>,
}

impl Carry<f64> {
    /// What the position is worth beside the true one, metres.
    pub fn score(&self, truth_m: [f64; 3]) -> StepScore {
        let position_m = Vector3::from_fn(|axis, _| self.state[axis]);
        let covariance_m2 = Matrix3::from_fn(|row, column| self.covariance[row][column]);
        StepScore::new(&position_m, &covariance_m2, &truth_m.into()).unwrap_or(StepScore::UNUSABLE)
    }
}

impl<S: Scalar> Carry<S> {
    /// The first step: a measurement, with an azimuth at least.
    pub fn start(vectors: &Vectors<S>, population: &Population<S>) -> Self {
        let (state, covariance) = start(vectors, population);
        Self {
            state,
            covariance,
            memory: Memory::start(
                population.sigmas_of(vectors),
                [state[3], state[4], state[5]],
            ),
        }
    }

    /// Every number in a fixed order; the covariance by rows of its lower triangle.
    pub fn flatten(&self) -> Vec<S> {
        let mut flat = Vec::with_capacity(CARRY);
        flat.extend(self.state);
        for row in 0..STATE {
            flat.extend(&self.covariance[row][..=row]);
        }
        let memory = &self.memory;
        flat.extend(memory.innovation);
        flat.extend(memory.drift);
        flat.extend(memory.squares);
        flat.extend(memory.ln_sigmas);
        flat.extend([memory.coast_s, memory.age_s]);
        flat.extend(memory.velocity_means.iter().flatten());
        flat.extend(memory.notes);
        flat.extend(memory.counts);
        flat
    }

    /// The inverse of [`Self::flatten`].
    ///
    /// # Panics
    /// When `flat` is shorter than [`CARRY`].
    pub fn unflatten(flat: &[S]) -> Self {
        let mut rest = flat.iter().copied();
        let mut next = || match rest.next() {
            Some(number) => number,
            None => panic!("a carry holds {CARRY} numbers"),
        };
        let state = core::array::from_fn(|_| next());
        let mut covariance = [[S::constant(0.0); STATE]; STATE];
        for row in 0..STATE {
            for column in 0..=row {
                covariance[row][column] = next();
                covariance[column][row] = covariance[row][column];
            }
        }
        Self {
            state,
            covariance,
            memory: Memory {
                innovation: core::array::from_fn(|_| next()),
                drift: core::array::from_fn(|_| next()),
                squares: core::array::from_fn(|_| next()),
                ln_sigmas: core::array::from_fn(|_| next()),
                coast_s: next(),
                age_s: next(),
                velocity_means: core::array::from_fn(|_| core::array::from_fn(|_| next())),
                notes: core::array::from_fn(|_| next()),
                counts: core::array::from_fn(|_| next()),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flattening_loses_nothing() {
        let flat: Vec<f64> = (0..CARRY).map(|i| i as f64).collect();
        let carry = Carry::unflatten(&flat);
        assert_eq!(carry.flatten(), flat);
        assert_eq!(carry.covariance[2][7], carry.covariance[7][2]);
    }
}
