//! The report's figures with their captions and their places on the page.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};

use super::noise_table_name::spelt;
use super::{Material, SHOWN, by_motion, suspected};
use crate::campaign::Campaign;
use crate::campaign::cell_summary::CellSummary;
use crate::campaign::comparison::Comparison;
use crate::campaign::generalisation::VariedCell;
use crate::campaign::outcome::Outcome;
use crate::method::Method;
use crate::plot::{
    comparison_figure, flights_figure, forecast_figure, gaps_figure, metrics_figure, motion_figure,
    phases_figure, reliability_figure, runtime_figure, trajectory_figure, variation_figure,
};
use crate::scenario::radar::Condition;
use crate::scoring::bin::By;
use crate::scoring::forecast::ForecastCell;

/// Methods that others are compared with, the first that took part.
const REFERENCES: [Method; 3] = [Method::EkfTuned, Method::Imm10, Method::Ekf];

/// What captions say of the distance.
const ED: &str = "ED is the Euclidean distance of an estimate from the truth, metres; what is drawn is its mean.";
/// And of the consistency.
const NEES: &str = "NEES is the mean of the squared Mahalanobis distance (MD), the error measured in the estimate's own standard \
                    deviations: 3, one for each axis, if the covariance is right.";

/// A figure, its section on the page and what it says.
pub(super) struct Figure {
    /// Section of the page.
    pub section: &'static str,
    /// Name of the file, without its ending.
    pub name: String,
    /// What it shows and how to read it, below it.
    pub caption: String,
    /// The drawing.
    pub svg: String,
}

/// Every figure of the page, in order.
pub(super) fn draw(material: &Material<'_>) -> Vec<Figure> {
    let Material {
        campaign,
        outcome,
        examples,
        times,
        ..
    } = material;
    let radar = &campaign.scenario.radar;
    let mut figures = Vec::new();
    let mut add = |section, name: String, caption: String, svg| {
        figures.push(Figure {
            section,
            name,
            caption,
            svg,
        })
    };
    for &table in &radar.tables {
        let spelt = spelt(table);
        let floors: Vec<metrics_figure::Floor> = outcome
            .floors
            .iter()
            .filter(|floor| floor.condition.table == table)
            .map(|floor| (floor.condition.noise, floor.condition.rate, floor.ed_m))
            .collect();
        let cells = outcome.plain_cells(table);
        add(
            "metrics",
            format!("metrics-{table}"),
            format!(
                "{ED} {NEES} Coverage is the part of the truths inside the 90% ellipsoid. Left of each pair every method, \
                 right what lies near the best or the ideal, magnified. Dashes are the bound of the table. Angle figures as {spelt}."
            ),
            metrics_figure::draw(&cells, &floors),
        );
        let full = groups(outcome, &radar.rates, table, 0);
        let measured = format!("{}; angle figures as {spelt}.", part(radar.rates[0]));
        add(
            "reliability",
            format!("reliability-{table}"),
            format!(
                "The squared MD of the truth over a chi-square distribution gives the smallest ellipsoid that holds it. Above every \
                 method; below, for those whose whole line is within 0.1 of the ideal, how much of the truths lies inside minus what was claimed. {measured}"
            ),
            reliability_figure::draw(&full),
        );
        if let Some(reference) = reference(&campaign.methods) {
            let groups = comparison_groups(outcome, reference, &radar.rates, table);
            add(
                "comparison",
                format!("comparison-{table}"),
                format!(
                    "Difference of the mean ED in per cent of that of {reference}; where a bar holds zero, the flights do not \
                     decide. {measured}"
                ),
                comparison_figure::draw(reference, &groups),
            );
        }
        let sparse = groups(outcome, &radar.rates, table, radar.rates.len() - 1);
        let caption = format!(
            "{ED} Left of each pair every method, right what lies near the best. {}; angle figures as {spelt}.",
            part(radar.rates[radar.rates.len() - 1])
        );
        add(
            "phases",
            format!("phases-{table}"),
            caption,
            phases_figure::draw(&sparse),
        );
        let by_noise = by_motion::shown(&cells);
        let chosen = if by_noise
            .first()
            .is_some_and(|own| own.len() < campaign.methods.len())
        {
            "Of many methods those are drawn that are honest somewhere; bins.csv has all. "
        } else {
            ""
        };
        for by in By::ALL {
            add(
                "motion",
                format!("{}-{table}", by.label()),
                format!("{NEES} {chosen}Angle figures as {spelt}."),
                motion_figure::draw(by, &by_noise),
            );
        }
    }
    for noise in NoiseLevel::ALL {
        let caption = format!(
            "{ED} {NEES} {}At {noise} noise, sampling rate {}.",
            drawn(campaign),
            radar.rates[0]
        );
        let svg = variation_figure::draw(
            &variation_rows(campaign, outcome, noise),
            &shown_methods(campaign),
        );
        add("variations", format!("variations-{noise}"), caption, svg);
    }
    let ahead: Vec<ForecastCell> = outcome
        .forecast_cells(radar.tables[0])
        .into_iter()
        .filter(|cell| cell.condition.rate == radar.rates[0])
        .collect();
    if ahead.iter().any(|cell| cell.metrics.forecasts > 0) {
        let caption = format!(
            "{ED} Left of each pair every method, right what lies near the best or the ideal. Sampling rate {}.",
            radar.rates[0]
        );
        add(
            "forecast-figure",
            "forecasts".to_owned(),
            caption,
            forecast_figure::draw(&ahead),
        );
    }
    if let Some((caption, svg)) = suspected::draw(campaign) {
        add("suspicion", "suspicion".to_owned(), caption, svg);
    }
    let caption = format!(
        "{}From above only those near the best; each has its panel, and a switch in the view in space below. Readings far outside a view \
         are counted, not drawn.",
        drawn(campaign)
    );
    add(
        "trajectory",
        "trajectory".to_owned(),
        caption,
        trajectory_figure::draw(examples),
    );
    let shown: Vec<&Flight> = campaign.runs.first().iter().collect();
    let caption = format!("The first of {} flights.", campaign.runs.first);
    add(
        "flights",
        "flights".to_owned(),
        caption,
        flights_figure::draw(&shown),
    );
    let condition = |rate| Condition {
        table: radar.tables[0],
        noise: NoiseLevel::Low,
        rate,
    };
    let flight = &campaign.runs.flights[0];
    let rows: Vec<_> = radar
        .rates
        .iter()
        .map(|&rate| (rate, radar.readings(flight, condition(rate), campaign.seed)))
        .collect();
    let caption = "Low noise. Gaps are scored like everything else.".to_owned();
    add(
        "gaps",
        "gaps".to_owned(),
        caption,
        gaps_figure::draw(flight, &rows),
    );
    if !times.is_empty() {
        let caption =
            "Median over flights at high noise, all samples measured, built with optimisation.";
        add(
            "runtime",
            "runtime".to_owned(),
            caption.to_owned(),
            runtime_figure::draw(times),
        );
    }
    figures
}

