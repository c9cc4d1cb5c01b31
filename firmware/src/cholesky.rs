//! The triangular factor of a covariance, and solving with it.

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
}
