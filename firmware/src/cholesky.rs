//! The triangular factor of a covariance, solving with it, and what is done when there is none.

use crate::scalar::Scalar;

/// Lower factor `L` of `L L'`, reading the lower triangle. Pivots are kept above 1e-14.
pub fn cholesky<S: Scalar, const N: usize>(matrix: &[[S; N]; N]) -> [[S; N]; N] {
    let mut factor = [[S::constant(0.0); N]; N];
    for row in 0..N {
        for column in 0..=row {
            let mut rest = matrix[row][column];
            for k in 0..column {
                rest = rest - factor[row][k] * factor[column][k];
            }
            factor[row][column] = if row == column {
                rest.max(S::constant(1e-14)).sqrt()
            } else {
                rest / factor[column][column]
            };
        }
    }
    factor
}

/// Solves `L w = y`.
pub fn forward_substitute<S: Scalar, const N: usize>(factor: &[[S; N]; N], y: [S; N]) -> [S; N] {
    let mut w = y;
    for row in 0..N {
        for k in 0..row {
            w[row] = w[row] - factor[row][k] * w[k];
        }
        w[row] = w[row] / factor[row][row];
    }
    w
}

/// How far from singular a covariance must be: its smallest eigenvalue, with every variance scaled
/// to one, stays above about this. Rounding of a nine by nine factorisation in single precision is
/// at most 5e-6 so, hence whoever factorises it in single precision or better succeeds. It bounds
/// the ratio of the deviations along two axes to about 300.
pub const MARGIN: f32 = 1e-5;

/// Least variance that is kept, in the square of whatever unit.
const VARIANCE_MIN: f32 = 1e-12;

/// A covariance that is not finite, or has a variance that is not positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spoiled;

/// Whether a symmetric matrix is positive definite by a [`MARGIN`].
pub fn is_definite<const N: usize>(matrix: &[[f32; N]; N]) -> bool {
    // L D L' with the diagonal a little smaller than it is; `scaled[i][k]` is L_ik D_k.
    let mut factor = [[0.0_f32; N]; N];
    let mut scaled = [0.0_f32; N];
    let mut inverse = [0.0_f32; N];
    for row in 0..N {
        let mut pivot = matrix[row][row] - MARGIN * matrix[row][row];
        for column in 0..row {
            let mut rest = matrix[row][column];
            for k in 0..column {
                rest -= scaled[k] * factor[column][k];
            }
            scaled[column] = rest;
            factor[row][column] = rest * inverse[column];
            pivot -= rest * factor[row][column];
        }
        // Also false when anything is not a number.
        if !(pivot > 0.0 && matrix[row][row] >= VARIANCE_MIN) {
            return false;
        }
        inverse[row] = 1.0 / pivot;
    }
    inverse.iter().all(|x| x.is_finite())
}

/// Makes a covariance positive definite by a [`MARGIN`]: leaves it if it is, and otherwise widens
/// every variance, by as little as helps. So single precision cannot turn a sensor that is exact
/// along one axis and blunt along another into a covariance that is none.
///
/// # Errors
/// [`Spoiled`]: nothing can be made of it.
pub fn make_definite<const N: usize>(matrix: &mut [[f32; N]; N]) -> Result<(), Spoiled> {
    if is_definite(matrix) {
        return Ok(());
    }
    if !matrix.as_flattened().iter().all(|x| x.is_finite()) {
        return Err(Spoiled);
    }
    // At the last of these the diagonal alone outweighs any correlations up to one.
    let mut widen = MARGIN;
    while widen < 64.0 {
        for i in 0..N {
            if matrix[i][i] <= 0.0 {
                return Err(Spoiled);
            }
            matrix[i][i] += widen * matrix[i][i] + VARIANCE_MIN;
        }
        if is_definite(matrix) {
            return Ok(());
        }
        widen *= 4.0;
    }
    Err(Spoiled)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_and_its_solution_multiply_back() {
        let matrix = [[4.0, 2.0, -1.0], [2.0, 5.0, 0.5], [-1.0, 0.5, 3.0]];
        let factor = cholesky(&matrix);
        let y = [1.0, -2.0, 0.5];
        let w = forward_substitute(&factor, y);
        for row in 0..3 {
            let product: f64 = (0..3).map(|k| factor[row][k] * w[k]).sum();
            assert!((product - y[row]).abs() < 1e-14);
            for column in 0..3 {
                let product: f64 = (0..3).map(|k| factor[row][k] * factor[column][k]).sum();
                assert!((product - matrix[row][column]).abs() < 1e-14);
            }
        }
    }

    /// A random covariance, nearly flat along one direction when `small` is.
    fn random<const N: usize>(rng: &mut crate::rng::Generator, small: f32) -> [[f32; N]; N] {
        use crate::gaussian::standard_normal;
        let mut matrix = [[0.0; N]; N];
        for k in 0..N {
            let scale = if k == 0 { small } else { 1.0 };
            let direction: [f32; N] = core::array::from_fn(|_| scale * standard_normal(rng));
            for i in 0..N {
                for j in 0..N {
                    matrix[i][j] += direction[i] * direction[j];
                }
            }
        }
        matrix
    }

    #[test]
    fn what_passes_factorises_in_single_and_double_precision() {
        use nalgebra::SMatrix;
        let mut rng = crate::rng::seeded(3);
        let (mut kept, mut widened) = (0, 0);
        for round in 0..4_000 {
            let small = libm::powf(10.0, -((round % 50) as f32) * 0.1);
            let before = random::<9>(&mut rng, small);
            let mut after = before;
            make_definite(&mut after).unwrap();
            assert!(is_definite(&after));
            let single = SMatrix::<f32, 9, 9>::from_fn(|i, j| after[i][j]);
            assert!(single.cholesky().is_some(), "{small}");
            assert!(single.map(f64::from).cholesky().is_some());
            if before == after {
                kept += 1;
            } else {
                widened += 1;
                for i in 0..9 {
                    assert!(after[i][i] > before[i][i] && after[i][i] < 1.1 * before[i][i]);
                }
            }
        }
        assert!(kept > 1_000 && widened > 1_000, "{kept} {widened}");
    }

    #[test]
    fn the_margin_is_where_it_is_said_to_be() {
        let correlated = |rho: f32| [[4.0, 2.0 * rho], [2.0 * rho, 1.0]];
        assert!(is_definite(&correlated(1.0 - 2.0 * MARGIN)));
        assert!(!is_definite(&correlated(1.0 - 0.5 * MARGIN)));
        assert!(is_definite(&[[VARIANCE_MIN]]) && !is_definite(&[[0.5 * VARIANCE_MIN]]));
    }

    #[test]
    fn correlations_beyond_one_are_mended_and_nonsense_is_not() {
        let mut beyond = [[1.0, 1.5], [1.5, 1.0]];
        assert_eq!(make_definite(&mut beyond), Ok(()));
        assert!(beyond[0][0] > 1.5 && beyond[0][1] == 1.5);
        for bad in [f32::NAN, f32::INFINITY, 0.0, -1.0] {
            assert_eq!(make_definite(&mut [[1.0, 0.0], [0.0, bad]]), Err(Spoiled));
        }
        assert_eq!(
            make_definite(&mut [[1.0, f32::NAN], [f32::NAN, 1.0]]),
            Err(Spoiled)
        );
    }
}
