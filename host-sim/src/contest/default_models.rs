//! The models that are part of the program.

use crate::contest::model::{Model, ModelError};

/// A blob by its name, and the weights that it was rounded from.
type Embedded = (&'static str, &'static [u8], &'static [u8]);

macro_rules! embedded {
    ($name:literal) => {
        (
            $name,
            include_bytes!(concat!("../../../models/", $name)),
            include_bytes!(concat!("../../../models/", $name, ".f32")),
        )
    };
}

const EMBEDDED: [Embedded; 3] = [
    embedded!("bnkf.bnkf"),
    embedded!("bnkfe.bnkf"),
    embedded!("recursive.bnkf"),
];

/// Recursive models for scenarios of their own, by the scenario's name.
const OF_SCENARIOS: [(&str, Embedded); 1] =
    [("counter-uas", embedded!("recursive-counter-uas.bnkf"))];

/// The recursive model that was trained for a scenario; without one the default serves.
///
/// # Errors
/// A built-in blob does not parse, which a test rules out.
pub fn of_scenario(name: &str) -> Result<Option<Model>, ModelError> {
    let found = OF_SCENARIOS.iter().find(|(scenario, _)| *scenario == name);
    found
        .map(|(_, (name, bytes, unrounded))| Model::embedded(name, bytes, unrounded))
        .transpose()
}

/// The built-in recursive model.
///
/// # Errors
/// It does not parse, which a test rules out.
pub fn recursive() -> Result<Model, ModelError> {
    let [.., (name, bytes, unrounded)] = EMBEDDED;
    Model::embedded(name, bytes, unrounded)
}

/// The built-in models.
///
/// # Errors
/// A built-in blob does not parse, which a test rules out.
pub fn load() -> Result<Vec<Model>, ModelError> {
    EMBEDDED
        .into_iter()
        .map(|(name, bytes, unrounded)| Model::embedded(name, bytes, unrounded))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{load, of_scenario, recursive};
    use bnkf::blob::Kind;

    #[test]
    fn every_built_in_model_parses() {
        let models = load().expect("checked blobs");
        let networks: Vec<usize> = models.iter().map(|m| m.blob().network_count()).collect();
        assert_eq!(networks, [1, 3, 1]);
        assert_eq!(models[2].sha256(), recursive().unwrap().sha256());
        assert_eq!(models[2].blob().kind(), Kind::Recursive);
    }

    #[test]
    fn scenarios_have_recursive_models_of_their_own() {
        let own = of_scenario("counter-uas").unwrap().expect("it has one");
        assert_eq!(own.blob().kind(), Kind::Recursive);
        assert!(of_scenario("paper").unwrap().is_none());
        assert_ne!(own.sha256(), load().unwrap()[2].sha256());
    }
}
