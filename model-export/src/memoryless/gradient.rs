//! Loss and gradient of a minibatch, over a fixed split into shards.
//!
//! The split does not depend on the number of threads and the parts are summed in order, so any
//! number of threads gives the same bits. Work runs on the current rayon pool.

use crate::kernel::{BLOCK_ROWS, Tier};
pub use crate::memoryless::shard::Batch;
use crate::memoryless::shard::Shard;
use crate::posterior::gaussian_weights::GaussianWeights;
use crate::posterior::padded_weights::PaddedWeights;
use rayon::prelude::*;

/// Parts of a minibatch: as many threads can work on it.
pub const SHARDS: usize = 2;

/// Working memory for one network, and the gradient that it computes.
pub struct Gradient {
    weights: PaddedWeights,
    shards: Vec<Shard>,
    /// Gradient with respect to every mean, in the flat order of the architecture.
    pub by_mean: Vec<f32>,
    /// Gradient with respect to every variance, in the same order.
    pub by_variance: Vec<f32>,
}

impl Gradient {
    /// Memory for networks shaped like `weights`, which are loaded.
    #[must_use]
    pub fn new(tier: Tier, weights: &GaussianWeights) -> Self {
        let mut padded = PaddedWeights::new(weights);
        padded.load(tier, weights);
        let parameters = weights.architecture.parameters();
        Self {
            shards: (0..SHARDS).map(|_| Shard::new(tier, &padded)).collect(),
            weights: padded,
            by_mean: vec![0.0; parameters],
            by_variance: vec![0.0; parameters],
        }
    }

    /// Takes over changed weights of the same architecture.
    pub fn load(&mut self, tier: Tier, weights: &GaussianWeights) {
        self.weights.load(tier, weights);
    }

    /// Sum over the rows of weight x squared error, for one sample of the weights per row, and the
    /// gradient of its mean over the rows, left in the public fields.
    pub fn loss_and_gradient(&mut self, batch: Batch<'_>) -> f64 {
        let scale = 1.0 / batch.order.len() as f32;
        let weights = &self.weights;
        let loss = in_shards(&mut self.shards, &batch, |shard, blocks| {
            shard.clear();
            blocks
                .map(|block| {
                    let loss = shard.forward(weights, &batch, block);
                    shard.backward(weights, &batch, block, scale);
                    loss
                })
                .sum()
        });
        self.collect();
        loss
    }

    /// The sum of [`Gradient::loss_and_gradient`] alone.
    pub fn loss(&mut self, batch: Batch<'_>) -> f64 {
        let weights = &self.weights;
        in_shards(&mut self.shards, &batch, |shard, blocks| {
            blocks
                .map(|block| shard.forward(weights, &batch, block))
                .sum()
        })
    }

    /// Outputs for every row of the batch, row-major, in normalised units.
    pub fn outputs(&mut self, batch: Batch<'_>) -> Vec<f32> {
        let width = self.weights.layers[self.weights.layers.len() - 1]
            .shape
            .outputs;
        let mut outputs = Vec::with_capacity(batch.order.len() * width);
        let shard = &mut self.shards[0];
        for block in 0..batch.order.len().div_ceil(BLOCK_ROWS) {
            // The loss is not wanted here.
            let _loss = shard.forward(&self.weights, &batch, block);
            for row in 0..BLOCK_ROWS.min(batch.order.len() - block * BLOCK_ROWS) {
                outputs.extend((0..width).map(|o| shard.output(&self.weights, row, o)));
            }
        }
        outputs
    }

    /// Sums the shards in order, dropping the padding.
    fn collect(&mut self) {
        self.by_mean.fill(0.0);
        self.by_variance.fill(0.0);
        for shard in &self.shards {
            for (layer, gradient) in self.weights.layers.iter().zip(&shard.gradient) {
                let (shape, columns) = (layer.shape, layer.columns_in);
                for output in 0..shape.outputs {
                    let row = shape.row(output)..shape.row(output) + shape.inputs;
                    add(
                        &mut self.by_mean[row.clone()],
                        &gradient.by_mean[output * columns..],
                    );
                    add(
                        &mut self.by_variance[row],
                        &gradient.by_variance[output * columns..],
                    );
                }
                let biases = shape.bias(0)..shape.end();
                add(&mut self.by_mean[biases.clone()], &gradient.by_bias_mean);
                add(&mut self.by_variance[biases], &gradient.by_bias_variance);
            }
        }
    }
}

