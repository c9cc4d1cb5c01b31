//! Mean and covariance of a network's outputs without drawing anything.
//!
//! Forward go the mean and the variance of every activation, as if activations were independent:
//! enough for what they do to each other's noise. What an output makes of a pre-activation's noise
//! comes back from the outputs as one row of the Jacobian, at the mean slope of every activation, so
//! that the outputs' covariance holds what the diagonal forgets:
//! `sum over layers of J diag(noise) J'`, where the noise of a hidden unit is that of its weights
//! times the slope, plus what its curve makes of its whole variance.

use super::repeats::Repeats;
use super::unit_moments::UnitMoments;
use super::{Network, Noise, Scratch, layer};
use crate::blob::field::{WIDTH_MAX, row_stride};
use crate::blob::{Activation, LayerView, NetworkView};
use crate::kernel::{Alike, Second, VECTORS, row_bits};

/// What the square of an int8 code of a mean is on average, where the largest of a row is 127.
const CODE_SQUARED: f32 = 2_600.0;
/// What a pre-activation has of the layers before is neglected where it is guessed to be less than this
/// share of the layer's own noise.
const NEGLECTED: f32 = 0.25;

/// The outputs' means, and the covariance of `N` of them, at most three, from `first` on; not yet
/// scaled back. `inputs` are normalised; there is a slot in `outputs` for every output; `repeats` are the network's
/// or none.
pub fn outputs<const N: usize>(
    network: &Network<'_>,
    repeats: &Repeats,
    inputs: &[f32],
    outputs: &mut [f32],
    first: usize,
    scratch: &mut Scratch,
) -> [[f32; N]; N] {
    const { assert!(N <= VECTORS) };
    let mut noise = [0.0; VECTORS];
    let own = &mut noise[..N];
    forward(&network.view, repeats, inputs, outputs, first, own, scratch);
    let covariance = backward(&network.view, own, first, scratch);
    core::array::from_fn(|i| core::array::from_fn(|j| covariance[i.max(j)][i.min(j)]))
}

/// Goes from the inputs to the outputs; `noise` is that of the last layer from output `first` on.
#[inline(never)]
fn forward(
    view: &NetworkView<'_>,
    repeats: &Repeats,
    inputs: &[f32],
    outputs: &mut [f32],
    first: usize,
    last_noise: &mut [f32],
    scratch: &mut Scratch,
) {
    let Scratch {
        vector,
        activations,
        noise: rooms,
        units: hidden,
        ..
    } = scratch;
    let Some(Noise { second, .. }) = rooms.first_mut() else {
        return;
    };
    // Of what goes into a layer, then of what comes out.
    let (arrays, _) = activations.as_flattened_mut().as_chunks_mut();
    let [mean, variance, noise, passed] = arrays else {
        return;
    };
    for (slot, &x) in mean.iter_mut().zip(inputs) {
        *slot = x;
    }
    variance.fill(0.0);
    let last = view.layers().saturating_sub(1);
    for (index, kept) in hidden.iter_mut().enumerate().take(last) {
        let layer = view.layer(index);
        let outputs = layer.outputs.min(WIDTH_MAX);
        square(&layer, mean, variance, passed, second);
        let own = &mut noise[..outputs];
        noises(&layer, 0, repeats.layer(index), second, own);
        if index == 0 {
            passed.fill(0.0);
        } else {
            pass(&layer, variance, noise, second, &mut passed[..outputs]);
        }
        vector.pack(&mean[..layer.inputs.min(WIDTH_MAX)]);
        layer::means(&layer, vector, mean);
        let units = mean.iter_mut().zip(variance.iter_mut()).zip(kept);
        let sums = noise.iter().zip(passed.iter());
        let pairs = units.zip(sums.zip(layer.channel_scale.iter()));
        match view.activation() {
            Activation::Gelu => activate(pairs, UnitMoments::of_gelu),
            Activation::Relu => activate(pairs, UnitMoments::of_relu),
            Activation::Tanh => activate(pairs, UnitMoments::of_tanh),
            Activation::Identity => activate(pairs, UnitMoments::of_identity),
        }
    }
    let layer = view.layer(last);
    square(&layer, mean, variance, passed, second);
    noises(&layer, first, Alike::NONE, second, last_noise);
    vector.pack(&mean[..layer.inputs.min(WIDTH_MAX)]);
    layer::means(&layer, vector, outputs);
}

/// Makes of the mean of every pre-activation and of its variance, of the layer's own noise and of what came
/// through it, those of the activation, and what goes back keeps.
#[inline]
fn activate<'a>(
    units: impl Iterator<
        Item = (
            ((&'a mut f32, &'a mut f32), &'a mut f32),
            ((&'a f32, &'a f32), f32),
        ),
    >,
    moments: impl Fn(f32, f32) -> UnitMoments,
) {
    for (((mean, variance), kept), ((noise, passed), scale)) in units {
        let whole = noise + passed;
        let unit = moments(*mean, whole);
        let square = unit.slope * unit.slope;
        *mean = unit.mean;
        *variance = square * whole + unit.beside;
        *kept = both(unit.slope * scale, square * noise + unit.beside);
    }
}

