//! Mean and covariance of a network's outputs without drawing anything.
//!
//! Forward go the mean and the variance of every activation, as if activations were independent:
//! enough for what they do to each other's noise. What an output makes of a pre-activation's noise
//! comes back from the outputs as one row of the Jacobian, at the mean slope of every GELU, so
//! that the outputs' covariance holds what the diagonal forgets:
//! `sum over layers of J diag(noise) J'`, where the noise of a hidden unit is that of its weights
//! times the slope, plus what its curve makes of its whole variance.

use super::gelu_moments::GeluMoments;
use super::{Network, Scratch, layer};
use crate::blob::field::{WIDTH_MAX, row_stride};
use crate::blob::{LayerView, NetworkView};
use crate::kernel::{Adjoint, Second, Vector};

/// The outputs' means, and the covariance of `N` of them from `first` on; not yet scaled back.
/// `inputs` are normalised; there is a slot in `outputs` for every output.
pub fn outputs<const N: usize>(
    network: &Network<'_>,
    inputs: &[f32],
    outputs: &mut [f32],
    first: usize,
    scratch: &mut Scratch,
) -> [[f32; N]; N] {
    let (kept, _) = scratch.numbers.as_chunks_mut();
    let mut noise = [0.0; N];
    forward(&network.view, inputs, outputs, first, &mut noise, kept);
    backward(&network.view, noise, first, kept)
}

/// Goes from the inputs to the outputs; `noise` is that of the last layer from output `first` on.
#[inline(never)]
fn forward(
    view: &NetworkView<'_>,
    inputs: &[f32],
    outputs: &mut [f32],
    first: usize,
    noise: &mut [f32],
    kept: &mut [[f32; WIDTH_MAX]],
) {
    let (mut vector, mut second) = (Vector::new(), Second::new());
    let mut mean = [0.0; WIDTH_MAX];
    let mut variance = [0.0; WIDTH_MAX];
    // Variance of a pre-activation that comes from the layers before.
    let mut passed = [0.0; WIDTH_MAX];
    for (slot, &x) in mean.iter_mut().zip(inputs) {
        *slot = x;
    }
    let last = view.layers() - 1;
    for index in 0..last {
        let layer = view.layer(index);
        if index > 0 {
            second.pack(&variance[..layer.inputs]);
            let sums = second.dot_squares(layer.means, layer.outputs);
            let scales = layer.channel_scale.iter();
            for (passed, (sum, scale)) in passed.iter_mut().zip(sums.zip(scales)) {
                *passed = sum * scale * scale;
            }
        }
        let noise = noises(&layer, 0, layer.outputs, &mean, &mut variance, &mut second);
        vector.pack(&mean[..layer.inputs]);
        layer::means(&layer, &mut vector, &mut mean);
        let units = mean.iter_mut().zip(&mut variance).zip(&mut kept[index]);
        let sums = noise.zip(&passed).zip(layer.channel_scale.iter());
        for (((mean, variance), kept), ((noise, passed), scale)) in units.zip(sums) {
            let whole = noise + passed;
            let gelu = GeluMoments::of(*mean, whole);
            let square = gelu.slope * gelu.slope;
            *mean = gelu.mean;
            *variance = square * whole + gelu.beside;
            *kept = both(gelu.slope * scale, square * noise + gelu.beside);
        }
    }
    let layer = view.layer(last);
    let sums = noises(
        &layer,
        first,
        noise.len(),
        &mean,
        &mut variance,
        &mut second,
    );
    for (slot, sum) in noise.iter_mut().zip(sums) {
        *slot = sum;
    }
    vector.pack(&mean[..layer.inputs]);
    layer::means(&layer, &mut vector, outputs);
}

/// Variances of `count` pre-activations from `first` on that are due to this layer's weights and biases.
/// Makes second moments of the variances.
#[inline]
fn noises<'a>(
    layer: &LayerView<'a>,
    first: usize,
    count: usize,
    mean: &[f32; WIDTH_MAX],
    variance: &mut [f32; WIDTH_MAX],
    second: &'a mut Second,
) -> impl Iterator<Item = f32> + use<'a> {
    for (variance, mean) in variance.iter_mut().zip(mean).take(layer.inputs) {
        *variance += mean * mean;
    }
    second.pack(&variance[..layer.inputs]);
    let rows = layer.variance_codes.get(first * row_stride(layer.inputs)..);
    let sums = second.dot_variances(rows.unwrap_or_default(), count);
    let (variance_max, biases) = (layer.variance_max, layer.bias_variance.iter().skip(first));
    sums.zip(biases)
        .map(move |(sum, bias)| sum * variance_max + bias)
}

