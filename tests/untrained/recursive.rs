//! A recursive blob that needs no training.

use bnkf::blob::{Activation, FeatureLayout, Kind};
use bnkf::recursive::features::FEATURES;
use bnkf::recursive::parameters::Parameters;
use bnkf::recursive::schedule::OUTPUTS;
use bnkf_model_export::blob::quantise::quantise;
use bnkf_model_export::blob::writer::{BlobContents, Normalisation, write_blob};
use bnkf_model_export::posterior::architecture::Architecture;
use bnkf_model_export::posterior::gaussian_weights::GaussianWeights;
use bnkf_model_export::random_source::RandomSource;

/// A recursive blob of random weights with one hidden layer: every output moves, none means
/// anything.
pub fn recursive_blob(hidden: usize) -> Vec<u8> {
    let architecture = Architecture::new(vec![FEATURES, hidden, OUTPUTS]).expect("small");
    let mut random = RandomSource::new(11, &[]);
    // Of the latest version of the format.
    let parameters = Parameters {
        bend: 0.5,
        ..Parameters::PAPER
    };
    let contents = BlobContents {
        kind: Kind::Recursive,
        features: FeatureLayout::Recursive64,
        activation: Activation::Gelu,
        passes: 1,
        parameters: parameters.list().to_vec(),
        inputs: vec![
            Normalisation {
                mean: 0.0,
                scale: 4.0
            };
            FEATURES
        ],
        outputs: vec![
            Normalisation {
                mean: 0.0,
                scale: 1.0
            };
            OUTPUTS
        ],
        networks: vec![quantise(&GaussianWeights::random(
            &architecture,
            0.01,
            &mut random,
        ))],
    };
    write_blob(&contents).expect("valid blob")
}
