//! Mean and covariance of a blob's network over very many passes, on the host's vector kernels.

use crate::kernel::Tier;
use crate::memoryless::gradient::{Batch, Gradient};
use crate::memoryless::rows::Rows;
use crate::posterior::architecture::{Architecture, ArchitectureError};
use crate::posterior::gaussian_weights::GaussianWeights;
use crate::seed;
use bnkf::blob::NetworkView;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Passes that go through the kernels together.
const BATCH: u32 = 10_000;

/// Mean and covariance of some outputs, not yet scaled back.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeanAndCovariance {
    /// One for each output.
    pub mean: Vec<f64>,
    /// `[output][output]`.
    pub covariance: Vec<Vec<f64>>,
}

/// The weights as the firmware reads them from a blob.
///
/// # Errors
/// The view is of no network; a checked blob has none of these.
pub fn decoded(view: NetworkView<'_>) -> Result<GaussianWeights, ArchitectureError> {
    let layers = || (0..view.layers()).map(|index| view.layer(index));
    let widths = layers().take(1).map(|layer| layer.inputs);
    let architecture =
        Architecture::new(widths.chain(layers().map(|layer| layer.outputs)).collect())?;
    let (mut means, mut log_sigmas) = (Vec::new(), Vec::new());
    for layer in layers() {
        for output in 0..layer.outputs {
            for input in 0..layer.inputs {
                means.push(layer.mean(output, input));
                log_sigmas.push(0.5 * layer.variance(output, input).ln());
            }
        }
        means.extend(layer.bias_mean.iter());
        log_sigmas.extend(
            layer
                .bias_variance
                .iter()
                .map(|variance| 0.5 * variance.ln()),
        );
    }
    Ok(GaussianWeights {
        architecture,
        means,
        log_sigmas,
    })
}

/// What `passes` passes, rounded up to whole batches, say of `outputs`, for each of `inputs`.
#[must_use]
pub fn sampled(
    weights: &GaussianWeights,
    inputs: &[Vec<f32>],
    outputs: &Range<usize>,
    passes: u32,
    seed: u64,
) -> Vec<MeanAndCovariance> {
    let one = |(index, input): (usize, &Vec<f32>)| {
        let mut gradient = Gradient::new(Tier::detect(), weights);
        let mut rows = Rows::new(input.len(), 0);
        rows.features.extend(input);
        rows.weights.push(0.0);
        let order = vec![0; BATCH as usize];
        let mut sums = Sums::new(outputs.len());
        for batch in 0..passes.div_ceil(BATCH) {
            let samples = gradient.outputs(Batch {
                rows: &rows,
                order: &order,
                first_target: 0,
                noise_seed: Some(seed::derive(seed, &[index as u64, u64::from(batch)])),
            });
            let width = weights.architecture.outputs();
            for sample in samples.chunks_exact(width) {
                sums.add(&sample[outputs.clone()]);
            }
        }
        sums.moments()
    };
    inputs.par_iter().enumerate().map(one).collect()
}

/// Sums of differences from the first sample.
struct Sums {
    count: f64,
    origin: Vec<f64>,
    first: Vec<f64>,
    second: Vec<Vec<f64>>,
}

impl Sums {
    fn new(outputs: usize) -> Self {
        Self {
            count: 0.0,
            origin: vec![0.0; outputs],
            first: vec![0.0; outputs],
            second: vec![vec![0.0; outputs]; outputs],
        }
    }

    fn add(&mut self, sample: &[f32]) {
        let sample = sample.iter().map(|&x| f64::from(x));
        if self.count == 0.0 {
            self.origin = sample.clone().collect();
        }
        self.count += 1.0;
        let apart: Vec<f64> = sample
            .zip(&self.origin)
            .map(|(x, origin)| x - origin)
            .collect();
        for (i, row) in self.second.iter_mut().enumerate() {
            self.first[i] += apart[i];
            for (sum, other) in row.iter_mut().zip(&apart) {
                *sum += apart[i] * other;
            }
        }
    }

    fn moments(&self) -> MeanAndCovariance {
        let (first, count) = (&self.first, self.count);
        let means = self.origin.iter().zip(first);
        let covariance = self.second.iter().zip(first).map(|(row, a)| {
            let entries = row.iter().zip(first);
            entries
                .map(|(sum, b)| (sum - a * b / count) / (count - 1.0))
                .collect()
        });
        MeanAndCovariance {
            mean: means.map(|(origin, sum)| origin + sum / count).collect(),
            covariance: covariance.collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bnkf::Spread;
    use bnkf::blob::Blob;
    use bnkf::network::monte_carlo::{Sampling, moments};
    use bnkf::network::{Network, Scratch};
    use bnkf::rng::seeded;

    /// The firmware's passes, which draw other numbers, agree as well as so many can.
    #[test]
    fn the_reference_is_what_the_firmwares_passes_say() {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../tests/golden/tiny_bnkf.bnkf"
        );
        let bytes = std::fs::read(path).unwrap();
        let blob = Blob::parse(&bytes).unwrap();
        let view = blob.networks().next().unwrap();
        let input: Vec<f32> = (0..12).map(|i| (i as f32 * 1.3).sin()).collect();
        let weights = decoded(view).unwrap();
        let found = &sampled(&weights, std::slice::from_ref(&input), &(0..3), 100_000, 5)[0];
        let network = Network::new(view);
        let (mut rng, mut scratch) = (seeded(6), Scratch::new());
        let own = moments::<3>(
            &network,
            &input,
            10_000,
            Sampling::Activations(Spread::Exact),
            &mut rng,
            &mut scratch,
        );
        for i in 0..3 {
            let sigma = found.covariance[i][i].sqrt();
            assert!((found.mean[i] - f64::from(own.mean[i])).abs() < 0.05 * sigma);
            for j in 0..3 {
                let size = sigma * found.covariance[j][j].sqrt();
                let error = (found.covariance[i][j] - f64::from(own.covariance[i][j])).abs();
                assert!(error < 0.06 * size, "{i} {j}: {error} {size}");
            }
        }
    }
}