fn in_shards(
    shards: &mut [Shard],
    batch: &Batch<'_>,
    work: impl Fn(&mut Shard, std::ops::Range<usize>) -> f64 + Sync,
) -> f64 {
    let blocks = batch.order.len().div_ceil(BLOCK_ROWS);
    let losses: Vec<f64> = shards
        .par_iter_mut()
        .enumerate()
        .map(|(index, shard)| {
            work(
                shard,
                index * blocks / SHARDS..(index + 1) * blocks / SHARDS,
            )
        })
        .collect();
    losses.into_iter().sum()
}

fn add(sums: &mut [f32], values: &[f32]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += value;
    }
}

#[cfg(test)]
mod tests {
    use super::{Batch, Gradient, SHARDS};
    use crate::kernel::{BLOCK_ROWS, LANES, Tier, fill_normal};
    use crate::memoryless::rows::Rows;
    use crate::posterior::architecture::Architecture;
    use crate::posterior::gaussian_weights::GaussianWeights;
    use crate::posterior::network_f64::NetworkF64;
    use crate::random_source::RandomSource;
    use crate::seed;

    const SEED: u64 = 77;

    fn rows(count: usize, random: &mut RandomSource) -> Rows {
        let mut rows = Rows::new(5, 3);
        for _ in 0..count {
            rows.features.extend((0..5).map(|_| random.normal() as f32));
            rows.targets.extend((0..3).map(|_| random.normal() as f32));
            rows.weights.push(random.uniform(0.2, 2.0) as f32);
        }
        rows
    }

    fn network(widths: &[usize], random: &mut RandomSource) -> GaussianWeights {
        let architecture = Architecture::new(widths.to_vec()).unwrap();
        let mut weights = GaussianWeights::random(&architecture, 0.2, random);
        for log_sigma in &mut weights.log_sigmas {
            *log_sigma += random.uniform(-1.0, 1.0) as f32;
        }
        weights
    }

    /// Mean loss with the noise that the shards draw, by the naive network in f64.
    fn naive_loss(network: &NetworkF64, batch: &Batch<'_>) -> f64 {
        let noise: Vec<Vec<Vec<f32>>> = (0..batch.order.len().div_ceil(BLOCK_ROWS))
            .map(|block| {
                let layers = network.layers.iter().enumerate();
                layers
                    .map(|(index, layer)| {
                        let columns = layer.bias_means.len().next_multiple_of(LANES);
                        let mut noise = vec![0.0; BLOCK_ROWS * columns];
                        if let Some(noise_seed) = batch.noise_seed {
                            let seed = seed::derive(noise_seed, &[block as u64, index as u64]);
                            fill_normal(Tier::detect(), seed, &mut noise);
                        }
                        noise
                    })
                    .collect()
            })
            .collect();
        let mut sum = 0.0;
        for (index, &row) in batch.order.iter().enumerate() {
            let row = row as usize;
            let features: Vec<f64> = batch
                .rows
                .features_of(row)
                .iter()
                .map(|&x| f64::from(x))
                .collect();
            let (block, line) = (index / BLOCK_ROWS, index % BLOCK_ROWS);
            let draws = network
                .layers
                .iter()
                .enumerate()
                .flat_map(|(layer, shape)| {
                    let outputs = shape.bias_means.len();
                    let columns = outputs.next_multiple_of(LANES);
                    noise[block][layer][line * columns..][..outputs]
                        .iter()
                        .map(|&x| f64::from(x))
                });
            let mut draws = draws.collect::<Vec<f64>>().into_iter();
            let outputs = network.sampled_pass(&features, || draws.next().unwrap());
            let targets = &batch.rows.targets_of(row)[batch.first_target..];
            let squares: f64 = outputs
                .iter()
                .zip(targets)
                .map(|(y, &t)| (y - f64::from(t)).powi(2))
                .sum();
            sum += f64::from(batch.rows.weights[row]) * squares;
        }
        sum / batch.order.len() as f64
    }

    /// The largest error of `gradient` against central differences of `loss`, over its largest entry.
    fn worst(gradient: &[f32], differences: &[f64]) -> f64 {
        let largest = differences.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
        let error = gradient.iter().zip(differences);
        error.fold(0.0_f64, |m, (g, d)| m.max((f64::from(*g) - d).abs())) / largest
    }

