//! The posterior as passes through the network read it.

use super::network_shape::{OFFSETS, PARAMETERS, SHAPES};
use crate::kernel::{Aligned, Tier, exp_in_place};

/// What one pass reads: means and variances, and their transposes for the way back.
#[derive(Clone, Debug)]
pub struct Weights {
    pub(super) means: Aligned,
    pub(super) variances: Aligned,
    pub(super) means_transposed: Aligned,
    pub(super) variances_transposed: Aligned,
    pub(super) sampled: bool,
}

impl Weights {
    /// From posterior means and logarithms of deviations; `sampled` false takes every variance as
    /// zero.
    pub(super) fn new(tier: Tier, means: &Aligned, log_sigmas: &Aligned, sampled: bool) -> Self {
        let mut variances = Aligned::zeros(PARAMETERS);
        if sampled {
            variances.copy_from_slice(log_sigmas);
            exp_in_place(tier, 2.0, &mut variances);
        }
        Self {
            means_transposed: transposed(means),
            variances_transposed: transposed(&variances),
            means: means.clone(),
            variances,
            sampled,
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
