//! The variational posterior: an independent Gaussian for every weight and bias.

use crate::posterior::architecture::Architecture;
use crate::random_source::RandomSource;

/// Means and standard deviations of all weights and biases of a network, in the flat order of
/// [`Architecture::layers`].
#[derive(Clone, Debug, PartialEq)]
pub struct GaussianWeights {
    /// Shape of the network.
    pub architecture: Architecture,
    /// Means.
    pub means: Vec<f32>,
    /// Natural logarithms of the standard deviations.
    pub log_sigmas: Vec<f32>,
}

impl GaussianWeights {
    /// Means uniform within `1 / sqrt(inputs)` of zero, as is usual for dense layers, and every
    /// standard deviation `sigma`.
    #[must_use]
    pub fn random(architecture: &Architecture, sigma: f32, random: &mut RandomSource) -> Self {
        let mut means = vec![0.0; architecture.parameters()];
        for shape in architecture.layers() {
            let bound = 1.0 / (shape.inputs as f64).sqrt();
            for mean in &mut means[shape.start..shape.end()] {
                *mean = random.uniform(-bound, bound) as f32;
            }
        }
        Self {
            architecture: architecture.clone(),
            log_sigmas: vec![sigma.ln(); means.len()],
            means,
        }
    }

    /// Divergence KL(posterior || N(0, prior_sigma^2)) summed over all weights and biases, nats.
    #[must_use]
    pub fn divergence(&self, prior_sigma: f64) -> f64 {
        let prior_variance = prior_sigma * prior_sigma;
        self.means
            .iter()
            .zip(&self.log_sigmas)
            .map(|(&mean, &log_sigma)| {
                let (mean, log_sigma) = (f64::from(mean), f64::from(log_sigma));
                let spread = ((2.0 * log_sigma).exp() + mean * mean) / prior_variance;
                prior_sigma.ln() - log_sigma + 0.5 * (spread - 1.0)
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::GaussianWeights;
    use crate::posterior::architecture::Architecture;
    use crate::random_source::RandomSource;

    #[test]
    fn initial_means_fill_their_bounds_and_sigmas_are_as_asked() {
        let architecture = Architecture::new(vec![16, 64, 3]).unwrap();
        let weights = GaussianWeights::random(&architecture, 0.01, &mut RandomSource::new(1, &[]));
        let (first, second) = weights.means.split_at(architecture.layers()[1].start);
        let largest = |values: &[f32]| values.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
        assert!((0.24..=0.25).contains(&largest(first)));
        assert!((0.115..=0.125).contains(&largest(second)));
        assert!(
            weights
                .log_sigmas
                .iter()
                .all(|s| (s.exp() - 0.01).abs() < 1e-8)
        );
    }

    #[test]
    fn divergence_is_the_mean_log_ratio_of_the_densities() {
        let architecture = Architecture::new(vec![2, 2, 1]).unwrap();
        let mut random = RandomSource::new(5, &[]);
        let mut weights = GaussianWeights::random(&architecture, 0.3, &mut random);
        for log_sigma in &mut weights.log_sigmas {
            *log_sigma += random.uniform(-0.5, 0.5) as f32;
        }
        let prior_sigma = 0.5;
        let log_density =
            |x: f64, mean: f64, sigma: f64| -sigma.ln() - 0.5 * ((x - mean) / sigma).powi(2);
        let draws = 200_000;
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..draws {
            let mut ratio = 0.0;
            for (&mean, &log_sigma) in weights.means.iter().zip(&weights.log_sigmas) {
                let (mean, sigma) = (f64::from(mean), f64::from(log_sigma).exp());
                let x = mean + sigma * random.normal();
                ratio += log_density(x, mean, sigma) - log_density(x, 0.0, prior_sigma);
            }
            sum += ratio;
            squares += ratio * ratio;
        }
        let mean = sum / f64::from(draws);
        let error = ((squares / f64::from(draws) - mean * mean) / f64::from(draws)).sqrt();
        let exact = weights.divergence(prior_sigma);
        assert!(
            (mean - exact).abs() < 4.0 * error,
            "{mean} +- {error}, closed form {exact}"
        );
    }
}
