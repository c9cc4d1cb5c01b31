//! How a library names the tensors of a Bayesian layer, and what it means by them.

use serde::Deserialize;

/// Libraries whose layers are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Convention {
    /// `torchbnn.BayesLinear`: a deviation is `exp(log_sigma)`.
    Torchbnn,
    /// The dense layers of `bayesian_torch`: a deviation is `softplus(rho)`.
    BayesianTorch,
}

/// What a tensor is to its layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// Means of the weights, `[output][input]`.
    WeightMean,
    /// Their deviations, as the library codes them.
    WeightSpread,
    /// Means of the biases.
    BiasMean,
    /// Their deviations.
    BiasSpread,
    /// Nothing that counts: draws and priors that some layers keep.
    Ignored,
}

impl Convention {
    /// What a tensor of this name is; `None` for a tensor of no such layer.
    #[must_use]
    pub fn role(self, name: &str) -> Option<Role> {
        use Role::{BiasMean, BiasSpread, Ignored, WeightMean, WeightSpread};
        match (self, name) {
            (Self::Torchbnn, "weight_mu") => Some(WeightMean),
            (Self::Torchbnn, "weight_log_sigma") => Some(WeightSpread),
            (Self::Torchbnn, "bias_mu") => Some(BiasMean),
            (Self::Torchbnn, "bias_log_sigma") => Some(BiasSpread),
            (Self::Torchbnn, "weight_eps" | "bias_eps") => Some(Ignored),
            (Self::BayesianTorch, "mu_weight" | "mu_kernel") => Some(WeightMean),
            (Self::BayesianTorch, "rho_weight" | "rho_kernel") => Some(WeightSpread),
            (Self::BayesianTorch, "mu_bias") => Some(BiasMean),
            (Self::BayesianTorch, "rho_bias") => Some(BiasSpread),
            (Self::BayesianTorch, "eps_weight" | "eps_kernel" | "eps_bias") => Some(Ignored),
            (Self::BayesianTorch, "prior_weight_mu" | "prior_weight_sigma") => Some(Ignored),
            (Self::BayesianTorch, "prior_bias_mu" | "prior_bias_sigma") => Some(Ignored),
            _ => None,
        }
    }

    /// The natural logarithm of the deviation that `coded` stands for.
    #[must_use]
    pub fn log_sigma(self, coded: f32) -> f32 {
        match self {
            Self::Torchbnn => coded,
            Self::BayesianTorch => {
                let rho = f64::from(coded);
                // ln softplus: far below zero softplus is exp, far above the number itself.
                let log = if rho < -30.0 {
                    rho
                } else if rho > 30.0 {
                    rho.ln()
                } else {
                    rho.exp().ln_1p().ln()
                };
                log as f32
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Convention;

    #[test]
    fn softplus_is_softplus_everywhere() {
        for rho in [-25.0_f64, -3.0, 0.0, 1.0, 20.0] {
            let expected = (1.0 + rho.exp()).ln().ln();
            let got = Convention::BayesianTorch.log_sigma(rho as f32);
            assert!((f64::from(got) - expected).abs() < 1e-4, "{rho}");
        }
        let log_sigma = |rho| Convention::BayesianTorch.log_sigma(rho);
        for seam in [-30.0_f32, 30.0] {
            let step = (log_sigma(seam + 1e-3) - log_sigma(seam - 1e-3)).abs();
            assert!(step < 3e-3, "{seam}");
        }
        assert_eq!(log_sigma(-1000.0), -1000.0);
        assert!(log_sigma(1e30).is_finite());
        assert!(log_sigma(f32::NAN).is_nan());
        assert_eq!(Convention::Torchbnn.log_sigma(-4.5), -4.5);
    }
}
