//! Monte Carlo passes of a replica: what its networks say of one pair of readings.

use bnkf_model_export::kernel::Tier;
use bnkf_model_export::memoryless::gradient::{Batch, Gradient};
use bnkf_model_export::memoryless::rows::Rows;
use bnkf_model_export::posterior::gaussian_weights::GaussianWeights;
use bnkf_model_export::seed;
use nalgebra::{Matrix6, Vector6};

use super::scaling::Scaling;

/// Mean and covariance of an estimate before its correction. Position (m), then velocity (m/s);
/// what is not estimated is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateMoments {
    /// Mean.
    pub mean: Vector6<f64>,
    /// Covariance.
    pub covariance: Matrix6<f64>,
}

/// Trained networks: one for all outputs, or one for each.
pub struct Ensemble {
    gradients: Vec<Gradient>,
    scaling: Scaling,
    outputs: usize,
    passes: usize,
}

impl Ensemble {
    /// Networks for `outputs` outputs together, in the outputs' order; `passes` is at least 2.
    pub fn new(
        members: &[GaussianWeights],
        scaling: Scaling,
        outputs: usize,
        passes: usize,
    ) -> Self {
        let gradient = |weights| Gradient::new(Tier::detect(), weights);
        Self {
            gradients: members.iter().map(gradient).collect(),
            scaling,
            outputs,
            passes,
        }
    }

    /// Sample mean and covariance of the passes, one for each row, in physical units. The errors of
    /// separate networks are taken to be independent (paper Eq. 18).
    pub fn moments(&mut self, rows: &Rows, seed: u64) -> Vec<StateMoments> {
        let (count, passes) = (rows.len(), self.passes);
        let order: Vec<u32> = (0..count as u32)
            .flat_map(|row| std::iter::repeat_n(row, passes))
            .collect();
        let each = self.outputs / self.gradients.len();
        let mut all = vec![
            StateMoments {
                mean: Vector6::zeros(),
                covariance: Matrix6::zeros(),
            };
            count
        ];
        for (index, gradient) in self.gradients.iter_mut().enumerate() {
            let batch = Batch {
                rows,
                order: &order,
                first_target: index * each,
                noise_seed: Some(seed::derive(seed, &[index as u64])),
            };
            let outputs = gradient.outputs(batch);
            for (moments, samples) in all.iter_mut().zip(outputs.chunks_exact(passes * each)) {
                add_block(moments, samples, index * each, each, &self.scaling);
            }
        }
        all
    }
}

/// Fills the block of outputs `first..first + each` from `samples`, pass by pass.
fn add_block(
    moments: &mut StateMoments,
    samples: &[f32],
    first: usize,
    each: usize,
    scaling: &Scaling,
) {
    let value = |pass: &[f32], o: usize| scaling.physical(first + o, pass[o]);
    let passes = samples.len() / each;
    for o in 0..each {
        let sum: f64 = samples.chunks_exact(each).map(|pass| value(pass, o)).sum();
        moments.mean[first + o] = sum / passes as f64;
    }
    for a in 0..each {
        for b in 0..=a {
            let deviation = |pass: &[f32], o: usize| value(pass, o) - moments.mean[first + o];
            let sum: f64 = samples
                .chunks_exact(each)
                .map(|pass| deviation(pass, a) * deviation(pass, b))
                .sum();
            let covariance = sum / (passes - 1) as f64;
            moments.covariance[(first + a, first + b)] = covariance;
            moments.covariance[(first + b, first + a)] = covariance;
        }
    }
}
