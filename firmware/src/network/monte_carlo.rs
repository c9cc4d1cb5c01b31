//! Mean and covariance of a network's outputs over Monte Carlo passes.

use crate::blob::field::WIDTH_MAX;
use crate::network::{LANES, Network, Scratch};
use crate::spread::Spread;
use rand_core::Rng;

/// Sample mean and full sample covariance of `N` network outputs, not yet scaled back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments<const N: usize> {
    /// Sample mean.
    pub mean: [f32; N],
    /// Sample covariance with the divisor `passes - 1`; zero for a single pass.
    pub covariance: [[f32; N]; N],
}

/// How the passes draw from the weight posterior.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// Local reparameterisation: the pre-activations are drawn.
    Activations(Spread),
    /// Every weight is drawn; some hundred times slower, for verification.
    Weights,
}

/// Draws `passes` in blocks and calls `each` with the outputs of every block and how many lanes of it count.
fn draw_blocks(
    network: &Network<'_>,
    inputs: &[f32],
    passes: u16,
    spread: Spread,
    rng: &mut impl Rng,
    scratch: &mut Scratch,
    mut each: impl FnMut(&[[f32; LANES]; WIDTH_MAX], usize),
) {
    network.prepare(inputs, scratch);
    let blocks = passes.div_ceil(LANES as u16);
    let exact = spread.exact_blocks(blocks);
    let mut left = usize::from(passes);
    for block in 0..blocks {
        if block == exact {
            network.freeze(exact, scratch);
        }
        let outputs = if block < exact {
            network.sampled_passes(scratch, rng)
        } else {
            network.frozen_passes(scratch, rng)
        };
        each(outputs, left.min(LANES));
        left = left.saturating_sub(LANES);
    }
}

/// Runs `passes` Monte Carlo passes of a network with `N` outputs for normalised `inputs`.
pub fn moments<const N: usize>(
    network: &Network<'_>,
    inputs: &[f32],
    passes: u16,
    sampling: Sampling,
    rng: &mut impl Rng,
    scratch: &mut Scratch,
) -> Moments<N> {
    let mut sums = Sums::<N>::default();
    match sampling {
        Sampling::Activations(spread) => {
            draw_blocks(
                network,
                inputs,
                passes,
                spread,
                rng,
                scratch,
                |outputs, lanes| {
                    for lane in 0..lanes.min(LANES) {
                        sums.add(core::array::from_fn(|i| outputs[i][lane]));
                    }
                },
            );
        }
        Sampling::Weights => {
            for _ in 0..passes {
                let mut outputs = [0.0; N];
                network.weight_sampled_pass(inputs, rng, &mut outputs);
                sums.add(outputs);
            }
        }
    }
    sums.moments()
}

/// Mean and variance of each of `N` outputs over `passes` passes by local reparameterisation: what
/// is needed of many outputs without the memory of their covariance.
pub fn separate_moments<const N: usize>(
    network: &Network<'_>,
    inputs: &[f32],
    passes: u16,
    spread: Spread,
    rng: &mut impl Rng,
    scratch: &mut Scratch,
) -> ([f32; N], [f32; N]) {
    let (mut mean, mut variance) = ([0.0; N], [0.0; N]);
    let into = (&mut mean, &mut variance);
    separate_moments_into(network, inputs, passes, spread, rng, scratch, into);
    (mean, variance)
}

/// [`separate_moments`] in the caller's memory.
pub fn separate_moments_into<const N: usize>(
    network: &Network<'_>,
    inputs: &[f32],
    passes: u16,
    spread: Spread,
    rng: &mut impl Rng,
    scratch: &mut Scratch,
    (first, second): (&mut [f32; N], &mut [f32; N]),
) {
    let (mut origin, mut is_first) = ([0.0; N], true);
    first.fill(0.0);
    second.fill(0.0);
    draw_blocks(
        network,
        inputs,
        passes,
        spread,
        rng,
        scratch,
        |outputs, lanes| {
            for i in 0..N {
                if is_first {
                    origin[i] = outputs[i][0];
                }
                for lane in 0..lanes.min(LANES) {
                    let difference = outputs[i][lane] - origin[i];
                    first[i] += difference;
                    second[i] += difference * difference;
                }
            }
            is_first = false;
        },
    );
    let count = f32::from(passes);
    let degrees = f32::from(passes.max(2) - 1);
    for i in 0..N {
        second[i] = (second[i] - first[i] * first[i] / count) / degrees;
        first[i] = origin[i] + first[i] / count;
    }
}

