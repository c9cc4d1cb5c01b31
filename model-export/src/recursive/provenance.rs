//! What made a recursive model, and what the rounding cost. Written beside it.

use super::comparison::Comparison;
use super::recipe::Recipe;
use super::scenario::Scenario;
use crate::blob::quantise::LayerError;
use serde::Serialize;

/// The provenance of a recursive model; the file is named by
/// [`crate::memoryless::provenance::path_beside`].
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
    /// What it was trained for.
    pub scenario: Scenario,
    /// Seeds and settings of the training.
    pub recipe: Recipe,
    /// SHA-256 of the blob.
    pub blob_sha256: String,
    /// Length of the blob, bytes.
    pub blob_bytes: usize,
    /// What rounding did, per layer.
    pub quantisation: Vec<LayerError>,
    /// Built-in flights that no training sees, by the unrounded network and by the blob.
    pub held_out: Vec<Comparison>,
}
