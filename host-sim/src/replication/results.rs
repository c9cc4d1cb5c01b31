//! The replication's numbers as files.

use serde::{Deserialize, Serialize};

use super::entry::{Entry, Section};
use super::summary::Summary;
use crate::csv_text::csv;
use bnkf_model_export::radar::noise::NoiseLevel;

/// What made the numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// The command line.
    pub command: String,
    /// Version of this program.
    pub version: String,
    /// Commit that it was built from.
    pub tree: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Where the flights came from.
    pub data: String,
    /// SHA-256 of the flights.
    pub data_sha256: String,
    /// Number of flights (segments).
    pub flights: usize,
    /// Number of recordings they were cut from.
    pub recordings: usize,
    /// Segments that do not fit into the volume.
    pub unplaced: usize,
    /// Folds; the first is tested and the others train.
    pub folds: usize,
    /// Training epochs of every network.
    pub epochs: u32,
    /// Monte Carlo passes.
    pub passes: usize,
    /// Fewer flights and epochs than the default: rough figures.
    pub quick: bool,
}

/// One line of a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Its table.
    pub section: Section,
    /// Its name there.
    pub label: String,
    /// Low, medium and high noise, the three sampling rates together.
    pub cells: [Summary; 3],
}

/// All of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// What made the numbers.
    pub provenance: Provenance,
    /// The lines in the order of the tables.
    pub lines: Vec<Line>,
}

impl Results {
    /// Puts the cells beside the entries that they belong to.
    pub fn new(provenance: Provenance, entries: &[Entry], cells: Vec<[Summary; 3]>) -> Self {
        let line = |(entry, cells): (&Entry, [Summary; 3])| Line {
            section: entry.section,
            label: entry.label.clone(),
            cells,
        };
        Self {
            provenance,
            lines: entries.iter().zip(cells).map(line).collect(),
        }
    }

    /// The JSON document.
    ///
    /// # Panics
    /// Never: every value has a representation.
    pub fn json(&self) -> Vec<u8> {
        let mut json = serde_json::to_vec_pretty(self).expect("every value has a representation");
        json.push(b'\n');
        json
    }

    /// One row for each cell.
    pub fn csv(&self) -> Vec<u8> {
        let header = [
            "section",
            "method",
            "noise",
            "scored",
            "dropped",
            "unusable",
            "ed_m",
            "d",
            "d_squared",
            "det_p_mean_m6",
            "det_p_median_m6",
        ];
        let rows = self.lines.iter().flat_map(|line| {
            let cells = NoiseLevel::ALL.iter().zip(&line.cells);
            cells.map(|(level, cell)| {
                vec![
                    line.section.name().to_owned(),
                    line.label.clone(),
                    level.to_string(),
                    cell.scored.to_string(),
                    cell.dropped.to_string(),
                    cell.unusable.to_string(),
                    cell.error_m.to_string(),
                    cell.distance.to_string(),
                    cell.distance_squared.to_string(),
                    cell.det_p_mean_m6.to_string(),
                    cell.det_p_median_m6.to_string(),
                ]
            })
        });
        csv(&header, rows)
    }
}
