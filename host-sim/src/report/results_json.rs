//! The results as JSON: the cells of the table and where they came from.
//!
//! Numbers that are not finite (the mean over no steps) are written as `null`.

use std::path::Path;

use bnkf_model_export::atomic_file::{self, AtomicWriteError};
use bnkf_model_export::radar::noise::NoiseTable;
use serde::Serialize;

use crate::contest::model::Model;
use crate::scoring::cell::Cell;
use crate::scoring::forecast::ForecastCell;

/// Everything that a run reports.
#[derive(Clone, Debug, Serialize)]
pub struct Results {
    /// The table.
    pub cells: Vec<Cell>,
    /// Forecasts of every cell.
    pub forecasts: Vec<ForecastCell>,
    /// Where it came from.
    pub provenance: Provenance,
}

/// What made the results: enough to make them again.
#[derive(Clone, Debug, Serialize)]
pub struct Provenance {
    /// The command line.
    pub command: String,
    /// Version of this program.
    pub version: &'static str,
    /// Commit that it was built from.
    pub tree: &'static str,
    /// Seed of placement, noise and Monte Carlo passes.
    pub seed: u64,
    /// Where the flights came from.
    pub data: String,
    /// SHA-256 of the flights, see [`bnkf_model_export::flights::data_hash::of_flights`].
    pub data_sha256: String,
    /// Number of flights.
    pub flights: usize,
    /// Number of evaluated segments.
    pub segments: usize,
    /// Segments that were left out because they do not fit into the volume, and why.
    pub unplaced: Vec<String>,
    /// What was assumed and what is suspicious about the flights.
    pub remarks: Vec<String>,
    /// Length of a segment, seconds; 0: whole flights.
    pub segment_s: f64,
    /// Whether segments were moved into the scenario's volume.
    pub placed: bool,
    /// Position of the radar in the flights' frame, metres.
    pub radar_m: [f64; 3],
    /// How the angle figures of the noise levels were read.
    pub noise_table: NoiseTable,
    /// Monte Carlo passes, if not the models' own number.
    pub passes: Option<u16>,
    /// The models.
    pub models: Vec<ModelProvenance>,
}

/// Which blob was used.
#[derive(Clone, Debug, Serialize)]
pub struct ModelProvenance {
    /// Its path, or `embedded:` and its name.
    pub source: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// Number of its networks: 1 serves BNN and BNKF, 3 serve BNKFe.
    pub networks: usize,
    /// Its own number of Monte Carlo passes.
    pub passes: u16,
}

impl From<&Model> for ModelProvenance {
    fn from(model: &Model) -> Self {
        let blob = model.blob();
        Self {
            source: model.source.clone(),
            sha256: model.sha256(),
            networks: blob.network_count(),
            passes: blob.passes(),
        }
    }
}

/// Writes `results` to `path`, whole or not at all.
///
/// # Errors
/// The file cannot be written.
///
/// # Panics
/// Never: every field has a representation in JSON.
pub fn write(path: &Path, results: &Results) -> Result<(), AtomicWriteError> {
    let mut text = serde_json::to_string_pretty(results).expect("every field has a representation");
    text.push('\n');
    atomic_file::write(path, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};

    use super::{Provenance, Results, write};
    use crate::method::Method;
    use crate::scoring::binned::binned;
    use crate::scoring::cell::{Cell, CellMetrics};

    fn results() -> Results {
        let cell = Cell {
            method: Method::Bnkfe,
            noise: NoiseLevel::Medium,
            rate: SamplingRate::THREE_QUARTERS,
            metrics: CellMetrics::new(&[]),
            bins: binned(std::iter::empty()),
        };
        let provenance = Provenance {
            command: "host-sim".to_owned(),
            version: "0",
            tree: "unknown",
            seed: 1,
            data: "built-in".to_owned(),
            data_sha256: String::new(),
            flights: 0,
            segments: 0,
            unplaced: Vec::new(),
            remarks: Vec::new(),
            segment_s: 15.0,
            placed: true,
            radar_m: [0.0; 3],
            noise_table: NoiseTable::Printed,
            passes: None,
            models: Vec::new(),
        };
        Results {
            cells: vec![cell],
            forecasts: Vec::new(),
            provenance,
        }
    }

    #[test]
    fn a_cell_has_the_documented_keys() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.json");
        write(&path, &results()).unwrap();
        let json: serde_json::Value =
            serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        let cell = json["cells"][0].as_object().unwrap();
        let mut keys: Vec<_> = cell.keys().map(String::as_str).collect();
        keys.sort_unstable();
        let expected = [
            "bins",
            "coverage90",
            "d_mean",
            "det_p_median_m6",
            "diverged",
            "ed_mean_m",
            "ed_median_m",
            "method",
            "nees_mean",
            "nll",
            "noise",
            "not_tracked",
            "outside",
            "rate",
            "rejected",
            "restarted",
            "steps",
        ];
        assert_eq!(keys, expected);
        assert_eq!(cell["method"], "BNKFe");
        assert_eq!(cell["noise"], "medium");
        assert_eq!(cell["rate"], 0.75);
        assert!(cell["ed_mean_m"].is_null());
        assert_eq!(json["provenance"]["noise_table"], "printed");
    }

    #[test]
    fn a_missing_folder_is_named() {
        let error = write(std::path::Path::new("/nowhere/out.json"), &results()).unwrap_err();
        assert!(error.to_string().contains("/nowhere/out.json"));
    }
}
