//! An imported network with what surrounds it, as a blob.

use super::recipe::Recipe;
use crate::blob::quantise::quantise;
use crate::blob::writer::{BlobContents, write_blob};
use crate::posterior::gaussian_weights::GaussianWeights;
use bnkf::blob::{BlobError, Kind};

/// The blob of `networks`, which answer as `recipe` says.
///
/// # Errors
/// What no blob can hold: passes or a population outside their limits, a deviation beyond f32.
pub fn blob(recipe: &Recipe, networks: &[GaussianWeights]) -> Result<Vec<u8>, BlobError> {
    write_blob(&BlobContents {
        kind: Kind::Memoryless,
        features: recipe.features,
        activation: recipe.activation,
        passes: recipe.passes,
        parameters: vec![recipe.speed_sigma_mps, recipe.acceleration_sigma_mps2],
        inputs: recipe.inputs.clone(),
        outputs: recipe.outputs.clone(),
        networks: networks.iter().map(quantise).collect(),
    })
}
