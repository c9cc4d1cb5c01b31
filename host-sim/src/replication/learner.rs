//! Trains one variational network as the paper or its code does: mean squared error plus a
//! divergence from the prior, Adam.

use bnkf_model_export::kernel::{AdamStep, Moments, Posterior, Tier, adam};
use bnkf_model_export::memoryless::gradient::{Batch, Gradient};
use bnkf_model_export::memoryless::rows::Rows;
use bnkf_model_export::posterior::architecture::Architecture;
use bnkf_model_export::posterior::gaussian_weights::GaussianWeights;
use bnkf_model_export::random_source::RandomSource;
use bnkf_model_export::seed;

/// Standard deviation of every weight before training, and of the prior of the published code.
pub const INITIAL_SIGMA: f64 = 0.01;
/// Rows of a minibatch.
pub const BATCH_ROWS: usize = 512;
/// Learning rate at the start, the paper's; it falls to zero along half a cosine.
pub const RATE: f64 = 1e-3;

/// Which weights the divergence is of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Divergence {
    /// All; their sigmas are learned.
    All {
        /// Its factor in the loss.
        factor: f64,
        /// Standard deviation of the prior.
        prior_sigma: f64,
    },
    /// The biases of the last layer from N(0, 0.01^2), with factor 1; every sigma stays where it
    /// began.
    LastBias,
}

/// How a network is trained.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnerSettings {
    /// Its shape.
    pub architecture: Architecture,
    /// First of a row's targets that it estimates.
    pub first_target: usize,
    /// The divergence in its loss.
    pub divergence: Divergence,
    /// Passes over the rows.
    pub epochs: u32,
    /// Seed of the initial weights, of their noise and of the order of the rows.
    pub seed: u64,
}

/// The loss is not a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the loss of a replica is not finite in epoch {epoch}")]
pub struct DivergedError {
    /// The epoch, from 1.
    pub epoch: u32,
}

/// Trains on `rows`; `advance` is called after every epoch.
///
/// # Errors
/// The loss is not finite.
pub fn train(
    settings: &LearnerSettings,
    rows: &Rows,
    advance: &mut dyn FnMut(),
) -> Result<GaussianWeights, DivergedError> {
    let mut learner = Learner::new(settings);
    let batches = rows.len().div_ceil(BATCH_ROWS).max(1);
    let total = settings.epochs as usize * batches;
    let mut order: Vec<u32> = (0..rows.len() as u32).collect();
    for epoch in 0..settings.epochs {
        let ids = [seed::name_id("order of rows"), u64::from(epoch)];
        RandomSource::new(settings.seed, &ids).shuffle(&mut order);
        let mut loss = 0.0;
        for batch in 0..batches {
            let bound = |b: usize| b * order.len() / batches;
            let part = &order[bound(batch)..bound(batch + 1)];
            let progress = (epoch as usize * batches + batch) as f64 / total as f64;
            loss += learner.step(rows, part, progress);
        }
        if !loss.is_finite() {
            return Err(DivergedError { epoch: epoch + 1 });
        }
        advance();
    }
    Ok(learner.weights)
}

struct Learner<'a> {
    settings: &'a LearnerSettings,
    tier: Tier,
    weights: GaussianWeights,
    gradient: Gradient,
    /// Adam's moments: first and second of the means, first and second of the log sigmas.
    moments: [Vec<f32>; 4],
    steps: u64,
}

impl<'a> Learner<'a> {
    fn new(settings: &'a LearnerSettings) -> Self {
        let mut random = RandomSource::new(settings.seed, &[seed::name_id("initial weights")]);
        let weights =
            GaussianWeights::random(&settings.architecture, INITIAL_SIGMA as f32, &mut random);
        let tier = Tier::detect();
        Self {
            settings,
            tier,
            gradient: Gradient::new(tier, &weights),
            moments: std::array::from_fn(|_| vec![0.0; weights.means.len()]),
            weights,
            steps: 0,
        }
    }

    /// One step of Adam with `progress` of all steps done; returns the summed loss of the rows.
    fn step(&mut self, rows: &Rows, order: &[u32], progress: f64) -> f64 {
        self.steps += 1;
        let ids = [seed::name_id("weight noise"), self.steps];
        let batch = Batch {
            rows,
            order,
            first_target: self.settings.first_target,
            noise_seed: Some(seed::derive(self.settings.seed, &ids)),
        };
        self.gradient.load(self.tier, &self.weights);
        let loss = self.gradient.loss_and_gradient(batch);
        let last = self.settings.architecture.layers().pop();
        let biases = last.map_or(0, |layer| layer.bias(0));
        let parameters = self.weights.means.len();
        match self.settings.divergence {
            Divergence::All {
                factor,
                prior_sigma,
            } => self.adam(
                0..parameters,
                adam_step(self.steps, progress, factor, prior_sigma),
            ),
            Divergence::LastBias => {
                // Without a gradient Adam leaves the log sigmas as they are.
                self.gradient.by_variance.fill(0.0);
                self.adam(
                    0..biases,
                    adam_step(self.steps, progress, 0.0, INITIAL_SIGMA),
                );
                self.adam(
                    biases..parameters,
                    adam_step(self.steps, progress, 1.0, INITIAL_SIGMA),
                );
                // The biases' sigmas are at their minimum, but Adam makes steps of roundings.
                self.weights.log_sigmas[biases..].fill((INITIAL_SIGMA as f32).ln());
            }
        }
        loss
    }