/// Goes from the outputs to the first hidden layer and collects the noise on the way.
#[inline(never)]
fn backward<const N: usize>(
    view: &NetworkView<'_>,
    noise: [f32; N],
    first: usize,
    kept: &[[f32; WIDTH_MAX]],
) -> [[f32; N]; N] {
    let mut covariance = [[0.0; N]; N];
    let mut rows = [[0.0; N]; WIDTH_MAX];
    let mut adjoint = Adjoint::new();
    let last = view.layers() - 1;
    let scales = view.layer(last).channel_scale;
    for (n, scale) in scales.iter().skip(first).take(N).enumerate() {
        covariance[n][n] = noise[n];
        rows[n][n] = scale;
    }
    for index in (1..=last).rev() {
        let layer = view.layer(index);
        let stride = row_stride(layer.inputs);
        let (from, count) = if index == last {
            (first, N)
        } else {
            (0, layer.outputs)
        };
        adjoint.pack(&rows[..count], stride);
        let codes = layer.means.get(from * stride..).unwrap_or_default();
        let mut units = rows.iter_mut().zip(&kept[index - 1]);
        adjoint.dot_columns(codes, layer.inputs, |_, derivatives| {
            if let Some((row, &kept)) = units.next() {
                let (slope, noise) = apart(kept);
                for i in 0..N {
                    let weighed = derivatives[i] * noise;
                    for j in 0..=i {
                        covariance[i][j] += weighed * derivatives[j];
                    }
                    row[i] = derivatives[i] * slope;
                }
            }
        });
    }
    for i in 0..N {
        for j in 0..i {
            covariance[j][i] = covariance[i][j];
        }
    }
    covariance
}

/// Two numbers in the room of one, each with eight bits of mantissa.
#[inline]
fn both(high: f32, low: f32) -> f32 {
    let rounded = |x: f32| x.to_bits().wrapping_add(0x8000);
    f32::from_bits(rounded(high) & 0xFFFF_0000 | rounded(low) >> 16)
}

