//! The results of a campaign as files: JSON and CSV.

use std::path::Path;

use bnkf_model_export::atomic_file::{self, AtomicWriteError};
use bnkf_model_export::radar::noise::NoiseTable;
use serde::Serialize;

use crate::campaign::cell_summary::CellSummary;
use crate::campaign::comparison::Comparison;
use crate::campaign::forecast_summary::{ForecastComparison, ForecastSummary};
use crate::campaign::generalisation::VariedCell;
use crate::campaign::outcome::{Cluster, Floor, Outcome};
use crate::campaign::tuning_choice::Candidate;
use crate::contest::tuned_on::TunedOn;
use crate::csv_text::{csv, number};
use crate::method::Method;
use crate::report::by_motion;
use crate::report::results_json::ModelProvenance;
use crate::scenario::radar::Condition;
use crate::scoring::binned::{Pooled, over_rates};
use crate::scoring::bootstrap::RESAMPLES;
use crate::scoring::cell::{Cell, CellMetrics};
use crate::scoring::consistency::NOMINAL;
use crate::scoring::paired::PairedDifference;

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
    /// How often each of them is measured, and placed if flights are.
    pub runs: usize,
    /// Number of recordings they were cut from.
    pub recordings: usize,
    /// Segments that do not fit into the volume, and why.
    pub unplaced: Vec<String>,
    /// What was assumed and what is suspicious about the flights.
    pub remarks: Vec<String>,
    /// Number of folds.
    pub folds: usize,
    /// A quick run: fewer flights, epochs and noise tables.
    pub quick: bool,
    /// Generated flights that filters are tuned on.
    pub tuning_flights: usize,
    /// SHA-256 of these.
    pub tuning_sha256: String,
    /// What filters are tuned on; each cell shows the best of these.
    pub tuned_on: Vec<TunedOn>,
    /// Training epochs of every network.
    pub epochs: u32,
    /// Monte Carlo passes, if not the models' own number.
    pub passes: Option<u16>,
    /// Models that no fold trained.
    pub shipped: Vec<ModelProvenance>,
    /// The methods.
    pub methods: Vec<Method>,
    /// Where the answers of methods come from that answered before: name and SHA-256 of a file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub recorded: Vec<(Method, String)>,
    /// The noise tables.
    pub noise_tables: Vec<NoiseTable>,
}

/// Names of the files, in the order in which they are written.
pub const NAMES: [&str; 11] = [
    "results.json",
    "cells.csv",
    "phases.csv",
    "bins.csv",
    "reliability.csv",
    "comparisons.csv",
    "forecasts.csv",
    "forecast_comparisons.csv",
    "tunings.csv",
    "variations.csv",
    "bounds.csv",
];

/// The JSON document. Numbers that are not finite are `null`.
#[derive(Serialize)]
struct Document<'a> {
    cells: &'a [CellSummary],
    /// Bins of true speed and acceleration, the sampling rates of a noise level together.
    pooled_bins: Vec<PooledBins>,
    comparisons: &'a [Comparison],
    forecasts: &'a [ForecastSummary],
    forecast_comparisons: &'a [ForecastComparison],
    /// Tuned methods with every set of parameters.
    tunings: &'a [Candidate],
    variations: &'a [VariedCell],
    /// Posterior Cramer-Rao bound of the fitted motion model.
    floors: &'a [Floor],
    /// Nominal probabilities of the cells' `reliability`.
    reliability_nominal: [f64; NOMINAL.len()],
    bootstrap: Bootstrap,
    provenance: &'a CampaignProvenance,
}

#[derive(Serialize)]
struct PooledBins {
    table: NoiseTable,
    #[serde(flatten)]
    pooled: Pooled,
}

#[derive(Serialize)]
struct Bootstrap {
    cluster: Cluster,
    resamples: usize,
}