    fn adam(&mut self, range: std::ops::Range<usize>, step: AdamStep) {
        let [mean_first, mean_second, log_sigma_first, log_sigma_second] = &mut self.moments;
        adam(
            self.tier,
            step,
            &self.gradient.by_mean[range.clone()],
            &self.gradient.by_variance[range.clone()],
            Posterior {
                means: &mut self.weights.means[range.clone()],
                log_sigmas: &mut self.weights.log_sigmas[range.clone()],
            },
            Moments {
                mean_first: &mut mean_first[range.clone()],
                mean_second: &mut mean_second[range.clone()],
                log_sigma_first: &mut log_sigma_first[range.clone()],
                log_sigma_second: &mut log_sigma_second[range],
            },
        );
    }
}

/// Adam's usual constants at step `steps`, from 1.
fn adam_step(steps: u64, progress: f64, kl_weight: f64, prior_sigma: f64) -> AdamStep {
    let (beta1, beta2) = (0.9, 0.999);
    let correction = |beta: f64| (1.0 / (1.0 - libm::pow(beta, steps as f64))) as f32;
    let cosine = 0.5 * (1.0 + libm::cos(std::f64::consts::PI * progress));
    AdamStep {
        rate: (RATE * cosine) as f32,
        beta1: beta1 as f32,
        beta2: beta2 as f32,
        epsilon: 1e-8,
        correction1: correction(beta1),
        correction2: correction(beta2),
        kl_weight: kl_weight as f32,
        prior_precision: prior_sigma.powi(-2) as f32,
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::memoryless::rows::Rows;
    use bnkf_model_export::posterior::architecture::Architecture;
    use bnkf_model_export::posterior::network_f64::NetworkF64;

    use super::{Divergence, INITIAL_SIGMA, Learner, LearnerSettings, train};

    fn settings(divergence: Divergence, epochs: u32) -> LearnerSettings {
        LearnerSettings {
            architecture: Architecture::new(vec![2, 8, 2]).unwrap(),
            first_target: 0,
            divergence,
            epochs,
            seed: 3,
        }
    }

    fn all(factor: f64) -> Divergence {
        Divergence::All {
            factor,
            prior_sigma: INITIAL_SIGMA,
        }
    }

    /// Two targets that are smooth functions of two features.
    fn rows(weight: f32) -> Rows {
        let mut rows = Rows::new(2, 2);
        for i in 0..544 {
            let (a, b) = ((i % 20) as f32 / 10.0 - 1.0, (i / 20) as f32 / 14.0 - 1.0);
            rows.features.extend([a, b]);
            rows.targets.extend([a * b, 0.5 * a - b * b]);
            rows.weights.push(weight);
        }
        rows
    }

    #[test]
    fn without_data_only_what_the_divergence_names_moves() {
        let rows = rows(0.0);
        let order: Vec<u32> = (0..100).collect();
        for divergence in [Divergence::LastBias, all(0.5)] {
            let settings = settings(divergence, 1);
            let mut learner = Learner::new(&settings);
            let before = learner.weights.clone();
            assert_eq!(learner.step(&rows, &order, 0.0), 0.0);
            let biases = settings.architecture.layers()[1].bias(0);
            for (index, (mean, old)) in learner.weights.means.iter().zip(&before.means).enumerate()
            {
                let named = divergence != Divergence::LastBias || index >= biases;
                // Towards the prior's mean, zero, by the learning rate.
                let step = if named { -old.signum() * 1e-3 } else { 0.0 };
                assert!((mean - old - step).abs() < 1e-7, "{divergence:?} {index}");
            }
        }
    }

    #[test]
    fn the_codes_sigmas_stay_and_the_papers_are_learned() {
        let rows = rows(1.0);
        let code = train(&settings(Divergence::LastBias, 5), &rows, &mut || {}).unwrap();
        let initial = (INITIAL_SIGMA as f32).ln();
        assert!(code.log_sigmas.iter().all(|s| *s == initial));
        let paper = train(&settings(all(1e-4), 5), &rows, &mut || {}).unwrap();
        let moved = paper.log_sigmas.iter().filter(|s| **s != initial).count();
        assert_eq!(moved, paper.log_sigmas.len());
    }

    #[test]
    fn a_smooth_function_is_learned_and_a_factor_of_one_forbids_it() {
        let rows = rows(1.0);
        let error = |divergence| {
            let mut epochs = 0;
            let weights = train(&settings(divergence, 1500), &rows, &mut || epochs += 1).unwrap();
            assert_eq!(epochs, 1500);
            let network = NetworkF64::from(&weights);
            let squares = (0..rows.len()).map(|row| {
                let x: Vec<f64> = rows
                    .features_of(row)
                    .iter()
                    .map(|x| f64::from(*x))
                    .collect();
                let y = network.mean_pass(&x);
                let errors = y.iter().zip(rows.targets_of(row));
                errors
                    .map(|(y, t)| (y - f64::from(*t)).powi(2))
                    .sum::<f64>()
            });
            (squares.sum::<f64>() / rows.len() as f64).sqrt()
        };
        // The targets' own spread is 0.6.
        let free = error(all(1e-8));
        assert!(free < 0.1, "{free}");
        let bound = error(all(1.0));
        assert!(bound > 0.4, "{bound}");
    }

    #[test]
    fn a_loss_that_is_no_number_is_reported() {
        let mut rows = rows(1.0);
        rows.targets[7] = f32::NAN;
        let error = train(&settings(Divergence::LastBias, 2), &rows, &mut || {}).unwrap_err();
        assert_eq!(error.epoch, 1);
    }
}
