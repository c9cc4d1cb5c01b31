use super::*;
use crate::blob::Blob;
use crate::blob::draft::{Draft, DraftLayer};
use crate::gaussian::standard_normal;
use crate::rng::seeded;
use std::vec::Vec;

/// Of a naive f64 pass, relative to its largest output: 16-bit activations, 12-bit squares and
/// 13-bit variances, through three layers.
const QUANTISED: f64 = 0.02;

fn input() -> [f32; 12] {
    let mut rng = seeded(41);
    core::array::from_fn(|_| standard_normal(&mut rng))
}

fn naive_activation(activation: Activation, x: f64) -> f64 {
    match activation {
        Activation::Gelu => x * 0.5 * libm::erfc(-x / core::f64::consts::SQRT_2),
        Activation::Relu => x.max(0.0),
        Activation::Tanh => libm::tanh(x),
        Activation::Identity => x,
    }
}

/// Layers of f64 sums with the draft's activation between them; `pre_activation` makes of the mean
/// and the variance of each what goes on.
fn naive(
    activation: Activation,
    layers: &[DraftLayer],
    inputs: &[f32],
    mut pre_activation: impl FnMut(f64, f64) -> f64,
) -> Vec<f64> {
    let mut current: Vec<f64> = inputs.iter().map(|&x| f64::from(x)).collect();
    for (index, layer) in layers.iter().enumerate() {
        let next = (0..layer.outputs).map(|row| {
            let mut mean = f64::from(layer.bias_mean[row]);
            let mut variance = f64::from(layer.bias_variance[row]);
            for (column, x) in current.iter().enumerate() {
                mean += layer.mean(row, column) * x;
                variance += layer.variance(row, column) * x * x;
            }
            let x = pre_activation(mean, variance);
            if index + 1 == layers.len() {
                x
            } else {
                naive_activation(activation, x)
            }
        });
        current = next.collect();
    }
    current
}

fn assert_close(got: &[f32], expected: &[f64], tolerance: f64) {
    let largest = expected.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
    assert_eq!(got.len(), expected.len());
    for (got, expected) in got.iter().zip(expected) {
        let error = (f64::from(*got) - expected).abs();
        assert!(error < tolerance * largest, "{got} {expected}");
    }
}

/// One layer, and three with each activation; the first output is far below zero, so that an
/// activation would show.
fn drafts() -> Vec<Draft> {
    let three: &[usize] = &[12, 9, 7, 3];
    let cases = [
        (&[12, 3][..], Activation::Gelu),
        (&[12, 3], Activation::Relu),
        (three, Activation::Gelu),
        (three, Activation::Relu),
        (three, Activation::Tanh),
        (three, Activation::Identity),
    ];
    let draft = |(widths, activation)| {
        let mut draft = Draft::memoryless(widths, 42);
        draft.activation = activation;
        let last = draft.networks[0].last_mut().expect("layers");
        last.bias_mean[0] = -4.0;
        draft
    };
    cases.map(draft).into()
}

#[test]
fn the_mean_pass_is_the_naive_pass() {
    for draft in drafts() {
        let bytes = draft.bytes();
        let network = Network::new(Blob::parse(&bytes).unwrap().networks().next().unwrap());
        assert_eq!((network.inputs(), network.outputs()), (12, 3));
        let mut got = [f32::NAN; 3];
        network.mean_pass(&input(), &mut got);
        // A scratch that was used says the same.
        let (mut scratch, mut again) = (Scratch::new(), [f32::NAN; 3]);
        for _ in 0..2 {
            network.mean_pass_in(&mut scratch, &input(), &mut again);
            assert_eq!(again, got);
        }
        let expected = naive(draft.activation, &draft.networks[0], &input(), |mean, _| {
            mean
        });
        assert!(expected[0] < -1.0, "{expected:?}");
        assert_close(&got, &expected, 2e-3);
    }
}

/// The same normal numbers, drawn for each pre-activation in turn, all passes of it together.
#[test]
fn sampled_passes_draw_every_pre_activation() {
    for draft in drafts() {
        let bytes = draft.bytes();
        let network = Network::new(Blob::parse(&bytes).unwrap().networks().next().unwrap());
        let mut scratch = Scratch::default();
        network.prepare(&input(), &mut scratch);
        let mut rng = seeded(44);
        for _ in 0..3 {
            let mut same = rng.clone();
            let got = network.sampled_passes(&mut scratch, &mut rng);
            let count = draft.networks[0].iter().map(|layer| layer.outputs).sum();
            let normals: Vec<[f32; LANES]> =
                (0..count).map(|_| standard_normals(&mut same)).collect();
            for lane in 0..LANES {
                let mut left = normals.iter();
                let expected = naive(
                    draft.activation,
                    &draft.networks[0],
                    &input(),
                    |mean, variance| {
                        let normal = left.next().expect("one for each")[lane];
                        mean + variance.sqrt() * f64::from(normal)
                    },
                );
                let got: Vec<f32> = got[..3].iter().map(|lanes| lanes[lane]).collect();
                assert!(expected[0] < -1.0, "{expected:?}");
                assert_close(&got, &expected, QUANTISED);
            }
        }
    }
}

/// The same normal numbers, the bias of a row first, then its weights.
#[test]
fn a_weight_sampled_pass_draws_every_weight() {
    for draft in drafts() {
        let bytes = draft.bytes();
        let network = Network::new(Blob::parse(&bytes).unwrap().networks().next().unwrap());
        let mut got = [f32::NAN; 3];
        network.weight_sampled_pass(&input(), &mut seeded(45), &mut got);
        let mut rng = seeded(45);
        let mut drawn = draft.networks[0].clone();
        for layer in &mut drawn {
            let mut sampled = std::vec![];
            for row in 0..layer.outputs {
                let sigma = layer.bias_variance[row].sqrt();
                layer.bias_mean[row] += sigma * standard_normal(&mut rng);
                for column in 0..layer.inputs {
                    let sigma = layer.variance(row, column).sqrt();
                    let normal = f64::from(standard_normal(&mut rng));
                    sampled.push(layer.mean(row, column) + sigma * normal);
                }
            }
            layer.drawn = Some(sampled);
        }
        let expected = naive(draft.activation, &drawn, &input(), |mean, _| mean);
        assert_close(&got, &expected, 1e-4);
    }
}

#[test]
fn scratch_holds_four_passes_of_the_widest_layer() {
    let kernels = size_of::<Vector>() + size_of::<Second>() + size_of::<Adjoint>();
    let own = size_of::<Packed<LANES>>() + kernels;
    let units = 7 * 64 * 4;
    assert_eq!(size_of::<Scratch>(), own + 64 * 4 * 4 + 64 * 8 + units);
}
