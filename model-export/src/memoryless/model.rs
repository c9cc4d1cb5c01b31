//! A trained memoryless estimator: what goes into its blob, and the unrounded weights beside it.

use crate::blob::quantise::quantise;
use crate::blob::writer::{BlobContents, Normalisation, write_blob};
use crate::memoryless::normalisation::Normalisations;
use crate::posterior::gaussian_weights::GaussianWeights;
use bnkf::blob::{Activation, BlobError, FeatureLayout, Kind};

/// Monte Carlo passes by default, the paper's.
pub const PASSES: u16 = 100;

/// One network for three axes (BNKF), or one for each (BNKFe).
#[derive(Clone, Debug, PartialEq)]
pub struct MemorylessModel {
    /// Features of the networks.
    pub layout: FeatureLayout,
    /// Affine maps of inputs and outputs.
    pub normalisation: Normalisations,
    /// Standard deviation of a velocity component in the population, m/s.
    pub speed_sigma_mps: f64,
    /// Standard deviation of an acceleration component in the population, m/s^2.
    pub acceleration_sigma_mps2: f64,
    /// The networks' posteriors.
    pub networks: Vec<GaussianWeights>,
}

impl MemorylessModel {
    /// The quantised blob.
    ///
    /// # Errors
    /// A number is not finite.
    pub fn blob(&self) -> Result<Vec<u8>, BlobError> {
        let scale = self.normalisation.output_scale_m;
        write_blob(&BlobContents {
            kind: Kind::Memoryless,
            features: self.layout,
            activation: Activation::Gelu,
            passes: PASSES,
            parameters: vec![
                self.speed_sigma_mps as f32,
                self.acceleration_sigma_mps2 as f32,
            ],
            inputs: self.normalisation.inputs.clone(),
            outputs: self
                .normalisation
                .output_mean_m
                .map(|mean| Normalisation { mean, scale })
                .to_vec(),
            networks: self.networks.iter().map(quantise).collect(),
        })
    }
}