/// The two numbers that [`both`] put together.
#[inline]
fn apart(both: f32) -> (f32, f32) {
    let bits = both.to_bits();
    (
        f32::from_bits(bits & 0xFFFF_0000),
        f32::from_bits(bits << 16),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::Blob;
    use crate::blob::draft::Draft;
    use crate::gaussian::standard_normal;
    use crate::network::monte_carlo::{Sampling, moments};
    use crate::rng::seeded;

    fn input(seed: u64) -> [f32; 12] {
        let mut rng = seeded(seed);
        core::array::from_fn(|_| standard_normal(&mut rng))
    }

    /// Nothing is approximated but the numbers' formats: sums over the weights in f64.
    #[test]
    fn one_layer_is_exact() {
        let draft = Draft::memoryless(&[12, 3], 61);
        let (bytes, layer) = (draft.bytes(), &draft.networks[0][0]);
        let network = Network::new(Blob::parse(&bytes).unwrap().networks().next().unwrap());
        let (x, mut mean) = (input(62), [f32::NAN; 3]);
        let covariance: [[f32; 3]; 3] = outputs(&network, &x, &mut mean, 0, &mut Scratch::new());
        let mut same = [0.0; 3];
        network.mean_pass(&x, &mut same);
        assert_eq!(mean, same);
        for i in 0..3 {
            let terms = (0..12).map(|k| layer.variance(i, k) * f64::from(x[k] * x[k]));
            let expected = f64::from(layer.bias_variance[i]) + terms.sum::<f64>();
            assert!((f64::from(covariance[i][i]) / expected - 1.0).abs() < 2e-3);
            for j in 0..3 {
                assert!(i == j || covariance[i][j] == 0.0);
            }
        }
    }

    /// Distance between covariances as a share, and of means in deviations, from many passes.
    fn errors(widths: &[usize], seed: u64) -> (f32, f32) {
        let bytes = Draft::memoryless(widths, seed).bytes();
        let network = Network::new(Blob::parse(&bytes).unwrap().networks().next().unwrap());
        let (x, mut scratch, mut rng) = (input(seed + 1), Scratch::new(), seeded(seed));
        let sampled = (0..10).map(|_| {
            moments::<3>(
                &network,
                &x,
                10_000,
                Sampling::Activations,
                &mut rng,
                &mut scratch,
            )
        });
        let (mut mean, mut covariance) = ([0.0_f32; 3], [[0.0_f32; 3]; 3]);
        for batch in sampled {
            for i in 0..3 {
                mean[i] += batch.mean[i] / 10.0;
                for j in 0..3 {
                    covariance[i][j] += batch.covariance[i][j] / 10.0;
                }
            }
        }
        let mut got = [0.0; 3];
        let found: [[f32; 3]; 3] = outputs(&network, &x, &mut got, 0, &mut scratch);
        let (mut apart, mut size, mut shift) = (0.0, 0.0, 0.0_f32);
        for i in 0..3 {
            shift = shift.max((got[i] - mean[i]).abs() / covariance[i][i].sqrt());
            for j in 0..3 {
                assert_eq!(found[i][j], found[j][i]);
                apart += (found[i][j] - covariance[i][j]).powi(2);
                size += covariance[i][j].powi(2);
            }
        }
        ((apart / size).sqrt(), shift)
    }

    /// Widths with and without rests, up to the most layers; 1e5 passes err by half a per cent.
    #[test]
    fn moments_are_those_of_many_passes() {
        let shapes: [&[usize]; 4] = [
            &[12, 9, 3],
            &[12, 9, 7, 3],
            &[12, 64, 64, 3],
            &[12, 8, 8, 8, 8, 8, 8, 8, 3],
        ];
        for (index, widths) in shapes.into_iter().enumerate() {
            let (covariance, mean) = errors(widths, 70 + index as u64);
            assert!(
                covariance < 0.1 && mean < 0.05,
                "{widths:?}: {covariance} {mean}"
            );
        }
    }

    #[test]
    fn some_outputs_are_a_part_of_all() {
        let bytes = Draft::memoryless(&[12, 9, 7, 3], 81).bytes();
        let network = Network::new(Blob::parse(&bytes).unwrap().networks().next().unwrap());
        let (x, mut scratch) = (input(82), Scratch::new());
        let (mut mean, mut again) = ([0.0; 3], [0.0; 3]);
        let all: [[f32; 3]; 3] = outputs(&network, &x, &mut mean, 0, &mut scratch);
        let part: [[f32; 2]; 2] = outputs(&network, &x, &mut again, 1, &mut scratch);
        assert_eq!(mean, again);
        for i in 0..2 {
            for j in 0..2 {
                let size = (all[i + 1][i + 1] * all[j + 1][j + 1]).sqrt();
                assert!((part[i][j] - all[i + 1][j + 1]).abs() < 1e-4 * size);
            }
        }
    }

    #[test]
    fn what_is_not_finite_does_not_come_out_as_a_number() {
        let bytes = Draft::memoryless(&[12, 9, 7, 3], 83).bytes();
        let network = Network::new(Blob::parse(&bytes).unwrap().networks().next().unwrap());
        for bad in [f32::NAN, f32::INFINITY, 1e30] {
            let (mut x, mut mean) = (input(84), [0.0; 3]);
            x[5] = bad;
            let _: [[f32; 3]; 3] = outputs(&network, &x, &mut mean, 0, &mut Scratch::new());
            assert!(mean.iter().all(|mean| !mean.is_finite()), "{bad}");
        }
    }

    #[test]
    fn two_numbers_keep_eight_bits_each() {
        let mut rng = seeded(85);
        for _ in 0..1000 {
            let [a, b] = [1.0, 1e-6].map(|size| size * standard_normal(&mut rng));
            let (high, low) = apart(both(a, b));
            for (got, expected) in [(high, a), (low, b)] {
                assert!((got - expected).abs() <= expected.abs() / 256.0);
            }
        }
    }
}
