//! What a track is about: position, velocity and acceleration, and how sure they are.

/// Position (m), velocity (m/s), acceleration (m/s^2); east, north, up each.
pub type State<S> = [S; 9];
/// Covariance of a [`State`], symmetric.
pub type Covariance<S> = [[S; 9]; 9];

/// Sum of the position's variances, m^2.
pub fn position_variance(covariance: &Covariance<f32>) -> f32 {
    (0..3).map(|i| covariance[i][i]).sum()
}

#[cfg(test)]
#[allow(missing_docs)]
pub mod tests {
    use super::Covariance;

    /// A covariance of every shape: positive definite for any seed.
    pub fn covariance(seed: u64) -> Covariance<f64> {
        let entry =
            |i: usize, j: usize| (1.0 + seed as f64 + 2.3 * i as f64 + 0.7 * j as f64).sin();
        core::array::from_fn(|i| {
            core::array::from_fn(|j| {
                let own = if i == j { 0.5 } else { 0.0 };
                own + 0.2 * (0..9).map(|k| entry(i, k) * entry(j, k)).sum::<f64>()
            })
        })
    }
}
