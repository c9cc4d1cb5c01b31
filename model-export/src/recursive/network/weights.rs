//! The posterior as passes through the network read it.

use super::sampling::Sampling;
use super::shape::{LAYERS, OFFSETS, PARAMETERS, SHAPES};
use crate::kernel::{Aligned, Tier, exp_in_place};

/// What one pass reads: means and variances, and their transposes for the way back.
#[derive(Clone, Debug)]
pub struct Weights {
    pub(super) means: Aligned,
    pub(super) variances: Aligned,
    pub(super) means_transposed: Aligned,
    pub(super) variances_transposed: Aligned,
    pub(super) sampling: Sampling,
}

impl Weights {
    /// From posterior means and logarithms of deviations; the variances of layers that
    /// are not sampled are zero.
    pub fn new(tier: Tier, means: &Aligned, log_sigmas: &Aligned, sampling: Sampling) -> Self {
        let mut variances = Aligned::zeros(PARAMETERS);
        variances.copy_from_slice(log_sigmas);
        exp_in_place(tier, 2.0, &mut variances);
        for layer in (0..LAYERS).filter(|layer| !sampling.covers(*layer, LAYERS)) {
            variances[OFFSETS[layer]..OFFSETS[layer + 1]].fill(0.0);
        }
        Self {
            means_transposed: transposed(means),
            variances_transposed: transposed(&variances),
            means: means.clone(),
            variances,
            sampling,
        }
    }
}

/// Every layer's weights with rows and columns exchanged; biases are left out.
fn transposed(parameters: &[f32]) -> Aligned {
    let mut out = Aligned::zeros(PARAMETERS);
    for (layer, (inputs, columns)) in SHAPES.into_iter().enumerate() {
        let start = OFFSETS[layer];
        for row in 0..inputs {
            for column in 0..columns {
                out[start + column * inputs + row] = parameters[start + row * columns + column];
            }
        }
    }
    out
}
