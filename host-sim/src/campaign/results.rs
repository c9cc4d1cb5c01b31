//! The results of a campaign as files: JSON, Parquet and CSV.

use std::path::Path;

use bnkf_model_export::atomic_file::{self, AtomicWriteError};
use bnkf_model_export::noise::NoiseTable;
use serde::Serialize;

use super::cell_summary::CellSummary;
use super::comparison::Comparison;
use super::generalisation::VariedCell;
use super::outcome::{Cluster, Floor, Outcome};
use crate::bootstrap::RESAMPLES;
use crate::consistency::NOMINAL;
use crate::method::Method;
use crate::results_json::ModelProvenance;

/// What made the results.
#[derive(Clone, Debug, Serialize)]
pub struct CampaignProvenance {
    /// The command line.
    pub command: String,
    /// Version of this program.
    pub version: &'static str,
    /// Commit that it was built from.
    pub tree: &'static str,
    /// Seed of everything random.
    pub seed: u64,
    /// Name of the scenario.
    pub scenario: String,
    /// SHA-256 of the scenario's text.
    pub scenario_sha256: String,
    /// Where the flights came from.
    pub data: String,
    /// SHA-256 of the flights.
    pub data_sha256: String,
    /// Number of flights (segments).
    pub flights: usize,
    /// Number of recordings they were cut from.
    pub recordings: usize,
    /// Segments that do not fit into the volume, and why.
    pub unplaced: Vec<String>,
    /// Number of folds.
    pub folds: usize,
    /// A quick run: fewer flights, epochs and noise tables.
    pub quick: bool,
    /// Training epochs of every network.
    pub epochs: u32,
    /// Monte Carlo passes, if not the models' own number.
    pub passes: Option<u16>,
    /// Models that no fold trained.
    pub shipped: Vec<ModelProvenance>,
    /// The methods.
    pub methods: Vec<Method>,
    /// The noise tables.
    pub noise_tables: Vec<NoiseTable>,
}

/// The JSON document. Numbers that are not finite are `null`.
#[derive(Serialize)]
struct Document<'a> {
    cells: &'a [CellSummary],
    comparisons: &'a [Comparison],
    variations: &'a [VariedCell],
    /// Posterior Cramer-Rao bound of the fitted motion model.
    floors: &'a [Floor],
    /// Nominal probabilities of the cells' `reliability`.
    reliability_nominal: [f64; NOMINAL.len()],
    bootstrap: Bootstrap,
    provenance: &'a CampaignProvenance,
}

#[derive(Serialize)]
struct Bootstrap {
    cluster: Cluster,
    resamples: usize,
}

/// Writes `results.json`, `steps.parquet` and the tables into `folder`; returns their names.
///
/// # Errors
/// A file cannot be written; it is then absent or what it was before.
///
/// # Panics
/// Never: every value has a representation.
pub fn write(
    folder: &Path,
    outcome: &Outcome,
    provenance: &CampaignProvenance,
) -> Result<Vec<&'static str>, AtomicWriteError> {
    let document = Document {
        cells: &outcome.cells,
        comparisons: &outcome.comparisons,
        variations: &outcome.variations,
        floors: &outcome.floors,
        reliability_nominal: NOMINAL,
        bootstrap: Bootstrap {
            cluster: outcome.cluster,
            resamples: RESAMPLES,
        },
        provenance,
    };
    let mut json = serde_json::to_vec_pretty(&document).expect("every value has a representation");
    json.push(b'\n');
    let files = [
        ("results.json", json),
        ("steps.parquet", outcome.parquet.clone()),
        ("cells.csv", cells_csv(&outcome.cells)),
        ("phases.csv", phases_csv(&outcome.cells)),
        ("reliability.csv", reliability_csv(&outcome.cells)),
        ("comparisons.csv", comparisons_csv(&outcome.comparisons)),
        ("variations.csv", variations_csv(&outcome.variations)),
        ("bounds.csv", bounds_csv(&outcome.floors)),
    ];
    let mut names = Vec::new();
    for (name, bytes) in files {
        atomic_file::write(&folder.join(name), &bytes)?;
        names.push(name);
    }
    Ok(names)
}

