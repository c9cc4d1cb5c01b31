//! One Bayesian dense layer: moments of its pre-activations for given inputs.
//!
//! For a fixed input x the pre-activations of a mean-field Gaussian layer are independent
//! Gaussians with mean `mu.x + mu_b` and variance `sigma^2.x^2 + sigma_b^2`, so drawing them is
//! drawing the weights (local reparameterisation, Kingma et al. 2015).

use crate::blob::LayerView;
use crate::blob::field::row_stride;
use crate::gaussian::standard_normal;
use crate::kernel::{Packed, Vector, sqrt};
use rand_core::Rng;

/// Calls `each(slot, mean, variance)` with the moments of every pre-activation, for `L` passes; there is a
/// slot for every output.
#[inline]
pub fn moments<const L: usize, T>(
    layer: &LayerView<'_>,
    packed: &Packed<L>,
    slots: impl IntoIterator<Item = T>,
    mut each: impl FnMut(T, [f32; L], [f32; L]),
) {
    // A row is never empty, which the compiler does not know.
    let stride = row_stride(layer.inputs).max(1);
    let rows = layer
        .means
        .chunks_exact(stride)
        .zip(layer.variance_codes.chunks_exact(stride));
    let channels = layer.channel_scale.iter();
    let biases = layer.bias_mean.iter().zip(layer.bias_variance.iter());
    let rows = rows.zip(channels).zip(biases).zip(slots);
    for ((((means, codes), scale), (bias_mean, bias_variance)), slot) in rows {
        let (mean, variance) = packed.dots(means, codes);
        each(
            slot,
            mean.map(|dot| dot * scale + bias_mean),
            variance.map(|dot| dot * layer.variance_max + bias_variance),
        );
    }
}

/// Calls `each(slot, mean)` with the mean of every pre-activation, for `L` passes whose values alone are
/// packed; there is a slot for every output.
#[inline]
pub fn pass_means<const L: usize, T>(
    layer: &LayerView<'_>,
    packed: &mut Packed<L>,
    slots: impl IntoIterator<Item = T>,
    mut each: impl FnMut(T, [f32; L]),
) {
    let channels = layer.channel_scale.iter().zip(layer.bias_mean.iter());
    let mut channels = channels.zip(slots);
    packed.dot_rows(layer.means, row_stride(layer.inputs), |mean| {
        if let Some(((scale, bias), slot)) = channels.next() {
            each(slot, mean.map(|dot| dot * scale + bias));
        }
    });
}

/// The means of the pre-activations alone, one in `means` for every output: the layer with every
/// weight at its mean. `vector` holds the inputs.
#[inline]
pub fn means(layer: &LayerView<'_>, vector: &mut Vector, means: &mut [f32]) {
    vector.dot_rows(
        layer.means,
        layer.channel_scale.bytes(),
        layer.bias_mean.bytes(),
        means,
    );
}

/// The layer for one draw of every weight and bias, in f32 throughout: the definition that
/// [`moments`] is verified against. Writes `outputs` pre-activations.
pub fn sample_weights(
    layer: &LayerView<'_>,
    inputs: &[f32],
    rng: &mut impl Rng,
    outputs: &mut [f32],
) {
    for (output, sum) in outputs.iter_mut().enumerate().take(layer.outputs) {
        let bias_sigma = sqrt(layer.bias_variance.get(output));
        *sum = layer.bias_mean.get(output) + bias_sigma * standard_normal(rng);
        for (input, &x) in inputs.iter().enumerate().take(layer.inputs) {
            let sigma = sqrt(layer.variance(output, input));
            *sum += (layer.mean(output, input) + sigma * standard_normal(rng)) * x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::Blob;
    use crate::blob::draft::Draft;
    use crate::rng::seeded;
    use std::vec::Vec;

    const INPUTS: usize = 12;
    const OUTPUTS: usize = 3;

    fn inputs() -> [f32; INPUTS] {
        let mut rng = seeded(31);
        core::array::from_fn(|_| standard_normal(&mut rng))
    }

    /// Sums over the weights as the format defines them, in f64.
    #[test]
    fn moments_are_the_sums_over_weights() {
        let draft = Draft::memoryless(&[INPUTS, OUTPUTS], 31);
        let (bytes, weights) = (draft.bytes(), &draft.networks[0][0]);
        let layer = Blob::parse(&bytes)
            .unwrap()
            .networks()
            .next()
            .unwrap()
            .layer(0);
        let x = inputs();
        // The second pass sees other inputs.
        let lanes = x.map(|x| [x, 2.0 - x]);
        let mut packed = Packed::<2>::new();
        packed.pack(&lanes);
        // One more than there are outputs.
        let mut places: Vec<usize> = (0..=OUTPUTS).collect();
        let mut seen = 0;
        moments(&layer, &packed, &mut places, |output, mean, variance| {
            let output = *output;
            assert_eq!(output, seen);
            seen += 1;
            for lane in 0..2 {
                let x = |input: usize| f64::from(lanes[input][lane]);
                let expected = f64::from(weights.bias_mean[output])
                    + (0..INPUTS)
                        .map(|i| weights.mean(output, i) * x(i))
                        .sum::<f64>();
                assert!((f64::from(mean[lane]) - expected).abs() < 1e-3);
                let expected = f64::from(weights.bias_variance[output])
                    + (0..INPUTS)
                        .map(|i| weights.variance(output, i) * x(i) * x(i))
                        .sum::<f64>();
                assert!((f64::from(variance[lane]) / expected - 1.0).abs() < 0.01);
            }
        });
        assert_eq!(seen, OUTPUTS);
    }

    #[test]
    fn means_alone_are_the_means_of_the_moments() {
        let bytes = Draft::memoryless(&[INPUTS, 7, OUTPUTS], 33).bytes();
        let network = Blob::parse(&bytes).unwrap().networks().next().unwrap();
        let layer = network.layer(0);
        let (mut packed, mut vector) = (Packed::<1>::new(), Vector::new());
        packed.pack(&inputs().map(|x| [x]));
        vector.pack(&inputs());
        let mut got = [f32::NAN; 8];
        means(&layer, &mut vector, &mut got);
        let mut seen = 0;
        moments(&layer, &packed, &mut got, |got, mean, _| {
            assert_eq!(*got, mean[0]);
            seen += 1;
        });
        assert_eq!(seen, 7);
        assert!(got[7].is_nan());
    }

    /// The same normal numbers in f64: the bias of a row first, then its weights.
    #[test]
    fn sampled_weights_are_their_means_and_sigmas_times_normals() {
        let draft = Draft::memoryless(&[INPUTS, OUTPUTS], 32);
        let (bytes, weights) = (draft.bytes(), &draft.networks[0][0]);
        let layer = Blob::parse(&bytes)
            .unwrap()
            .networks()
            .next()
            .unwrap()
            .layer(0);
        let x = inputs();
        let mut got = [f32::NAN; OUTPUTS];
        sample_weights(&layer, &x, &mut seeded(5), &mut got);
        let mut rng = seeded(5);
        let mut normal = || f64::from(standard_normal(&mut rng));
        for output in 0..OUTPUTS {
            let mut expected = f64::from(weights.bias_mean[output])
                + f64::from(weights.bias_variance[output]).sqrt() * normal();
            for (input, &x) in x.iter().enumerate() {
                let sigma = weights.variance(output, input).sqrt();
                let weight = weights.mean(output, input) + sigma * normal();
                expected += weight * f64::from(x);
            }
            assert!((f64::from(got[output]) - expected).abs() < 1e-5, "{output}");
        }
    }
}