/// How many of a flight's samples are measured.
fn part(rate: SamplingRate) -> String {
    if rate == SamplingRate::FULL {
        "All samples measured".to_owned()
    } else {
        format!("Sampling rate {rate}")
    }
}

/// Error and NEES at `noise` and the first sampling rate.
fn variation_rows<'a>(
    campaign: &Campaign,
    outcome: &'a Outcome,
    noise: NoiseLevel,
) -> Vec<variation_figure::Row<'a>> {
    let rate = campaign.scenario.radar.rates[0];
    let own = |cell: &&VariedCell| cell.condition.noise == noise && cell.condition.rate == rate;
    let cells: Vec<&VariedCell> = outcome.variations.iter().filter(own).collect();
    vec![
        variation_figure::Row {
            title: format!("Mean distance to the truth, {noise} noise"),
            axis: "ED, m",
            ideal: None,
            value: |cell| cell.metrics.ed_mean_m,
            cells: cells.clone(),
        },
        variation_figure::Row {
            title: "Consistency (above 3: overconfident)".to_owned(),
            axis: "NEES",
            ideal: Some(3.0),
            value: |cell| cell.metrics.nees_mean,
            cells,
        },
    ]
}

/// Which methods a figure of [`SHOWN`] has, where that is not all.
fn drawn(campaign: &Campaign) -> String {
    let shown = shown_methods(campaign);
    if shown.len() == campaign.methods.len() {
        return String::new();
    }
    if shown.is_empty() {
        return "None of these methods is drawn. ".to_owned();
    }
    let names: Vec<_> = shown.iter().map(|method| method.label()).collect();
    let count = campaign.methods.len();
    format!("Of {count} methods those drawn: {}. ", names.join(", "))
}

/// The methods of [`SHOWN`] that took part.
fn shown_methods(campaign: &Campaign) -> Vec<Method> {
    SHOWN
        .into_iter()
        .filter(|method| campaign.methods.contains(method))
        .collect()
}

/// The cells of each noise level at the rate with number `rate`.
fn groups<'a>(
    outcome: &'a Outcome,
    rates: &[SamplingRate],
    table: NoiseTable,
    rate: usize,
) -> Vec<(String, Vec<&'a CellSummary>)> {
    let group = |noise: NoiseLevel| {
        let condition = Condition {
            table,
            noise,
            rate: rates[rate],
        };
        let cells = outcome
            .cells
            .iter()
            .filter(|cell| cell.condition == condition)
            .collect();
        (format!("{noise} noise, rate {}", rates[rate]), cells)
    };
    NoiseLevel::ALL.map(group).to_vec()
}

fn reference(methods: &[Method]) -> Option<Method> {
    REFERENCES
        .into_iter()
        .find(|reference| methods.contains(reference))
}

fn comparison_groups(
    outcome: &Outcome,
    reference: Method,
    rates: &[SamplingRate],
    table: NoiseTable,
) -> Vec<comparison_figure::Group> {
    groups(outcome, rates, table, 0)
        .into_iter()
        .map(|(title, cells)| {
            let own: Vec<&Comparison> = outcome
                .comparisons
                .iter()
                .filter(|comparison| {
                    cells
                        .first()
                        .is_some_and(|cell| cell.condition == comparison.condition)
                })
                .collect();
            let reference_cell = cells.iter().find(|cell| cell.method == reference);
            let ed_m = reference_cell.map_or(f64::NAN, |cell| cell.metrics.ed_mean_m);
            comparison_figure::Group::new(title, reference, ed_m, &own)
        })
        .collect()
}
