//! A shipped model as tuning needs it: its unrounded weights, and the flights to rehearse.

use super::model::RecursiveModel;
use super::scenario::Scenario;
use crate::blob::unrounded::{self, UnroundedError};
use bnkf::blob::{Blob, BlobError};

/// Why a model cannot be tuned.
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

/// The model of a blob and the file of unrounded weights beside it, and what it was trained for.
///
/// # Errors
/// See [`UntunableError`].
pub fn tunable(
    blob: &[u8],
    unrounded: &[u8],
) -> Result<(RecursiveModel, Scenario), UntunableError> {
    let networks = unrounded::parse(unrounded, blob)?;
    let blob = Blob::parse(blob)?;
    unrounded::check_shape(&networks, &blob)?;
    let model = networks
        .first()
        .and_then(|weights| RecursiveModel::of_blob(&blob, weights))
        .ok_or(UntunableError::OtherKind)?;
    let scenario = Scenario::of(&model.parameters.bounds).ok_or(UntunableError::NoScenario)?;
    Ok((model, scenario))
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
        let (model, scenario) = tunable(&blob, &beside).unwrap();
        assert_eq!(scenario, Scenario::Paper);
        assert_eq!(model.blob().unwrap(), blob);
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
