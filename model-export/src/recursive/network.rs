//! The variational network that schedules the motion model: mean-field Gaussian weights and their
//! optimiser. Hidden layers end in GELU.

pub mod anchor;
pub mod gradient;
pub mod pass;
pub mod sampling;
pub mod shape;
pub mod weights;

use crate::blob::grid::Grid;
use crate::kernel::{AdamStep, Aligned, Moments, Posterior, Tier, adam};
use crate::posterior::architecture::Architecture;
use crate::posterior::gaussian_weights::GaussianWeights;
use crate::random_source::RandomSource;
use bnkf::recursive::schedule::OUTPUTS;
use gradient::Gradient;
use sampling::Sampling;
use shape::{LAYERS, OFFSETS, PARAMETERS, SHAPES, channels, places};
use weights::Weights;

/// Standard deviation of the prior of every weight, zero mean.
pub const PRIOR_SIGMA: f32 = 0.3;
/// Standard deviation that every weight starts with.
const INITIAL_SIGMA: f32 = 0.01;

/// Means, deviations and Adam's moments.
#[derive(Clone, Debug)]
pub struct Network {
    /// Posterior means, layer by layer, rows by input.
    pub means: Aligned,
    /// Natural logarithms of the posterior standard deviations.
    pub log_sigmas: Aligned,
    moments: [Aligned; 4],
    updates: i32,
}

impl Network {
    /// Random means (He initialisation; the last layer near zero, so that training starts from the
    /// base model) and small deviations.
    pub fn new(seed: u64) -> Self {
        let mut source = RandomSource::new(seed, &[crate::seed::name_id("recursive network")]);
        let mut means = Aligned::zeros(PARAMETERS);
        for (layer, (inputs, columns)) in SHAPES.into_iter().enumerate() {
            let gain = if layer + 1 == LAYERS { 0.02 } else { 1.4 };
            let used = if layer + 1 == LAYERS {
                OUTPUTS
            } else {
                columns
            };
            for row in 0..inputs {
                for column in 0..used {
                    means[OFFSETS[layer] + row * columns + column] =
                        (source.normal() * gain / (inputs as f64).sqrt()) as f32;
                }
            }
        }
        let mut log_sigmas = Aligned::zeros(PARAMETERS);
        log_sigmas.fill(INITIAL_SIGMA.ln());
        Self {
            means,
            log_sigmas,
            moments: core::array::from_fn(|_| Aligned::zeros(PARAMETERS)),
            updates: 0,
        }
    }

    /// What passes read; the variances of layers that are not sampled are zero.
    pub fn weights(&self, tier: Tier, sampling: Sampling) -> Weights {
        Weights::new(tier, &self.means, &self.log_sigmas, sampling)
    }

    /// Every weight mean on the int8 grid that it is exported on.
    pub fn rounded_means(&self) -> Aligned {
        let mut means = self.means.clone();
        Grid::of(&means, channels()).round(&mut means);
        means
    }

    /// One Adam step on the mean gradient of a batch, clipped to `clip` in Euclidean norm, plus
    /// `kl_weight` times the divergence from the prior. Returns the norm before clipping; a
    /// gradient that is not finite changes nothing.
    pub fn update(
        &mut self,
        tier: Tier,
        rate: f32,
        kl_weight: f32,
        clip: f32,
        gradient: &mut Gradient,
    ) -> f32 {
        let norm = gradient.norm(&self.log_sigmas);
        if !norm.is_finite() {
            return norm;
        }
        if norm > clip {
            gradient.scale(clip / norm);
        }
        self.updates += 1;
        let (beta1, beta2) = (0.9_f32, 0.999_f32);
        let step = AdamStep {
            rate,
            beta1,
            beta2,
            epsilon: 1e-8,
            correction1: 1.0 / (1.0 - beta1.powi(self.updates)),
            correction2: 1.0 / (1.0 - beta2.powi(self.updates)),
            kl_weight,
            prior_precision: 1.0 / (PRIOR_SIGMA * PRIOR_SIGMA),
        };
        let [mean_first, mean_second, log_sigma_first, log_sigma_second] = &mut self.moments;
        adam(
            tier,
            step,
            &gradient.by_mean,
            &gradient.by_variance,
            Posterior {
                means: &mut self.means,
                log_sigmas: &mut self.log_sigmas,
            },
            Moments {
                mean_first,
                mean_second,
                log_sigma_first,
                log_sigma_second,
            },
        );
        norm
    }

    /// Divergence of the posterior from the prior, nats.
    pub fn divergence(&self) -> f64 {
        let prior = f64::from(PRIOR_SIGMA);
        self.means
            .iter()
            .zip(self.log_sigmas.iter())
            .map(|(&mean, &log_sigma)| {
                let (mean, log_sigma) = (f64::from(mean), f64::from(log_sigma));
                let variance = (2.0 * log_sigma).exp();
                prior.ln() - log_sigma + (variance + mean * mean) / (2.0 * prior * prior) - 0.5
            })
            .sum()
    }

