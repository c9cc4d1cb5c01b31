//! A trained recursive estimator and the blob that holds it.

use super::network::Network;
use super::network::sampling::Sampling;
use super::normalisation::Normalisation;
use crate::blob::quantise::{QuantisedLayer, quantise};
use crate::blob::writer::{self as blob_writer, BlobContents, write_blob};
use crate::posterior::gaussian_weights::GaussianWeights;
use bnkf::blob::{Activation, Blob, BlobError, FeatureLayout, Kind};
use bnkf::recursive::features::FEATURES;
use bnkf::recursive::parameters::Parameters;
use bnkf::recursive::schedule::OUTPUTS;

/// Passes by default: one, every weight at its mean.
const PASSES: u16 = 1;

/// What the firmware's recursive tracker runs on.
#[derive(Clone, Debug)]
pub struct RecursiveModel {
    /// What surrounds the network.
    pub parameters: Parameters<f64>,
    /// Of the features.
    pub normalisation: Normalisation,
    /// The network.
    pub network: Network,
    /// Which of its deviations count.
    pub sampling: Sampling,
}

impl RecursiveModel {
    /// The network's posterior, in the order of blobs.
    pub fn weights(&self) -> GaussianWeights {
        let mut weights = self.network.gaussian_weights();
        let layers = weights.architecture.layers();
        for (index, shape) in layers.iter().enumerate() {
            if !self.sampling.covers(index, layers.len()) {
                weights.log_sigmas[shape.start..shape.end()].fill(f32::NEG_INFINITY);
            }
        }
        weights
    }

    /// The model of a blob and of the unrounded weights beside it; `None` when the network has
    /// another shape than training gives.
    pub fn of_blob(blob: &Blob<'_>, weights: &GaussianWeights) -> Option<Self> {
        let (parameters, normalisation) = Self::surroundings(blob)?;
        Some(Self {
            parameters,
            normalisation,
            network: Network::of_gaussian_weights(weights)?,
            sampling: sampling(weights),
        })
    }

    /// What a recursive blob holds beside its network, its parameters and normalisation; `None` for a blob of another kind.
    pub fn surroundings(blob: &Blob<'_>) -> Option<(Parameters<f64>, Normalisation)> {
        if blob.kind() != Kind::Recursive {
            return None;
        }
        let parameters = Parameters::read(blob.parameters());
        let pairs = blob.input_normalisation();
        let pair = |index| f64::from(pairs.get(index));
        let normalisation = Normalisation {
            offset: core::array::from_fn(|i| pair(2 * i)),
            gain: core::array::from_fn(|i| pair(2 * i + 1)),
        };
        Some((parameters, normalisation))
    }

    /// The network's layers as the blob holds them.
    pub fn layers(&self) -> Vec<QuantisedLayer> {
        quantise(&self.weights())
    }

    /// The blob's bytes.
    ///
    /// # Errors
    /// A number is not finite, which a training run that diverged may leave.
    pub fn blob(&self) -> Result<Vec<u8>, BlobError> {
        let input = |i: usize| blob_writer::Normalisation {
            mean: self.normalisation.offset[i] as f32,
            scale: (1.0 / self.normalisation.gain[i]) as f32,
        };
        let unchanged = blob_writer::Normalisation {
            mean: 0.0,
            scale: 1.0,
        };
        write_blob(&BlobContents {
            kind: Kind::Recursive,
            features: FeatureLayout::Recursive64,
            activation: Activation::Gelu,
            passes: PASSES,
            parameters: self.parameters.list().to_vec(),
            inputs: (0..FEATURES).map(input).collect(),
            outputs: vec![unchanged; OUTPUTS],
            networks: vec![self.layers()],
        })
    }
}

/// What was sampled when `weights` were trained.
fn sampling(weights: &GaussianWeights) -> Sampling {
    let finite = |sigma: &f32| sigma.is_finite();
    match (weights.log_sigmas.first(), weights.log_sigmas.last()) {
        (Some(first), Some(_)) if finite(first) => Sampling::EveryLayer,
        (_, Some(last)) if finite(last) => Sampling::LastLayer,
        _ => Sampling::Nothing,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Tier;
    use crate::recursive::network::pass::Pass;
    use crate::recursive::network::shape::OUTPUT_COLUMNS;

    fn model(sampling: Sampling) -> RecursiveModel {
        RecursiveModel {
            parameters: Parameters::PAPER,
            normalisation: Normalisation::IDENTITY,
            network: Network::new(5),
            sampling,
        }
    }

    #[test]
    fn the_integer_network_answers_what_the_trained_one_does() {
        let model = model(Sampling::EveryLayer);
        let bytes = model.blob().unwrap();
        let blob = Blob::parse(&bytes).unwrap();
        let view = blob.networks().next().unwrap();
        let mut inputs = [0.0_f32; FEATURES];
        for (i, input) in inputs.iter_mut().enumerate() {
            *input = (0.7 * i as f32).sin();
        }
        let mut answer = [0.0; OUTPUTS];
        bnkf::network::Network::new(view).mean_pass(&inputs, &mut answer);
        let mut pass = Pass::new(8);
        pass.features_mut()[..FEATURES].copy_from_slice(&inputs);
        let tier = Tier::detect();
        pass.forward(tier, &model.network.weights(tier, Sampling::Nothing), 0);
        let expected = &pass.outputs()[..OUTPUT_COLUMNS];
        let largest = expected.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
        for (a, b) in answer.iter().zip(expected) {
            // Eight bits a weight over five layers.
            assert!((a - b).abs() < 0.03 * largest, "{a} {b}");
        }
        assert!(bytes.len() <= 48 * 1024, "{} bytes", bytes.len());
    }

    #[test]
    fn a_deterministic_twin_has_no_variance() {
        let bytes = model(Sampling::Nothing).blob().unwrap();
        let view = Blob::parse(&bytes).unwrap().networks().next().unwrap();
        assert_eq!(view.layer(2).variance_max, 0.0);
        let bytes = model(Sampling::EveryLayer).blob().unwrap();
        let view = Blob::parse(&bytes).unwrap().networks().next().unwrap();
        assert!(view.layer(2).variance_max > 0.0);
        let bytes = model(Sampling::LastLayer).blob().unwrap();
        let view = Blob::parse(&bytes).unwrap().networks().next().unwrap();
        assert_eq!(view.layer(3).variance_max, 0.0);
        assert!(view.layer(4).variance_max > 0.0);
    }

    #[test]
    fn a_model_comes_back_from_its_blob_and_weights() {
        for sampling in [Sampling::EveryLayer, Sampling::LastLayer, Sampling::Nothing] {
            let model = model(sampling);
            let bytes = model.blob().unwrap();
            let back =
                RecursiveModel::of_blob(&Blob::parse(&bytes).unwrap(), &model.weights()).unwrap();
            assert_eq!(back.blob().unwrap(), bytes);
            assert_eq!(back.sampling, sampling);
        }
    }
}
