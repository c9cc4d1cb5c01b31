//! The correction step of the extended Kalman filter.
//!
//! Two readings of one measurement: the paper's linear correction with the converted position
//! (Eq. 12-13 with H = I), and the native polar one, where range-rate joins if the state has a
//! velocity. A measurement is taken in one component after the other, each a scalar correction that
//! costs the covariance the outer product of one vector, so it stays symmetric to the bit; what
//! cannot be corrected is refused, never repaired in silence.

use crate::measurement::Vectors;
use crate::radar::{Converted, innovations, predict};
use crate::scalar::Scalar;

/// Why a correction was refused; the state is unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum EkfError {
    /// The prior, or the result, is NaN or infinite.
    NotFinite,
    /// The innovation covariance, or the corrected covariance, is not positive definite.
    NotPositiveDefinite,
}

impl core::fmt::Display for EkfError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "state or covariance is not finite",
            Self::NotPositiveDefinite => "covariance is not positive definite",
        })
    }
}

impl core::error::Error for EkfError {}

/// State and covariance after a correction of an `N`-dimensional state.
#[derive(Clone, Copy, Debug)]
pub struct Corrected<S, const N: usize> {
    /// Mean.
    pub state: [S; N],
    /// Covariance, symmetric.
    pub covariance: [[S; N]; N],
    /// Normalised innovation squared, `y' S^-1 y`.
    pub nis: S,
    /// Half the logarithm of the determinant of `S`, the innovation's covariance.
    pub ln_root: S,
}

impl<S: Scalar, const N: usize> Corrected<S, N> {
    /// Room for one.
    #[inline]
    pub fn new() -> Self {
        let zero = S::constant(0.0);
        Self {
            state: [zero; N],
            covariance: [[zero; N]; N],
            nis: zero,
            ln_root: zero,
        }
    }

    /// A state before anything corrected it.
    pub fn before(state: &[S; N], covariance: &[[S; N]; N]) -> Self {
        let mut corrected = Self::new();
        corrected.begin(state, covariance);
        corrected
    }

    /// Makes it a state that nothing corrected yet.
    // As slices: an assignment would go by a second one on the stack, as [`Corrected::before`] does.
    #[inline]
    pub fn begin(&mut self, state: &[S; N], covariance: &[[S; N]; N]) {
        self.state.copy_from_slice(state);
        self.covariance.copy_from_slice(covariance);
        self.nis = S::constant(0.0);
        self.ln_root = S::constant(0.0);
    }
}

impl<S: Scalar, const N: usize> Default for Corrected<S, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Corrected<f32, N> {
    /// Checks that neither rounding nor overflow spoiled it.
    ///
    /// # Errors
    /// [`EkfError`]
    pub fn check(&self) -> Result<(), EkfError> {
        let numbers = self.state.iter().chain(self.covariance.as_flattened());
        if !numbers.into_iter().all(|value| value.is_finite()) {
            return Err(EkfError::NotFinite);
        }
        // An innovation's variance below zero has no root; rounding may have eaten a variance that
        // the noise made tiny.
        if self.nis.is_nan() || (0..N).any(|i| self.covariance[i][i] <= 0.0) {
            return Err(EkfError::NotPositiveDefinite);
        }
        if self.nis.is_infinite() {
            return Err(EkfError::NotFinite);
        }
        Ok(())
    }
}

/// Least variance of a measured position along one axis, m^2: a millimetre.
const AXIS_VARIANCE_MIN_M2: f32 = 1e-6;
/// Least variance of a measurement's noise, as a part of what the state already doubts it by: below
/// it rounding in single precision would decide the corrected variance.
pub const NOISE_MIN_PART: f64 = 1e-5;

/// Corrects a position with a measured one (paper Eq. 12-13, H = I).
///
/// `position` m, `covariance` m^2. The errors of a converted measurement are independent along
/// three axes, so three scalar corrections in turn equal the joint one and need no inverse, which a
/// noisy range near zero would make ill-conditioned.
///
/// # Errors
/// [`EkfError`]; the inputs are untouched.
pub(crate) fn correct_position(
    position: [f32; 3],
    covariance: [[f32; 3]; 3],
    measured: &Converted,
) -> Result<Corrected<f32, 3>, EkfError> {
    let mut corrected = Corrected::before(&position, &covariance);
    for (axis, sigma) in measured.axes.iter().zip(measured.sigmas_m) {
        let axis: [f32; 3] = (*axis).into();
        let noise = (sigma * sigma).max(AXIS_VARIANCE_MIN_M2);
        let away = core::array::from_fn(|i| measured.position[i] - corrected.state[i]);
        correct_scalar(&mut corrected, &axis, dot(&axis, &away), noise, 1.0);
    }
    corrected.check()?;
    Ok(corrected)
}

