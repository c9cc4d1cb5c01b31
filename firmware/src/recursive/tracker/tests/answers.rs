use super::super::*;
use super::bench::{
    Bench, constant, measurement, near, now, outputs, parameters, settings, started,
};
use crate::blob::Blob;
use crate::blob::draft::Draft;
use crate::inference::Inference;
use crate::network::monte_carlo::separate_moments;
use crate::network::repeats::Repeats;
use crate::network::{Network, Scratch, moments};
use crate::recursive::features::FEATURES;
use crate::recursive::schedule::{OUTPUTS, Schedule};
use crate::rng::seeded;

/// Inputs are normalised and kept within four deviations, outputs are scaled back; the spread of
/// the mean jerk over passes becomes white jerk.
#[test]
fn the_network_reads_and_answers_in_its_own_units() {
    let mut draft = Draft::recursive(3);
    for (i, pair) in draft.inputs.iter_mut().enumerate() {
        *pair = [0.1 * i as f32, 0.5 + 0.01 * i as f32];
    }
    for (i, pair) in draft.outputs.iter_mut().enumerate() {
        *pair = [0.2 * i as f32, 0.5 + 0.03 * i as f32];
    }
    let bytes = draft.bytes();
    let blob = Blob::parse(&bytes).expect("a blob");
    let raw: [f32; FEATURES] = core::array::from_fn(|i| (1.7 * i as f32).sin() * 12.0);
    let expected_inputs = core::array::from_fn(|i| {
        let [mean, inverse] = draft.inputs[i];
        ((raw[i] - mean) * inverse).clamp(-4.0, 4.0)
    });
    let network = Network::new(blob.networks().next().expect("one"));
    let passes = [1, 2, 20].map(|passes| Inference::of_passes(passes).unwrap());
    for inference in passes.into_iter().chain([Inference::Moments]) {
        let mut tracker = Bench::new(
            blob,
            Settings {
                inference,
                ..settings()
            },
        );
        let mut inputs = raw;
        let (outputs, jerk_variance) = tracker.infer(&mut inputs);
        assert_eq!(inputs, expected_inputs);
        let (mut plain, mut variances) = ([0.0; OUTPUTS], [0.0; OUTPUTS]);
        let (scratch, repeats) = (&mut Scratch::new(), Repeats::NONE);
        match inference {
            Inference::Mean => network.mean_pass(&inputs, &mut plain),
            Inference::Passes(passes) => {
                let rng = &mut seeded(5);
                let (count, spread) = (passes.count(), passes.spread());
                (plain, variances) =
                    separate_moments(&network, &inputs, count, spread, rng, scratch);
            }
            Inference::Moments => {
                for output in 4..7 {
                    let [[variance]] =
                        moments::outputs(&network, &repeats, &inputs, &mut plain, output, scratch);
                    variances[output] = variance;
                }
            }
        }
        for i in 0..OUTPUTS {
            let [mean, scale] = draft.outputs[i];
            assert!(near(outputs[i], mean + scale * plain[i], 10.0), "{i}");
        }
        for axis in 0..3 {
            let scale = 2.0 * draft.outputs[4 + axis][1];
            let expected = scale * scale * variances[4 + axis];
            // Three outputs together are quantised as one alone, to the steps of the adjoint.
            let apart = jerk_variance[axis] - expected;
            assert!(apart.abs() <= 1e-3 * expected, "{axis}");
            assert_eq!(expected > 0.0, inference != Inference::Mean);
        }
    }
}

/// The doubt about the mean jerk is added to the noise, by the length of the part.
#[test]
fn a_doubtful_jerk_is_noise() {
    let mut draft = constant(outputs());
    draft.networks[0][1].bias_variance[4..7].copy_from_slice(&[4.0, 9.0, 16.0]);
    let bytes = draft.bytes();
    let blob = Blob::parse(&bytes).expect("a blob");
    let mut tracker = Bench::new(
        blob,
        Settings {
            inference: Inference::of_passes(16).unwrap(),
            ..settings()
        },
    );
    tracker
        .step(&measurement(0, 33.0, 0.5), false)
        .expect("an estimate");
    tracker.workspace.target = now(&tracker);
    let step = tracker.run().predict(200_000).expect("a step");
    // The same network, the same random numbers.
    let mut twin = Bench::new(
        blob,
        Settings {
            inference: Inference::of_passes(16).unwrap(),
            ..settings()
        },
    );
    let (answer, variance) = twin.infer(&mut [0.0; FEATURES]);
    let plain = Schedule::read(&answer, &parameters().base);
    for axis in 0..3 {
        let expected = plain.noise.jerk[axis] + 0.2 * variance[axis];
        assert!(variance[axis] > 1.0);
        let got = step.interval.noise.jerk[axis];
        assert!(near(got, expected, expected), "{axis}: {got} {expected}");
    }
}

#[test]
fn an_answer_that_is_not_finite_is_an_error() {
    let mut draft = constant([0.0; OUTPUTS]);
    draft.outputs[0] = [3e38, 3e38];
    draft.networks[0][1].bias_mean[0] = 1.0;
    let bytes = draft.bytes();
    let mut tracker = started(&bytes);
    assert_eq!(tracker.coast(100_000), Err(StepError::NetworkNotFinite));
}

/// The factor, which says where targets are, holds for eight seconds of a forecast and not beyond: later ones are no surer.
#[test]
fn further_forecasts_are_not_surer() {
    let mut sure = outputs();
    // Weights of the factor, as large as they are read.
    for weight in [18, 20, 22, 24, 26] {
        sure[weight] = 8.0;
    }
    let bytes = constant(sure).bytes();
    let mut tracker = started(&bytes);
    let times_us = [7, 8, 9, 12, 16, 17, 20].map(|time_s| 1_000_000 * time_s);
    let mut deviations_m = std::vec::Vec::new();
    tracker
        .run()
        .forecast_each(&times_us, &mut |_, estimate| {
            let variance: f32 = (0..3).map(|i| estimate.covariance_m2[i][i]).sum();
            deviations_m.push(variance.sqrt());
        })
        .expect("forecasts");
    let grows = |pair: &[f32]| pair[1] > 0.99 * pair[0];
    assert!(deviations_m.windows(2).all(grows), "{deviations_m:?}");
}