    /// The posterior in the order that blobs are written from, without padding.
    ///
    /// # Panics
    /// Never: the widths are constants that a blob can hold.
    pub fn gaussian_weights(&self) -> GaussianWeights {
        let mut widths: Vec<usize> = SHAPES.iter().map(|shape| shape.0).collect();
        widths.push(OUTPUTS);
        let architecture = Architecture::new(widths).expect("a blob can hold the widths");
        let mut ordered = GaussianWeights {
            means: vec![0.0; architecture.parameters()],
            log_sigmas: vec![0.0; architecture.parameters()],
            architecture,
        };
        for (to, from) in places(&ordered.architecture.layers()) {
            ordered.means[to] = self.means[from];
            ordered.log_sigmas[to] = self.log_sigmas[from];
        }
        ordered
    }

    /// The inverse of [`Self::gaussian_weights`], with a fresh optimiser; `None` for another shape.
    pub fn of_gaussian_weights(weights: &GaussianWeights) -> Option<Self> {
        let mut network = Self::new(0);
        if network.gaussian_weights().architecture != weights.architecture {
            return None;
        }
        for (from, to) in places(&weights.architecture.layers()) {
            network.means[to] = weights.means[from];
            network.log_sigmas[to] = weights.log_sigmas[from];
        }
        Some(network)
    }

    /// The network that lies `share` of the way from this one to `other`, weight by weight: means, and
    /// logarithms of deviations.
    pub fn blended(&self, other: &Self, share: f32) -> Self {
        let mut between = self.clone();
        let parts = [
            (&mut between.means, &other.means),
            (&mut between.log_sigmas, &other.log_sigmas),
        ];
        for (own, others) in parts {
            for (own, other) in own.iter_mut().zip(others.iter()) {
                *own = (1.0 - share) * *own + share * other;
            }
        }
        between
    }

    /// Every number that training needs to go on, in a fixed order.
    pub fn to_state(&self) -> (Vec<f32>, i32) {
        let mut state = Vec::with_capacity(6 * PARAMETERS);
        for part in [&self.means, &self.log_sigmas]
            .into_iter()
            .chain(&self.moments)
        {
            state.extend_from_slice(part);
        }
        (state, self.updates)
    }

    /// The inverse of [`Self::to_state`]; `None` when the length is another network's.
    pub fn from_state(state: &[f32], updates: i32) -> Option<Self> {
        if state.len() != 6 * PARAMETERS {
            return None;
        }
        let mut parts = state.chunks_exact(PARAMETERS).map(|part| {
            let mut buffer = Aligned::zeros(PARAMETERS);
            buffer.copy_from_slice(part);
            buffer
        });
        Some(Self {
            means: parts.next()?,
            log_sigmas: parts.next()?,
            moments: [parts.next()?, parts.next()?, parts.next()?, parts.next()?],
            updates,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::quantise::{layer_errors, quantise};

    #[test]
    fn state_round_trips() {
        let network = Network::new(5);
        let (state, updates) = network.to_state();
        let back = Network::from_state(&state, updates).unwrap();
        assert_eq!(back.to_state().0, state);
        assert!(Network::from_state(&state[1..], updates).is_none());
        assert!(back.divergence() > 0.0);
    }

    /// Export does not move a rounded network, and rounding moves what is not by half a step at most.
    #[test]
    fn a_rounded_network_lies_on_the_grid_of_its_blob() {
        let network = Network::new(5);
        let errors = |network: &Network| {
            let weights = network.gaussian_weights();
            layer_errors(&weights, &quantise(&weights))
                .into_iter()
                .map(|error| error.mean_max_steps)
                .fold(0.0, f64::max)
        };
        assert!(errors(&network) > 0.4);
        let rounded = Network {
            means: network.rounded_means(),
            ..network.clone()
        };
        assert!(errors(&rounded) < 1e-3, "{}", errors(&rounded));
        let before = network.gaussian_weights();
        let coded = quantise(&before);
        let after = rounded.gaussian_weights();
        for (shape, layer) in before.architecture.layers().iter().zip(coded) {
            for output in 0..shape.outputs {
                let half = 0.501 * layer.channel_scale[output];
                for index in shape.row(output)..shape.row(output) + shape.inputs {
                    assert!((before.means[index] - after.means[index]).abs() <= half);
                }
                let bias = shape.bias(output);
                assert_eq!(before.means[bias], after.means[bias]);
            }
        }
    }

    #[test]
    fn a_gradient_that_is_not_finite_changes_nothing() {
        let mut network = Network::new(5);
        let before = network.to_state();
        let mut gradient = Gradient::zeros();
        gradient.by_mean[7] = f32::NAN;
        let norm = network.update(Tier::detect(), 1e-3, 1e-6, 1.0, &mut gradient);
        assert!(norm.is_nan());
        assert_eq!(network.to_state(), before);
    }
}
