//! The correction of a predicted state with a measurement, and the gate before it.

use super::curvature::curvature;
use super::state::{Covariance, State};
use crate::ekf::{Corrected, correct_polar};
use crate::measurement::Vectors;
use crate::scalar::Scalar;

/// Normalised innovation squared (four degrees of freedom) beyond which a measurement is not used:
/// eight standard deviations. Chance (chi-square) would pass 40 once in 20 million; the rest is room
/// for jumps of real targets, which a tighter gate makes the filter lose.
pub const GATE_NIS: f64 = 64.0;

/// Corrects a predicted state in place with what was measured of elevation, azimuth, range and
/// range-rate; `scale` multiplies their variances (angles, range, range-rate), and the curvature adds
/// to them. Returns the whitened innovations (see [`correct_polar`]). Nothing is gated or checked.
// Once in flash, and with a frame that its callers' do not hold.
#[inline(never)]
pub fn correct<S: Scalar>(
    corrected: &mut Corrected<S, 9>,
    vectors: &Vectors<S>,
    scale: [S; 3],
) -> [S; 4] {
    let variances = variances(&corrected.state, &corrected.covariance, vectors, scale);
    correct_polar(corrected, vectors, &variances)
}

/// [`correct`]; `None` where single precision overflows, or rounding spoils it.
pub fn correct_soundly(
    corrected: &mut Corrected<f32, 9>,
    vectors: &Vectors<f32>,
    scale: [f32; 3],
) -> Option<[f32; 4]> {
    let whitened = correct(corrected, vectors, scale);
    corrected.check().ok()?;
    Some(whitened)
}

/// Variances of what a state expects to be measured: the sensor's own, scaled, and the curvature's.
// The curvature's frame is gone before the correction needs one.
#[inline(never)]
fn variances<S: Scalar>(
    state: &State<S>,
    covariance: &Covariance<S>,
    vectors: &Vectors<S>,
    scale: [S; 3],
) -> [S; 4] {
    let curvature = curvature(state, covariance);
    let [angles, range, range_rate] = scale;
    let scale = [angles, angles, range, range_rate];
    core::array::from_fn(|i| vectors.sigmas[i] * vectors.sigmas[i] * scale[i] + curvature[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATE: State<f64> = [12.0, -21.0, 9.0, 1.5, -0.7, 0.4, 0.3, 0.2, -0.1];

    fn covariance() -> Covariance<f64> {
        let mut matrix = [[0.0; 9]; 9];
        for i in 0..9 {
            for j in 0..9 {
                matrix[i][j] = 0.08 * ((i * j) as f64 * 0.7).cos() / (1.0 + i.abs_diff(j) as f64);
            }
            matrix[i][i] += 0.6;
        }
        matrix
    }

    fn expected() -> [f64; 4] {
        crate::radar::predict([12.0, -21.0, 9.0], [1.5, -0.7, 0.4]).measurement
    }

    #[test]
    fn the_noise_is_the_sensors_times_the_scale_and_the_curvature() {
        let (sigmas, scale) = ([0.05, 0.04, 2.0, 0.3], [1.5, 0.5, 3.0]);
        let mut measured = expected();
        measured[0] += 0.03;
        measured[2] -= 1.0;
        let vectors = Vectors::whole(measured, sigmas);
        let mut got = Corrected::before(&STATE, &covariance());
        correct(&mut got, &vectors, scale);
        let curvature = curvature(&STATE, &covariance());
        let variances = [
            0.0025 * 1.5 + curvature[0],
            0.0016 * 1.5 + curvature[1],
            4.0 * 0.5 + curvature[2],
            0.09 * 3.0 + curvature[3],
        ];
        let mut plain = Corrected::before(&STATE, &covariance());
        correct_polar(&mut plain, &vectors, &variances);
        for i in 0..9 {
            assert!((got.state[i] - plain.state[i]).abs() < 1e-12);
            assert!((got.covariance[i][i] - plain.covariance[i][i]).abs() < 1e-12);
        }
        assert!(curvature.iter().all(|c| *c > 0.0));
    }

    #[test]
    fn the_gate_is_eight_deviations() {
        let mut vectors = Vectors::whole(expected(), [0.05, 0.04, 2.0, 0.3]);
        let mut corrected = Corrected::before(&STATE, &covariance());
        correct(&mut corrected, &vectors, [1.0; 3]);
        assert!(corrected.nis < 1e-12);
        vectors.measured[2] += 60.0;
        let mut corrected = Corrected::before(&STATE, &covariance());
        let whitened = correct(&mut corrected, &vectors, [1.0; 3]);
        assert!(corrected.nis > GATE_NIS && whitened[2] > GATE_NIS.sqrt());
    }
}