/// Packs the second moments of what goes into a layer; they are put together in `moments`.
#[inline]
fn square(
    layer: &LayerView<'_>,
    mean: &[f32; WIDTH_MAX],
    variance: &[f32; WIDTH_MAX],
    moments: &mut [f32; WIDTH_MAX],
    second: &mut Second,
) {
    let moments = &mut moments[..layer.inputs.min(WIDTH_MAX)];
    for (moment, (mean, variance)) in moments.iter_mut().zip(mean.iter().zip(variance)) {
        *moment = variance + mean * mean;
    }
    second.pack(moments);
}

/// Variances of pre-activations from `first` on that are due to this layer's weights and biases, as many as
/// there is room for; `second` holds the inputs' second moments.
#[inline]
fn noises(
    layer: &LayerView<'_>,
    first: usize,
    alike: Alike,
    second: &mut Second,
    noise: &mut [f32],
) {
    let rows = layer.variance_codes.get(first * row_stride(layer.inputs)..);
    second.dot_variances(rows.unwrap_or_default(), alike, noise);
    for (noise, bias) in noise.iter_mut().zip(layer.bias_variance.iter().skip(first)) {
        *noise = *noise * layer.variance_max + bias;
    }
}

/// Variances of pre-activations that come from the layers before, as if activations were independent;
/// zero where that is next to nothing beside `noise`.
#[inline]
fn pass(
    layer: &LayerView<'_>,
    variance: &[f32; WIDTH_MAX],
    noise: &[f32; WIDTH_MAX],
    second: &mut Second,
    passed: &mut [f32],
) {
    let variance = &variance[..layer.inputs.min(WIDTH_MAX)];
    second.pack(variance);
    let all = CODE_SQUARED / NEGLECTED * variance.iter().sum::<f32>();
    let rows = layer.channel_scale.iter().zip(noise).zip(passed.iter_mut());
    let counts = row_bits(rows.map(|((scale, noise), passed)| {
        *passed = 0.0;
        scale * scale * all >= *noise
    }));
    second.dot_squares(layer.means, counts, |row, sum| {
        if let Some(passed) = passed.get_mut(row) {
            let scale = layer.channel_scale.get(row);
            *passed = sum * (scale * scale);
        }
    });
}

