//! The models that are part of the program.

use crate::contest::model::{Model, ModelError};

const EMBEDDED: [(&str, &[u8]); 3] = [
    ("bnkf.bnkf", include_bytes!("../../../models/bnkf.bnkf")),
    ("bnkfe.bnkf", include_bytes!("../../../models/bnkfe.bnkf")),
    (
        "recursive.bnkf",
        include_bytes!("../../../models/recursive.bnkf"),
    ),
];

/// Recursive models for scenarios of their own, by the scenario's name.
const OF_SCENARIOS: [(&str, &str, &[u8]); 1] = [(
    "counter-uas",
    "recursive-counter-uas.bnkf",
    include_bytes!("../../../models/recursive-counter-uas.bnkf"),
)];

/// The recursive model that was trained for a scenario; without one the default serves.
///
/// # Errors
/// A built-in blob does not parse, which a test rules out.
pub fn of_scenario(name: &str) -> Result<Option<Model>, ModelError> {
    let found = OF_SCENARIOS
        .iter()
        .find(|(scenario, _, _)| *scenario == name);
    found
        .map(|(_, name, bytes)| Model::embedded(name, bytes))
        .transpose()
}

/// The built-in models.
///
/// # Errors
/// A built-in blob does not parse, which a test rules out.
pub fn load() -> Result<Vec<Model>, ModelError> {
    EMBEDDED
        .into_iter()
        .map(|(name, bytes)| Model::embedded(name, bytes))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{load, of_scenario};
    use bnkf::blob::Kind;

    #[test]
    fn every_built_in_model_parses() {
        let models = load().expect("checked blobs");
        let networks: Vec<usize> = models.iter().map(|m| m.blob().network_count()).collect();
        assert_eq!(networks, [1, 3, 1]);
    }

    #[test]
    fn scenarios_have_recursive_models_of_their_own() {
        let own = of_scenario("counter-uas").unwrap().expect("it has one");
        assert_eq!(own.blob().kind(), Kind::Recursive);
        assert!(of_scenario("paper").unwrap().is_none());
        assert_ne!(own.sha256(), load().unwrap()[2].sha256());
    }
}