    #[test]
    fn gradient_equals_central_differences_in_f64() {
        for (case, widths) in [&[5, 7, 6, 3][..], &[5, 2], &[5, 20, 1]]
            .into_iter()
            .enumerate()
        {
            let mut random = RandomSource::new(case as u64, &[]);
            let rows = rows(100, &mut random);
            let weights = network(widths, &mut random);
            // More than one block, the last one partly filled, in shuffled order.
            let mut order: Vec<u32> = (0..90).collect();
            random.shuffle(&mut order);
            let first_target = 3 - widths[widths.len() - 1];
            let batch = Batch {
                rows: &rows,
                order: &order,
                first_target,
                noise_seed: Some(SEED),
            };
            let mut gradient = Gradient::new(Tier::detect(), &weights);
            let loss = gradient.loss_and_gradient(batch) / order.len() as f64;
            let naive = NetworkF64::from(&weights);
            assert!((loss / naive_loss(&naive, &batch) - 1.0).abs() < 1e-5);

            let (mut by_mean, mut by_variance) = (Vec::new(), Vec::new());
            let shapes = weights.architecture.layers();
            let at = |change: &dyn Fn(&mut NetworkF64, f64), step: f64| {
                let mut changed = naive.clone();
                change(&mut changed, step);
                naive_loss(&changed, &batch)
            };
            let slope = |change: &dyn Fn(&mut NetworkF64, f64), step: f64| {
                (at(change, step) - at(change, -step)) / (2.0 * step)
            };
            for (index, shape) in shapes.iter().enumerate() {
                for output in 0..shape.outputs {
                    for input in 0..shape.inputs {
                        by_mean.push(slope(
                            &|n, h| n.layers[index].means[output][input] += h,
                            1e-5,
                        ));
                        by_variance.push(slope(
                            &|n, h| n.layers[index].variances[output][input] += h,
                            1e-6,
                        ));
                    }
                }
                for output in 0..shape.outputs {
                    by_mean.push(slope(&|n, h| n.layers[index].bias_means[output] += h, 1e-5));
                    by_variance.push(slope(
                        &|n, h| n.layers[index].bias_variances[output] += h,
                        1e-6,
                    ));
                }
            }
            // f32 sums over 90 rows; the differences themselves are good to about 1e-8.
            assert!(worst(&gradient.by_mean, &by_mean) < 2e-5, "case {case}");
            assert!(
                worst(&gradient.by_variance, &by_variance) < 2e-5,
                "case {case}"
            );
        }
    }

    #[test]
    fn threads_and_tiers_do_not_change_a_bit() {
        let mut random = RandomSource::new(9, &[]);
        let rows = rows(300, &mut random);
        let weights = network(&[5, 33, 3], &mut random);
        let order: Vec<u32> = (0..300).collect();
        let batch = Batch {
            rows: &rows,
            order: &order,
            first_target: 0,
            noise_seed: Some(SEED),
        };
        let run = |tier: Tier, threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            let mut gradient = Gradient::new(tier, &weights);
            let loss = pool.install(|| gradient.loss_and_gradient(batch));
            (loss, gradient.by_mean, gradient.by_variance)
        };
        let reference = run(Tier::detect(), 1);
        for tier in Tier::available() {
            for threads in [1, 2, SHARDS + 1] {
                assert_eq!(run(tier, threads), reference, "{} {threads}", tier.name());
            }
        }
    }

    #[test]
    fn outputs_at_the_mean_weights_are_those_of_the_naive_network() {
        let mut random = RandomSource::new(10, &[]);
        let rows = rows(70, &mut random);
        let weights = network(&[5, 16, 9, 3], &mut random);
        let order: Vec<u32> = (0..70).collect();
        let batch = Batch {
            rows: &rows,
            order: &order,
            first_target: 0,
            noise_seed: None,
        };
        let mut gradient = Gradient::new(Tier::detect(), &weights);
        let outputs = gradient.outputs(batch);
        let naive = NetworkF64::from(&weights);
        assert_eq!(outputs.len(), 70 * 3);
        for row in 0..70 {
            let features: Vec<f64> = rows
                .features_of(row)
                .iter()
                .map(|&x| f64::from(x))
                .collect();
            for (y, exact) in outputs[row * 3..].iter().zip(naive.mean_pass(&features)) {
                assert!((f64::from(*y) - exact).abs() < 2e-6);
            }
        }
        let loss = gradient.loss(batch);
        assert!((loss / 70.0 / naive_loss(&naive, &batch) - 1.0).abs() < 1e-5);
    }
}
