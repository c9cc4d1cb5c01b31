//! Sums of Gaussian beliefs: their moments, and Bayes' rule for their probabilities.

use nalgebra::{Matrix4, SMatrix, SVector, Vector4};

use super::correction::Innovation;
use super::gaussian::{Gaussian, symmetric};
use crate::filter::{FilterError, Nis};

/// One belief of a mixture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Component<const N: usize> {
    /// Probability of this belief.
    pub probability: f64,
    /// The belief.
    pub state: Gaussian<N>,
}

/// Mean and covariance of the mixture of the components' beliefs with these weights, which sum
/// to one.
pub fn moments<const N: usize>(
    components: &[Component<N>],
    weight: impl Fn(usize) -> f64,
) -> Gaussian<N> {
    let mut mean = SVector::<f64, N>::zeros();
    for (i, component) in components.iter().enumerate() {
        mean += component.state.mean * weight(i);
    }
    let mut covariance = SMatrix::<f64, N, N>::zeros();
    for (i, component) in components.iter().enumerate() {
        let away = component.state.mean - mean;
        covariance += (component.state.covariance + away * away.transpose()) * weight(i);
    }
    Gaussian {
        mean,
        covariance: symmetric(&covariance),
    }
}

/// NIS of the moments of the mixture of predicted readings; the probabilities are the predicted
/// ones.
///
/// # Errors
/// The covariance has no Cholesky factor.
pub fn nis<const N: usize>(
    components: &[Component<N>],
    innovations: &[Innovation],
) -> Result<Nis, FilterError> {
    let mut mean = Vector4::zeros();
    for (component, innovation) in components.iter().zip(innovations) {
        mean += innovation.residual * component.probability;
    }
    let mut covariance = Matrix4::zeros();
    for (component, innovation) in components.iter().zip(innovations) {
        let away = innovation.residual - mean;
        covariance += (innovation.covariance + away * away.transpose()) * component.probability;
    }
    let factor = covariance
        .cholesky()
        .ok_or(FilterError::NotPositiveDefinite)?;
    Ok(Nis {
        value: mean.dot(&factor.solve(&mean)),
        degrees: innovations.first().map_or(0, |first| first.nis.degrees),
    })
}

/// Bayes' rule: every probability times the density its belief gave the reading.
///
/// # Errors
/// No density is a number.
pub fn reweigh<const N: usize>(
    components: &mut [Component<N>],
    innovations: &[Innovation],
) -> Result<(), FilterError> {
    // Relative to the likeliest: far from the prediction every density underflows.
    let best = innovations
        .iter()
        .map(|i| i.log_likelihood)
        .fold(f64::NEG_INFINITY, f64::max);
    for (component, innovation) in components.iter_mut().zip(innovations) {
        component.probability *= (innovation.log_likelihood - best).exp();
    }
    normalise(components)
}

/// Scales the probabilities to a sum of one.
///
/// # Errors
/// They have no finite positive sum.
pub fn normalise<const N: usize>(components: &mut [Component<N>]) -> Result<(), FilterError> {
    let sum: f64 = components.iter().map(|c| c.probability).sum();
    if !(sum.is_finite() && sum > 0.0) {
        return Err(FilterError::NotFinite);
    }
    for component in components {
        component.probability /= sum;
    }
    Ok(())
}

/// How many equally likely components the mixture amounts to, 1 / sum of squares: a mixture that
/// has come down to one belief has degenerated.
pub fn effective_number<const N: usize>(components: &[Component<N>]) -> f64 {
    1.0 / components
        .iter()
        .map(|c| c.probability * c.probability)
        .sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, Vector6};

    fn component(probability: f64, x: f64, variance: f64) -> Component<6> {
        let state = Gaussian {
            mean: Vector6::new(x, 0.0, 0.0, 0.0, 0.0, 0.0),
            covariance: Matrix6::identity() * variance,
        };
        Component { probability, state }
    }

    #[test]
    fn moments_by_hand() {
        let two = [component(0.25, -2.0, 1.0), component(0.75, 2.0, 3.0)];
        let sum = moments(&two, |i| two[i].probability);
        assert!((sum.mean[0] - 1.0).abs() < 1e-15);
        // 0.25 (1 + 9) + 0.75 (3 + 1) along x, 0.25 + 0.75 x 3 elsewhere.
        assert!((sum.covariance[(0, 0)] - 5.5).abs() < 1e-14);
        assert!((sum.covariance[(1, 1)] - 2.5).abs() < 1e-14);
        assert!((effective_number(&two) - 1.6).abs() < 1e-14);
    }

    #[test]
    fn bayes_rule_survives_underflow() {
        let mut two = [component(0.5, 0.0, 1.0), component(0.5, 1.0, 1.0)];
        let of = |log_likelihood| Innovation {
            log_likelihood,
            ..Innovation::default()
        };
        assert_eq!(
            reweigh(&mut two, &[of(-5000.0), of(-5000.0 + 3.0_f64.ln())]),
            Ok(())
        );
        assert!((two[0].probability - 0.25).abs() < 1e-12);
        let lost = [of(f64::NAN), of(f64::NAN)];
        assert_eq!(reweigh(&mut two, &lost), Err(FilterError::NotFinite));
    }
}