/// Corrects a state that starts with position (m) and, if `N >= 6`, velocity (m/s), with the
/// polar measurement itself: elevation, azimuth, range and, with a velocity, range-rate, whose
/// noise has these variances. A channel that is not present changes nothing. In place: what was
/// before is [`Corrected::before`].
///
/// The Jacobian is taken at the prior. Because the noise is independent per component, the four
/// scalar corrections in turn equal the joint one. Returns the innovations whitened in turn, each
/// over its standard deviation given the ones before, whose squares sum to the NIS. Nothing is
/// checked: see [`Corrected::check`].
pub fn correct_polar<S: Scalar, const N: usize>(
    corrected: &mut Corrected<S, N>,
    vectors: &Vectors<S>,
    variances: &[S; 4],
) -> [S; 4] {
    const {
        assert!(
            N == 3 || N >= 6,
            "a state is a position, or starts with position and velocity"
        )
    };
    let zero = S::constant(0.0);
    let has_velocity = N >= 6;
    let state = corrected.state;
    let velocity = core::array::from_fn(|i| {
        if has_velocity {
            state[(3 + i) % N]
        } else {
            zero
        }
    });
    let predicted = predict([state[0], state[1], state[2]], velocity);
    let innovations = innovations(vectors, &predicted.measurement);
    let mut whitened = [zero; 4];
    for row in 0..if has_velocity { 4 } else { 3 } {
        let mut derivative = [zero; N];
        derivative[..3].copy_from_slice(&predicted.by_position[row]);
        if row == 3 {
            for axis in 0..3 {
                derivative[(3 + axis) % N] = predicted.by_velocity[axis];
            }
        }
        let moved = core::array::from_fn(|i| corrected.state[i] - state[i]);
        let innovation = innovations[row] - dot(&derivative, &moved);
        let present = vectors.present[row];
        whitened[row] = correct_scalar(corrected, &derivative, innovation, variances[row], present);
    }
    whitened
}

/// One scalar correction, `P - g g' / s` with `g = P h` and `s = h' g + r`, which equals Joseph's form
/// in exact arithmetic, or none where `present` is zero; returns the innovation over its standard
/// deviation, which is not a number where the innovation's variance is not positive.
fn correct_scalar<S: Scalar, const N: usize>(
    corrected: &mut Corrected<S, N>,
    derivative: &[S; N],
    innovation: S,
    noise: S,
    present: S,
) -> S {
    let cross = times(&corrected.covariance, derivative);
    let spread = dot(derivative, &cross);
    let innovation_variance = spread + noise.max(S::constant(NOISE_MIN_PART) * spread);
    let weight = present / innovation_variance;
    let gain = cross.map(|cross| cross * weight);
    for (value, gain) in corrected.state.iter_mut().zip(gain) {
        *value = *value + gain * innovation;
    }
    subtract_outer(&mut corrected.covariance, &gain, &cross);
    let deviation = innovation_variance.sqrt();
    let whitened = present * innovation / deviation;
    corrected.ln_root = corrected.ln_root + present * deviation.ln();
    corrected.nis = corrected.nis + whitened * whitened;
    whitened
}

/// Takes the outer product of `gain` and `cross`, which are parallel, off a symmetric matrix.
pub(crate) fn subtract_outer<S: Scalar, const N: usize>(
    matrix: &mut [[S; N]; N],
    gain: &[S; N],
    cross: &[S; N],
) {
    for i in 0..N {
        for j in i..N {
            let value = matrix[i][j] - gain[i] * cross[j];
            matrix[i][j] = value;
            matrix[j][i] = value;
        }
    }
}

/// A symmetric matrix times a vector.
fn times<S: Scalar, const N: usize>(matrix: &[[S; N]; N], x: &[S; N]) -> [S; N] {
    core::array::from_fn(|row| {
        let mut sum = matrix[row][0] * x[0];
        for k in 1..N {
            sum = sum + matrix[row][k] * x[k];
        }
        sum
    })
}

/// Inner product.
pub(crate) fn dot<S: Scalar, const N: usize>(a: &[S; N], b: &[S; N]) -> S {
    let mut sum = a[0] * b[0];
    for k in 1..N {
        sum = sum + a[k] * b[k];
    }
    sum
}

#[cfg(test)]
mod tests;
