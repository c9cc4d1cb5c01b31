//! The models that are part of the program.

use crate::model::{Model, ModelError};

const EMBEDDED: [(&str, &[u8]); 3] = [
    ("bnkf.bnkf", include_bytes!("../../models/bnkf.bnkf")),
    ("bnkfe.bnkf", include_bytes!("../../models/bnkfe.bnkf")),
    (
        "recursive.bnkf",
        include_bytes!("../../models/recursive.bnkf"),
    ),
];

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
    use super::load;

    #[test]
    fn every_built_in_model_parses() {
        let models = load().expect("checked blobs");
        let networks: Vec<usize> = models.iter().map(|m| m.blob().network_count()).collect();
        assert_eq!(networks, [1, 3, 1]);
    }
}