/// Writes `results.json` and the tables into `folder`; returns their names.
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
) -> Result<[&'static str; NAMES.len()], AtomicWriteError> {
    let tables = provenance.noise_tables.iter();
    let tables: Vec<(NoiseTable, Vec<Cell>)> = tables
        .map(|table| (*table, outcome.plain_cells(*table)))
        .collect();
    let pooled = |(table, cells): &(NoiseTable, Vec<Cell>)| {
        let table = *table;
        let pooled = over_rates(cells).into_iter();
        pooled.map(move |pooled| PooledBins { table, pooled })
    };
    let document = Document {
        cells: &outcome.cells,
        pooled_bins: tables.iter().flat_map(pooled).collect(),
        comparisons: &outcome.comparisons,
        forecasts: &outcome.forecasts,
        forecast_comparisons: &outcome.forecast_comparisons,
        tunings: &outcome.candidates,
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
    let files: [Vec<u8>; NAMES.len()] = [
        json,
        cells_csv(&outcome.cells),
        phases_csv(&outcome.cells),
        by_motion::file(tables.iter().map(|(table, cells)| (*table, &cells[..]))),
        reliability_csv(&outcome.cells),
        comparisons_csv(&outcome.comparisons),
        forecasts_csv(&outcome.forecasts),
        forecast_comparisons_csv(&outcome.forecast_comparisons),
        tunings_csv(&outcome.candidates),
        variations_csv(&outcome.variations),
        bounds_csv(&outcome.floors),
    ];
    for (name, bytes) in NAMES.iter().zip(&files) {
        atomic_file::write(&folder.join(name), bytes)?;
    }
    Ok(NAMES)
}

/// Headers of what [`place`] gives.
const PLACE: [&str; 4] = ["noise_table", "noise", "rate", "method"];

fn cells_csv(cells: &[CellSummary]) -> Vec<u8> {
    let own = [
        "steps",
        "ed_mean_m",
        "ed_low_m",
        "ed_high_m",
        "ed_median_m",
        "d_mean",
        "nees_mean",
        "nees_low",
        "nees_high",
        "coverage50",
        "coverage90",
        "coverage95",
        "nll",
        "det_p_median_m6",
        "nis_ratio",
        "nees_inside_95",
        "nis_inside_95",
        "diverged",
        "rejected",
        "restarted",
        "not_tracked",
        "outside",
        "flights_not_tracked",
        "tuned_on",
    ];
    let row = |cell: &CellSummary| {
        let m = &cell.metrics;
        let numbers = [
            m.ed_mean_m,
            cell.ed_interval_m.low,
            cell.ed_interval_m.high,
            m.ed_median_m,
            m.d_mean,
            m.nees_mean,
            cell.nees_interval.low,
            cell.nees_interval.high,
            cell.coverage50,
            m.coverage90,
            cell.coverage95,
            m.nll,
            m.det_p_median_m6,
            cell.nis_ratio,
            cell.nees_bounds.inside,
            cell.nis_bounds.inside,
        ];
        let mut row = place(&cell.condition, cell.method);
        row.push(m.steps.to_string());
        row.extend(numbers.map(number));
        row.extend(counts(m));
        row.push(cell.flights_not_tracked.to_string());
        row.push(cell.tuned_on.map_or("", TunedOn::label).to_owned());
        row
    };
    csv(&[&PLACE[..], &own].concat(), cells.iter().map(row))
}

fn tunings_csv(candidates: &[Candidate]) -> Vec<u8> {
    let own = [
        "tuned_on",
        "chosen",
        "steps",
        "ed_mean_m",
        "nees_mean",
        "coverage90",
        "nll",
    ];
    let row = |candidate: &Candidate| {
        let m = &candidate.metrics;
        let mut row = place(&candidate.condition, candidate.method);
        row.push(candidate.tuned_on.to_string());
        row.push(candidate.chosen.to_string());
        row.push(m.steps.to_string());
        row.extend([m.ed_mean_m, m.nees_mean, m.coverage90, m.nll].map(number));
        row
    };
    csv(&[&PLACE[..], &own].concat(), candidates.iter().map(row))
}

fn phases_csv(cells: &[CellSummary]) -> Vec<u8> {
    let own = [
        "phase",
        "steps",
        "ed_mean_m",
        "nees_mean",
        "coverage90",
        "nll",
    ];
    let rows = cells.iter().flat_map(|cell| {
        cell.phases.iter().map(|phase| {
            let m = &phase.metrics;
            let mut row = place(&cell.condition, cell.method);
            row.push(format!("{:?}", phase.phase).to_lowercase());
            row.push(m.steps.to_string());
            row.extend([m.ed_mean_m, m.nees_mean, m.coverage90, m.nll].map(number));
            row
        })
    });
    csv(&[&PLACE[..], &own].concat(), rows)
}

fn reliability_csv(cells: &[CellSummary]) -> Vec<u8> {
    let rows = cells.iter().flat_map(|cell| {
        NOMINAL
            .into_iter()
            .zip(cell.reliability)
            .map(|(nominal, observed)| {
                let mut row = place(&cell.condition, cell.method);
                row.extend([nominal, observed].map(number));
                row
            })
    });
    csv(&[&PLACE[..], &["nominal", "observed"]].concat(), rows)
}

fn comparisons_csv(comparisons: &[Comparison]) -> Vec<u8> {
    let header = [
        "noise_table",
        "noise",
        "rate",
        "a",
        "b",
        "ed_difference_m",
        "low_m",
        "high_m",
        "a_wins",
        "clusters",
    ];
    let row = |comparison: &Comparison| {
        let mut row = place(&comparison.condition, comparison.a);
        row.push(comparison.b.to_string());
        row.extend(difference(&comparison.ed_m));
        row
    };
    csv(&header, comparisons.iter().map(row))
}

fn forecasts_csv(forecasts: &[ForecastSummary]) -> Vec<u8> {
    let own = [
        "horizon_s",
        "forecasts",
        "ed_mean_m",
        "ed_low_m",
        "ed_high_m",
        "nees_mean",
        "coverage90",
        "nll",
        "diverged",
    ];
    let row = |summary: &ForecastSummary| {
        let (cell, m) = (&summary.cell, &summary.cell.metrics);
        let mut row = place(&cell.condition, cell.method);
        row.push(number(cell.horizon_s));
        row.push(m.forecasts.to_string());
        let interval_m = &summary.ed_interval_m;
        row.extend([m.ed_mean_m, interval_m.low, interval_m.high].map(number));
        row.extend([m.nees_mean, m.coverage90, m.nll].map(number));
        row.push(m.diverged.to_string());
        row
    };
    csv(&[&PLACE[..], &own].concat(), forecasts.iter().map(row))
}

fn forecast_comparisons_csv(comparisons: &[ForecastComparison]) -> Vec<u8> {
    let header = [
        "noise_table",
        "noise",
        "rate",
        "a",
        "b",
        "horizon_s",
        "ed_difference_m",
        "low_m",
        "high_m",
        "a_wins",
        "clusters",
    ];
    let row = |comparison: &ForecastComparison| {
        let mut row = place(&comparison.condition, comparison.a);
        row.push(comparison.b.to_string());
        row.push(number(comparison.horizon_s));
        row.extend(difference(&comparison.ed_m));
        row
    };
    csv(&header, comparisons.iter().map(row))
}

/// Difference, interval, wins, clusters.
fn difference(ed_m: &PairedDifference) -> Vec<String> {
    let numbers = [ed_m.difference, ed_m.interval.low, ed_m.interval.high];
    let mut row = numbers.map(number).to_vec();
    row.extend([ed_m.wins, ed_m.clusters].map(|count| count.to_string()));
    row
}

fn variations_csv(cells: &[VariedCell]) -> Vec<u8> {
    let own = [
        "steps",
        "ed_mean_m",
        "nees_mean",
        "coverage90",
        "nll",
        "diverged",
        "rejected",
        "restarted",
        "not_tracked",
        "outside",
    ];
    let row = |cell: &VariedCell| {
        let m = &cell.metrics;
        let mut row = vec![cell.variation.clone()];
        row.extend(place(&cell.condition, cell.method));
        row.push(m.steps.to_string());
        row.extend([m.ed_mean_m, m.nees_mean, m.coverage90, m.nll].map(number));
        row.extend(counts(m));
        row
    };
    csv(
        &[&["variation"], &PLACE[..], &own].concat(),
        cells.iter().map(row),
    )
}

fn bounds_csv(floors: &[Floor]) -> Vec<u8> {
    let row = |floor: &Floor| {
        let c = &floor.condition;
        vec![
            c.table.to_string(),
            c.noise.to_string(),
            c.rate.to_string(),
            number(floor.ed_m),
        ]
    };
    csv(
        &["noise_table", "noise", "rate", "ed_m"],
        floors.iter().map(row),
    )
}

/// Divergences, rejections, restarts, steps not tracked, steps outside.
fn counts(metrics: &CellMetrics) -> [String; 5] {
    [
        metrics.diverged,
        metrics.rejected,
        metrics.restarted,
        metrics.not_tracked,
        metrics.outside,
    ]
    .map(|count| count.to_string())
}

fn place(condition: &Condition, method: Method) -> Vec<String> {
    vec![
        condition.table.to_string(),
        condition.noise.to_string(),
        condition.rate.to_string(),
        method.to_string(),
    ]
}
