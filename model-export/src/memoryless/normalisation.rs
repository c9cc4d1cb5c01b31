//! The affine maps between physical units and what the network computes with.

use crate::blob::writer::Normalisation;
use crate::memoryless::example::Example;
use bnkf::blob::Blob;

/// The maps of a memoryless network's inputs and of the three axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Normalisations {
    /// Mean and standard deviation per feature, in the feature's unit.
    pub inputs: Vec<Normalisation>,
    /// Mean position, metres.
    pub output_mean_m: [f32; 3],
    /// One scale for the three axes, metres: the root mean square distance from the mean, per axis.
    pub output_scale_m: f32,
}

impl Normalisations {
    /// Moments of `examples`, of which the first `inputs` features count. A feature that does not
    /// vary keeps the scale 1.
    #[must_use]
    pub fn of(examples: &[Example], inputs: usize) -> Self {
        let count = examples.len().max(1) as f64;
        let moments = |value: &dyn Fn(&Example) -> f64| {
            let mean = examples.iter().map(value).sum::<f64>() / count;
            let variance = examples
                .iter()
                .map(|e| (value(e) - mean).powi(2))
                .sum::<f64>()
                / count;
            (mean, variance)
        };
        let input = |i: usize| {
            let (mean, variance) = moments(&|e| f64::from(e.features[i]));
            let sigma = variance.sqrt();
            let varies = sigma > 1e-6 * mean.abs().max(1e-3);
            Normalisation {
                mean: mean as f32,
                scale: if varies { sigma as f32 } else { 1.0 },
            }
        };
        let axes = [0, 1, 2].map(|axis| moments(&|e| e.position_m[axis]));
        let scale = (axes.iter().map(|(_, variance)| variance).sum::<f64>() / 3.0).sqrt();
        Self {
            inputs: (0..inputs).map(input).collect(),
            output_mean_m: axes.map(|(mean, _)| mean as f32),
            output_scale_m: if scale > 0.0 { scale as f32 } else { 1.0 },
        }
    }

    /// The maps that a blob of a memoryless estimator holds.
    #[must_use]
    pub fn of_blob(blob: &Blob<'_>) -> Self {
        let (inputs, outputs) = (blob.input_normalisation(), blob.output_normalisation());
        let input = |i: usize| Normalisation {
            mean: inputs.get(2 * i),
            scale: 1.0 / inputs.get(2 * i + 1),
        };
        Self {
            inputs: (0..blob.features().len()).map(input).collect(),
            output_mean_m: [0, 1, 2].map(|axis| outputs.get(2 * axis)),
            output_scale_m: outputs.get(1),
        }
    }

    /// Appends the normalised features to `to`.
    pub fn push_features(&self, features: &[f32], to: &mut Vec<f32>) {
        let pairs = features.iter().zip(&self.inputs);
        // The same roundings as the writer of the blob and the firmware after it.
        to.extend(pairs.map(|(x, input)| (x - input.mean) * (1.0 / input.scale)));
    }

    /// A position, metres, in the network's output units.
    #[must_use]
    pub fn target(&self, position_m: [f64; 3]) -> [f32; 3] {
        std::array::from_fn(|axis| {
            let centred = position_m[axis] - f64::from(self.output_mean_m[axis]);
            (centred / f64::from(self.output_scale_m)) as f32
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{Normalisation, Normalisations};
    use crate::memoryless::example::Example;
    use bnkf::memoryless::FEATURES_MAX;

    #[test]
    fn normalised_values_have_zero_mean_and_unit_variance() {
        let example = |i: i32| {
            let mut features = [2.5; FEATURES_MAX];
            features[0] = i as f32;
            features[1] = -3.0 * i as f32 + 1.0;
            let position_m = [f64::from(i), 0.0, 2.0 * f64::from(i) + 7.0];
            Example {
                features,
                position_m,
                attainable_variance_m2: 1.0,
            }
        };
        let examples: Vec<Example> = (-3..=3).map(example).collect();
        let normalisation = Normalisations::of(&examples, 3);
        assert_eq!(
            normalisation.inputs[0],
            Normalisation {
                mean: 0.0,
                scale: 2.0
            }
        );
        assert_eq!(normalisation.inputs[1].mean, 1.0);
        assert_eq!(
            normalisation.inputs[2],
            Normalisation {
                mean: 2.5,
                scale: 1.0
            }
        );
        assert_eq!(normalisation.output_mean_m, [0.0, 0.0, 7.0]);
        let scale = ((4.0 + 0.0 + 16.0) / 3.0_f32).sqrt();
        assert!((normalisation.output_scale_m - scale).abs() < 1e-6);
        let mut features = Vec::new();
        normalisation.push_features(&examples[6].features, &mut features);
        assert_eq!(features, [1.5, -1.5, 0.0]);
        let target = normalisation.target([3.0, 0.0, 13.0]);
        assert!((target[0] - 3.0 / scale).abs() < 1e-6 && (target[2] - 6.0 / scale).abs() < 1e-6);
    }
}
