//! What made a model: enough to make it again, and what the rounding cost. Written beside it.

use crate::blob::quantise::LayerError;
use crate::memoryless::training_settings::TrainingSettings;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The provenance of a memoryless model.
#[derive(Clone, Debug, Serialize)]
pub struct Provenance {
    /// The command line.
    pub command: String,
    /// Version of this program.
    pub version: &'static str,
    /// Where the flights came from.
    pub data: String,
    /// SHA-256 of the flights as they were trained on, see [`crate::flights::data_hash::of_flights`].
    pub data_sha256: String,
    /// Flights that were learned from.
    pub training_flights: usize,
    /// Flights that only stopped the training.
    pub held_out_flights: usize,
    /// Seeds and settings of the training.
    pub settings: TrainingSettings,
    /// Epochs that were run.
    pub epochs: u32,
    /// Per network: epoch and held-out loss of the exported weights.
    pub best: Vec<(u32, f64)>,
    /// The same of the best weights before their means were put on the int8 grid.
    pub best_unrounded: Vec<(u32, f64)>,
    /// SHA-256 of the blob.
    pub blob_sha256: String,
    /// Length of the blob, bytes.
    pub blob_bytes: usize,
    /// What rounding did, per network and layer.
    pub quantisation: Vec<Vec<LayerError>>,
}

/// Where the provenance of the blob at `blob` lies: `m.bnkf` has `m.bnkf.json`.
#[must_use]
pub fn path_beside(blob: &Path) -> PathBuf {
    let mut path = blob.as_os_str().to_owned();
    path.push(".json");
    path.into()
}
