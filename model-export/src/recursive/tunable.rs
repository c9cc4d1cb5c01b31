//! A shipped model that training goes on from, on new batches or on a user's flights: with its unrounded weights.

use super::model::RecursiveModel;
use super::scenario::Scenario;
use crate::blob::unrounded::{self, UnroundedError};
use crate::flights::data_hash::of_bytes;
use bnkf::blob::{Blob, BlobError};

/// Why training cannot go on from a model.
#[derive(Debug, thiserror::Error)]
pub enum UntunableError {
    /// No blob.
    #[error(transparent)]
    Blob(#[from] BlobError),
    /// The weights beside it are not its own.
    #[error("its unrounded weights: {0}")]
    Unrounded(#[from] UnroundedError),
    /// Another kind or another shape.
    #[error("only a recursive model as this version trains it can be trained further")]
    OtherKind,
    /// Bounds of its own.
    #[error("its bounds are those of no scenario, so there are no built-in flights to rehearse")]
    NoScenario,
}

/// A shipped model that training goes on from.
#[derive(Debug)]
pub struct Tunable {
    /// SHA-256 of its blob.
    pub blob_sha256: String,
    /// With unrounded weights.
    pub model: RecursiveModel,
    /// What it was trained for.
    pub scenario: Scenario,
}

/// The model of a blob and the file of unrounded weights beside it.
///
/// # Errors
/// See [`UntunableError`].
pub fn tunable(bytes: &[u8], unrounded: &[u8]) -> Result<Tunable, UntunableError> {
    let networks = unrounded::parse(unrounded, bytes)?;
    let blob = Blob::parse(bytes)?;
    unrounded::check_shape(&networks, &blob)?;
    let model = networks
        .first()
        .and_then(|weights| RecursiveModel::of_blob(&blob, weights))
        .ok_or(UntunableError::OtherKind)?;
    let scenario = Scenario::of(&model.parameters.bounds).ok_or(UntunableError::NoScenario)?;
    Ok(Tunable {
        blob_sha256: of_bytes(bytes),
        model,
        scenario,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recursive::network::Network;
    use crate::recursive::network::sampling::Sampling;
    use crate::recursive::normalisation::Normalisation;
    use bnkf::recursive::parameters::Parameters;

    fn files(change: fn(&mut Parameters<f64>)) -> (Vec<u8>, Vec<u8>) {
        let mut model = RecursiveModel {
            parameters: Parameters::PAPER,
            normalisation: Normalisation::IDENTITY,
            network: Network::new(3),
            sampling: Sampling::EveryLayer,
        };
        change(&mut model.parameters);
        let blob = model.blob().unwrap();
        let beside = unrounded::to_bytes(&blob, core::slice::from_ref(&model.weights()));
        (blob, beside)
    }

    #[test]
    fn a_model_is_tunable_with_its_own_weights_alone() {
        let (blob, beside) = files(|_| ());
        let found = tunable(&blob, &beside).unwrap();
        assert_eq!(found.scenario, Scenario::Paper);
        assert_eq!(found.model.blob().unwrap(), blob);
        assert_eq!(found.blob_sha256, of_bytes(&blob));
        let (other, others) = files(|p| p.bounds.speed_max_mps = 17.0);
        assert!(matches!(
            tunable(&blob, &others),
            Err(UntunableError::Unrounded(_))
        ));
        assert!(matches!(
            tunable(&other, &others),
            Err(UntunableError::NoScenario)
        ));
    }
}