fn cells_csv(cells: &[CellSummary]) -> Vec<u8> {
    let header = "noise_table,noise,rate,method,steps,ed_mean_m,ed_low_m,ed_high_m,ed_median_m,d_mean,nees_mean,\
                  nees_low,nees_high,coverage50,coverage90,coverage95,det_p_median_m6,nis_ratio,nees_inside_95,\
                  nis_inside_95,diverged";
    let row = |cell: &CellSummary| {
        let m = &cell.metrics;
        [
            place(cell),
            m.steps.to_string(),
            number(m.ed_mean_m),
            number(cell.ed_interval_m.low),
            number(cell.ed_interval_m.high),
            number(m.ed_median_m),
            number(m.d_mean),
            number(m.nees_mean),
            number(cell.nees_interval.low),
            number(cell.nees_interval.high),
            number(cell.coverage50),
            number(m.coverage90),
            number(cell.coverage95),
            number(m.det_p_median_m6),
            number(cell.nis_ratio),
            number(cell.nees_bounds.inside),
            number(cell.nis_bounds.inside),
            m.diverged.to_string(),
        ]
        .join(",")
    };
    csv(header, cells.iter().map(row))
}

fn phases_csv(cells: &[CellSummary]) -> Vec<u8> {
    let header = "noise_table,noise,rate,method,phase,steps,ed_mean_m,nees_mean,coverage90";
    let rows = cells.iter().flat_map(|cell| {
        cell.phases.iter().map(|phase| {
            let m = &phase.metrics;
            let name = format!("{:?}", phase.phase).to_lowercase();
            let numbers = [m.ed_mean_m, m.nees_mean, m.coverage90]
                .map(number)
                .join(",");
            format!("{},{name},{},{numbers}", place(cell), m.steps)
        })
    });
    csv(header, rows)
}

fn reliability_csv(cells: &[CellSummary]) -> Vec<u8> {
    let header = "noise_table,noise,rate,method,nominal,observed";
    let rows = cells.iter().flat_map(|cell| {
        let pairs = NOMINAL.into_iter().zip(cell.reliability);
        pairs.map(|(nominal, observed)| format!("{},{nominal},{}", place(cell), number(observed)))
    });
    csv(header, rows)
}

fn comparisons_csv(comparisons: &[Comparison]) -> Vec<u8> {
    let header = "noise_table,noise,rate,a,b,ed_difference_m,low_m,high_m,a_wins,flights";
    let row = |comparison: &Comparison| {
        let Comparison {
            a,
            b,
            condition,
            ed_m,
        } = comparison;
        let numbers = [ed_m.difference, ed_m.interval.low, ed_m.interval.high]
            .map(number)
            .join(",");
        format!(
            "{},{},{},{a},{b},{numbers},{},{}",
            condition.table, condition.noise, condition.rate, ed_m.wins, ed_m.flights
        )
    };
    csv(header, comparisons.iter().map(row))
}

fn variations_csv(cells: &[VariedCell]) -> Vec<u8> {
    let header =
        "variation,noise_table,noise,rate,method,steps,ed_mean_m,nees_mean,coverage90,diverged";
    let row = |cell: &VariedCell| {
        let (c, m) = (&cell.condition, &cell.metrics);
        let numbers = [m.ed_mean_m, m.nees_mean, m.coverage90]
            .map(number)
            .join(",");
        format!(
            "{},{},{},{},{},{},{numbers},{}",
            cell.variation, c.table, c.noise, c.rate, cell.method, m.steps, m.diverged
        )
    };
    csv(header, cells.iter().map(row))
}

fn bounds_csv(floors: &[Floor]) -> Vec<u8> {
    let row = |floor: &Floor| {
        let c = &floor.condition;
        format!("{},{},{},{}", c.table, c.noise, c.rate, number(floor.ed_m))
    };
    csv("noise_table,noise,rate,ed_m", floors.iter().map(row))
}

fn place(cell: &CellSummary) -> String {
    let c = &cell.condition;
    format!("{},{},{},{}", c.table, c.noise, c.rate, cell.method)
}

/// The shortest text that reads back as the same number; empty for none.
fn number(value: f64) -> String {
    if value.is_finite() {
        value.to_string()
    } else {
        String::new()
    }
}

fn csv(header: &str, rows: impl Iterator<Item = String>) -> Vec<u8> {
    let mut text = header.to_owned();
    for row in rows {
        text.push('\n');
        text.push_str(&row);
    }
    text.push('\n');
    text.into_bytes()
}
