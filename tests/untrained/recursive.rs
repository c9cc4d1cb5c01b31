//! A recursive blob that needs no training.

use bnkf::blob::{FeatureLayout, Kind};
use bnkf_model_export::architecture::Architecture;
use bnkf_model_export::blob_writer::{BlobContents, Normalisation, write_blob};
use bnkf_model_export::gaussian_weights::GaussianWeights;
use bnkf_model_export::quantise::quantise;
use bnkf_model_export::random_source::RandomSource;
use bnkf_model_export::recursive::features::FEATURES;
use bnkf_model_export::recursive::schedule::{Base, OUTPUTS};
use bnkf_model_export::recursive::start::Population;

/// The population of the paper-sized flights, roughly.
pub const POPULATION: Population = Population {
    range_m: 33.5,
    range_sigma_m: 6.0,
    elevation_rad: 0.5,
    elevation_sigma_rad: 0.21,
    horizontal_sigma_mps: 1.6,
    vertical_sigma_mps: 0.5,
    acceleration_sigma_mps2: 2.0,
};

/// A recursive blob of random weights with one hidden layer: every output moves, none means
/// anything.
pub fn recursive_blob(hidden: usize) -> Vec<u8> {
    let architecture = Architecture::new(vec![FEATURES, hidden, OUTPUTS]).expect("small");
    let mut random = RandomSource::new(11, &[]);
    let p = POPULATION;
    let base = Base::DRONE;
    let parameters = [
        p.range_m,
        p.range_sigma_m,
        p.elevation_rad,
        p.elevation_sigma_rad,
        p.horizontal_sigma_mps,
        p.vertical_sigma_mps,
        p.acceleration_sigma_mps2,
        base.decay_hz,
        base.jerk_noise,
        base.acceleration_noise,
        base.velocity_noise,
    ];
    let contents = BlobContents {
        kind: Kind::Recursive,
        features: FeatureLayout::Recursive64,
        passes: 1,
        parameters: parameters.map(|x| x as f32).to_vec(),
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
