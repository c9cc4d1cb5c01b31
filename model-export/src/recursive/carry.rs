//! What one flight carries from one filter step to the next.

use super::scalar::Scalar;

/// Position, velocity and acceleration, three numbers each.
pub const STATE: usize = 9;
/// Entries on and below the diagonal of the state covariance.
pub const COVARIANCE: usize = STATE * (STATE + 1) / 2;
/// Elevation, azimuth, range and range-rate.
pub const MEASUREMENT: usize = 4;
/// Running means of the velocity.
pub const MEANS: usize = 4;
/// Numbers that the network writes for itself to read at the next step.
pub const MEMORY: usize = 9;
/// Numbers in a [`Carry`].
pub const CARRY: usize = STATE + COVARIANCE + 4 * MEASUREMENT + 2 + 3 * MEANS + MEMORY;

/// Time constants of the running means of the velocity, seconds.
pub const MEAN_TIMES_S: [f64; MEANS] = [0.25, 0.7, 2.0, 6.0];
/// Time constants of the network's own memory, seconds.
pub const MEMORY_TIMES_S: [f64; MEMORY] = [0.1, 0.15, 0.25, 0.4, 0.7, 1.1, 1.8, 3.0, 5.0];

/// Filter state, its covariance and the statistics that the network reads.
///
/// Frame: x east, y north, z up, radar at the origin; metres, seconds, radians.
#[derive(Clone, Copy, Debug)]
pub struct Carry<S> {
    /// Position [m], velocity [m/s], acceleration [m/s^2].
    pub state: [S; STATE],
    /// Covariance of `state`; both triangles hold the same numbers.
    pub covariance: [[S; STATE]; STATE],
    /// Last innovation (elevation, azimuth, range, range-rate) whitened by the Cholesky factor of
    /// its covariance; fades while nothing is measured.
    pub innovation: [S; MEASUREMENT],
    /// Running mean of `innovation` over measurements.
    pub drift: [S; MEASUREMENT],
    /// Running mean over measurements of the squares of `innovation`; one is honest.
    pub squares: [S; MEASUREMENT],
    /// Natural logarithm of the last measurement's sigmas (rad, rad, m, m/s).
    pub ln_sigmas: [S; MEASUREMENT],
    /// Time since the last measurement, seconds.
    pub coast_s: S,
    /// Time since the first measurement, seconds.
    pub age_s: S,
    /// Running means of the velocity with the times [`MEAN_TIMES_S`], m/s.
    pub velocity_means: [[S; 3]; MEANS],
    /// Running means of the network's memory outputs with the times [`MEMORY_TIMES_S`].
    pub memory: [S; MEMORY],
}

impl<S: Scalar> Carry<S> {
    /// Every number in a fixed order; the covariance by rows of its lower triangle.
    pub fn flatten(&self) -> Vec<S> {
        let mut flat = Vec::with_capacity(CARRY);
        flat.extend(self.state);
        for row in 0..STATE {
            flat.extend(&self.covariance[row][..=row]);
        }
        flat.extend(self.innovation);
        flat.extend(self.drift);
        flat.extend(self.squares);
        flat.extend(self.ln_sigmas);
        flat.extend([self.coast_s, self.age_s]);
        flat.extend(self.velocity_means.iter().flatten());
        flat.extend(self.memory);
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
            innovation: core::array::from_fn(|_| next()),
            drift: core::array::from_fn(|_| next()),
            squares: core::array::from_fn(|_| next()),
            ln_sigmas: core::array::from_fn(|_| next()),
            coast_s: next(),
            age_s: next(),
            velocity_means: core::array::from_fn(|_| core::array::from_fn(|_| next())),
            memory: core::array::from_fn(|_| next()),
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