/// Sums of differences from the first sample, which keeps f32 exact enough: the spread of the
/// passes is small beside their mean.
struct Sums<const N: usize> {
    count: u16,
    origin: [f32; N],
    first: [f32; N],
    second: [[f32; N]; N],
}

impl<const N: usize> Default for Sums<N> {
    fn default() -> Self {
        Self {
            count: 0,
            origin: [0.0; N],
            first: [0.0; N],
            second: [[0.0; N]; N],
        }
    }
}

impl<const N: usize> Sums<N> {
    fn add(&mut self, sample: [f32; N]) {
        if self.count == 0 {
            self.origin = sample;
        }
        self.count += 1;
        for i in 0..N {
            let difference = sample[i] - self.origin[i];
            self.first[i] += difference;
            for j in 0..=i {
                self.second[i][j] += difference * (sample[j] - self.origin[j]);
            }
        }
    }

    fn moments(&self) -> Moments<N> {
        let count = f32::from(self.count);
        let degrees = f32::from(self.count.max(2) - 1);
        let mut moments = Moments {
            mean: [0.0; N],
            covariance: [[0.0; N]; N],
        };
        for i in 0..N {
            moments.mean[i] = self.origin[i] + self.first[i] / count;
            for j in 0..=i {
                let covariance =
                    (self.second[i][j] - self.first[i] * self.first[j] / count) / degrees;
                moments.covariance[i][j] = covariance;
                moments.covariance[j][i] = covariance;
            }
        }
        moments
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::Blob;
    use crate::blob::draft::Draft;
    use crate::rng::seeded;
    use std::vec::Vec;

    #[test]
    fn sums_equal_the_textbook_formula() {
        let samples = [[1.0, 2.0], [2.0, 0.0], [4.0, 1.0], [1.0, 5.0]];
        let mut sums = Sums::<2>::default();
        for sample in samples {
            sums.add(sample);
        }
        let moments = sums.moments();
        assert_eq!(moments.mean, [2.0, 2.0]);
        // Deviations (-1,0) (0,-2) (2,-1) (-1,3): products sum to 6, -5, 14; divided by 3.
        let expected = [[2.0, -5.0 / 3.0], [-5.0 / 3.0, 14.0 / 3.0]];
        for i in 0..2 {
            for j in 0..2 {
                assert!((moments.covariance[i][j] - expected[i][j]).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn a_single_pass_has_no_covariance() {
        let mut sums = Sums::<1>::default();
        sums.add([3.0]);
        assert_eq!(
            sums.moments(),
            Moments {
                mean: [3.0],
                covariance: [[0.0]]
            }
        );
    }

    const INPUT: [f32; 12] = [
        0.3, -1.1, 0.7, 0.2, -0.4, 1.5, -0.9, 0.1, 0.8, -0.2, 0.6, -1.3,
    ];

    /// Mean and covariance in f64, by their definition.
    fn naive(samples: &[[f32; 3]]) -> ([f64; 3], [[f64; 3]; 3]) {
        let count = samples.len() as f64;
        let mean: [f64; 3] = core::array::from_fn(|i| {
            let values = samples.iter().map(|sample| f64::from(sample[i]));
            values.sum::<f64>() / count
        });
        let deviation = |sample: &[f32; 3], i: usize| f64::from(sample[i]) - mean[i];
        let covariance = core::array::from_fn(|i| {
            core::array::from_fn(|j| {
                let products = samples.iter().map(|s| deviation(s, i) * deviation(s, j));
                products.sum::<f64>() / (count - 1.0).max(1.0)
            })
        });
        (mean, covariance)
    }

    fn assert_moments(got: &Moments<3>, samples: &[[f32; 3]]) {
        let (mean, covariance) = naive(samples);
        for i in 0..3 {
            assert!((f64::from(got.mean[i]) - mean[i]).abs() < 1e-5, "mean {i}");
            for j in 0..3 {
                let size = (covariance[i][i] * covariance[j][j]).sqrt() + 1e-6;
                let error = (f64::from(got.covariance[i][j]) - covariance[i][j]).abs();
                assert!(error < 1e-4 * size, "covariance {i} {j}: {error}");
            }
        }
    }

    /// Passes that are no multiple of the four that run together, one block, and several.
    #[test]
    fn moments_are_those_of_the_passes_one_by_one() {
        let bytes = Draft::memoryless(&[12, 8, 3], 51).bytes();
        let network = Network::new(Blob::parse(&bytes).unwrap().networks().next().unwrap());
        for passes in [1, 3, 4, 6, 101] {
            let mut scratch = Scratch::new();
            network.prepare(&INPUT, &mut scratch);
            let (mut rng, mut samples) = (seeded(52), Vec::new());
            while samples.len() < usize::from(passes) {
                let outputs = network.sampled_passes(&mut scratch, &mut rng);
                let lanes = (0..LANES).map(|lane| [0, 1, 2].map(|i| outputs[i][lane]));
                samples.extend(lanes);
            }
            samples.truncate(usize::from(passes));

            let (mut scratch, mut again) = (Scratch::new(), seeded(52));
            let way = Sampling::Activations(Spread::Exact);
            let got = moments::<3>(&network, &INPUT, passes, way, &mut again, &mut scratch);
            assert_moments(&got, &samples);
            // Not one draw more.
            assert_eq!(again, rng);

            let (mean, variance) = separate_moments::<3>(
                &network,
                &INPUT,
                passes,
                Spread::Exact,
                &mut seeded(52),
                &mut scratch,
            );
            assert_eq!(mean, got.mean);
            for i in 0..3 {
                let expected = got.covariance[i][i];
                assert!((variance[i] - expected).abs() <= 1e-5 * expected, "{i}");
            }
        }
    }

    /// With the same normal numbers a frozen pass differs from one that has its own deviations by little, the
    /// first eighth not at all; and of the moments over many passes so little is missing.
    #[test]
    fn frozen_passes_are_almost_the_others() {
        let bytes = Draft::memoryless(&[12, 64, 64, 64, 64, 64, 3], 55).bytes();
        let network = Network::new(Blob::parse(&bytes).unwrap().networks().next().unwrap());
        let run = |passes, spread, seed| {
            let (mut scratch, mut rng) = (Scratch::new(), seeded(seed));
            let way = Sampling::Activations(spread);
            let got = moments::<3>(&network, &INPUT, passes, way, &mut rng, &mut scratch);
            (got, rng)
        };
        assert_eq!(run(4, Spread::Frozen, 56), run(4, Spread::Exact, 56));
        assert_ne!(run(8, Spread::Frozen, 56).0, run(8, Spread::Exact, 56).0);
        // Not one draw more or less.
        assert_eq!(run(64, Spread::Frozen, 56).1, run(64, Spread::Exact, 56).1);
        let (own, frozen) = (
            run(10_000, Spread::Exact, 57).0,
            run(10_000, Spread::Frozen, 57).0,
        );
        for i in 0..3 {
            let sigma = own.covariance[i][i].sqrt();
            assert!((own.mean[i] - frozen.mean[i]).abs() < 0.03 * sigma, "{i}");
            for j in 0..3 {
                let size = (own.covariance[i][i] * own.covariance[j][j]).sqrt();
                let error = (own.covariance[i][j] - frozen.covariance[i][j]).abs() / size;
                assert!(error < 0.03, "covariance {i} {j}: {error}");
            }
        }
    }

    #[test]
    fn weight_sampled_moments_are_those_of_the_passes_one_by_one() {
        let bytes = Draft::memoryless(&[12, 8, 3], 53).bytes();
        let network = Network::new(Blob::parse(&bytes).unwrap().networks().next().unwrap());
        let mut rng = seeded(54);
        let samples: Vec<[f32; 3]> = (0..7)
            .map(|_| {
                let mut outputs = [0.0; 3];
                network.weight_sampled_pass(&INPUT, &mut rng, &mut outputs);
                outputs
            })
            .collect();
        let mut scratch = Scratch::new();
        let way = Sampling::Weights;
        let got = moments::<3>(&network, &INPUT, 7, way, &mut seeded(54), &mut scratch);
        assert_moments(&got, &samples);
    }
}