/// Goes from the outputs to the first hidden layer and collects the noise on the way: the lower triangle of
/// the covariance.
#[inline(never)]
fn backward(
    view: &NetworkView<'_>,
    noise: &[f32],
    first: usize,
    scratch: &mut Scratch,
) -> [[f32; VECTORS]; VECTORS] {
    let Scratch {
        activations,
        noise: rooms,
        units: hidden,
        ..
    } = scratch;
    let mut covariance = [[0.0; VECTORS]; VECTORS];
    let Some(Noise { adjoint, .. }) = rooms.first_mut() else {
        return covariance;
    };
    let (rows, _) = activations.as_flattened_mut().as_chunks_mut::<VECTORS>();
    let last = view.layers().saturating_sub(1);
    let scales = view.layer(last).channel_scale;
    let outputs = noise.iter().zip(scales.iter().skip(first));
    for (n, ((noise, scale), (row, covariance))) in outputs
        .zip(rows.iter_mut().zip(&mut covariance))
        .enumerate()
    {
        *row = core::array::from_fn(|i| if i == n { scale } else { 0.0 });
        covariance[n] = *noise;
    }
    let mut squares: [f32; VECTORS] = core::array::from_fn(|i| {
        let scale = noise.get(i).map_or(0.0, |_| scales.get(first + i));
        scale * scale
    });
    // Rows of the layer that go back, from one on.
    let (mut from, mut count) = (first, noise.len());
    for (index, kept) in hidden.iter().enumerate().take(last).rev() {
        let layer = view.layer(index + 1);
        let stride = row_stride(layer.inputs);
        adjoint.pack(&rows[..count.min(WIDTH_MAX)], &squares, stride);
        squares = [0.0; VECTORS];
        let codes = layer.means.get(from * stride..).unwrap_or_default();
        let columns = adjoint.dot_columns(codes, layer.inputs);
        for ((row, &kept), derivatives) in rows.iter_mut().zip(kept).zip(columns) {
            let (slope, noise) = apart(kept);
            for i in 0..VECTORS {
                let weighed = derivatives[i] * noise;
                for j in 0..=i {
                    covariance[i][j] += weighed * derivatives[j];
                }
                row[i] = derivatives[i] * slope;
                squares[i] += row[i] * row[i];
            }
        }
        (from, count) = (0, layer.inputs);
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
    use crate::spread::Spread;

    const ACTIVATIONS: [Activation; 4] = [
        Activation::Gelu,
        Activation::Relu,
        Activation::Tanh,
        Activation::Identity,
    ];

    fn input(seed: u64) -> [f32; 12] {
        let mut rng = seeded(seed);
        core::array::from_fn(|_| standard_normal(&mut rng))
    }

    fn network(bytes: &[u8]) -> Network<'_> {
        Network::new(Blob::parse(bytes).unwrap().networks().next().unwrap())
    }

    /// As a memoryless tracker asks for them.
    fn all_moments<const N: usize>(
        network: &Network<'_>,
        inputs: &[f32],
        mean: &mut [f32],
        first: usize,
        scratch: &mut Scratch,
    ) -> [[f32; N]; N] {
        let repeats = Repeats::of(network);
        outputs(network, &repeats, inputs, mean, first, scratch)
    }

    /// Nothing is approximated but the numbers' formats: sums over the weights in f64.
    #[test]
    fn one_layer_is_exact() {
        let draft = Draft::memoryless(&[12, 3], 61);
        let (bytes, layer) = (draft.bytes(), &draft.networks[0][0]);
        let network = network(&bytes);
        let (x, mut mean) = (input(62), [f32::NAN; 3]);
        let covariance: [[f32; 3]; 3] =
            all_moments(&network, &x, &mut mean, 0, &mut Scratch::new());
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
    fn errors(widths: &[usize], activation: Activation, seed: u64) -> (f32, f32) {
        let mut draft = Draft::memoryless(widths, seed);
        draft.activation = activation;
        let bytes = draft.bytes();
        let network = network(&bytes);
        let (x, mut scratch, mut rng) = (input(seed + 1), Scratch::new(), seeded(seed));
        let sampled = (0..10).map(|_| {
            moments::<3>(
                &network,
                &x,
                10_000,
                Sampling::Activations(Spread::Exact),
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
        let found: [[f32; 3]; 3] = all_moments(&network, &x, &mut got, 0, &mut scratch);
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
            for activation in ACTIVATIONS {
                let (covariance, mean) = errors(widths, activation, 70 + index as u64);
                assert!(
                    covariance < 0.1 && mean < 0.05,
                    "{activation}, {widths:?}: {covariance} {mean}"
                );
            }
        }
    }

    /// Rows that are the same in a layer of their own, not the first and not the last: what is found there holds
    /// there, and changes nothing.
    #[test]
    fn rows_that_are_the_same_are_summed_once_to_the_same_bits() {
        let mut draft = Draft::memoryless(&[12, 9, 20, 7, 3], 87);
        let codes = &mut draft.networks[0][1].variance_codes;
        let row = codes[4 * 9..5 * 9].to_vec();
        for other in [6, 11, 12, 19] {
            codes[other * 9..][..9].copy_from_slice(&row);
        }
        let bytes = draft.bytes();
        let network = network(&bytes);
        let (x, mut scratch, repeats) = (input(88), Scratch::new(), Repeats::of(&network));
        let alike = repeats.layer(1);
        assert_eq!(
            (alike.first, alike.others),
            (4, 1 << 6 | 1 << 11 | 1 << 12 | 1 << 19)
        );
        for index in [0, 2, 3, 7, usize::MAX] {
            assert_eq!(repeats.layer(index), Alike::NONE, "{index}");
        }
        let (mut mean, mut again) = ([0.0; 3], [0.0; 3]);
        let once: [[f32; 3]; 3] = outputs(&network, &repeats, &x, &mut mean, 0, &mut scratch);
        let each = outputs(&network, &Repeats::NONE, &x, &mut again, 0, &mut scratch);
        assert_eq!((once, mean), (each, again));
    }

    #[test]
    fn some_outputs_are_a_part_of_all() {
        let bytes = Draft::memoryless(&[12, 9, 7, 3], 81).bytes();
        let network = network(&bytes);
        let (x, mut scratch) = (input(82), Scratch::new());
        let (mut mean, mut again) = ([0.0; 3], [0.0; 3]);
        let all: [[f32; 3]; 3] = all_moments(&network, &x, &mut mean, 0, &mut scratch);
        let part: [[f32; 2]; 2] = all_moments(&network, &x, &mut again, 1, &mut scratch);
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
        for activation in ACTIVATIONS {
            let mut draft = Draft::memoryless(&[12, 9, 7, 3], 83);
            draft.activation = activation;
            let bytes = draft.bytes();
            let network = network(&bytes);
            for bad in [f32::NAN, f32::INFINITY, 1e30] {
                let (mut x, mut mean) = (input(84), [0.0; 3]);
                x[5] = bad;
                let _: [[f32; 3]; 3] = all_moments(&network, &x, &mut mean, 0, &mut Scratch::new());
                let finite = mean.iter().any(|mean| mean.is_finite());
                assert!(!finite, "{activation} {bad}");
            }
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
