//! The report: one page that opens without a network, and its figures as files.

mod headline;
mod space;

use bnkf_model_export::flight::Flight;
use bnkf_model_export::noise::{NoiseLevel, NoiseTable};

use crate::campaign::Campaign;
use crate::campaign::cell_summary::CellSummary;
use crate::campaign::comparison::Comparison;
use crate::campaign::generalisation::VariedCell;
use crate::campaign::outcome::{Cluster, Outcome};
use crate::campaign::results::CampaignProvenance;
use crate::cell::Cell;
use crate::method::Method;
use crate::plot::svg::escaped;
use crate::plot::trajectory_figure::Example;
use crate::plot::{
    comparison_figure, flights_figure, gaps_figure, metrics_figure, phases_figure,
    reliability_figure, runtime_figure, trajectory_figure, variation_figure,
};
use crate::radar::Condition;
use crate::runtime::MethodTime;

/// Methods that the example tracks show: more would be too many lines.
pub const SHOWN: [Method; 6] = [
    Method::Ekf,
    Method::EkfTuned,
    Method::Imm10,
    Method::Bnn,
    Method::Bnkf,
    Method::Recursive,
];

/// Methods that others are compared with, the first that took part.
const REFERENCES: [Method; 3] = [Method::EkfTuned, Method::Imm10, Method::Ekf];

/// Everything that the page shows.
#[derive(Clone, Copy, Debug)]
pub struct Material<'a> {
    /// What was evaluated.
    pub campaign: &'a Campaign,
    /// What came out.
    pub outcome: &'a Outcome,
    /// What made it.
    pub provenance: &'a CampaignProvenance,
    /// One flight per noise level with the tracks of [`SHOWN`].
    pub examples: &'a [Example<'a>],
    /// What a step costs.
    pub times: &'a [MethodTime],
}

/// A file of the report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReportFile {
    /// Name.
    pub name: String,
    /// Contents.
    pub text: String,
}

/// The page, `report.html`, and its figures.
pub fn files(material: &Material<'_>) -> Vec<ReportFile> {
    let figures = figures(material);
    let mut files = vec![ReportFile {
        name: "report.html".to_owned(),
        text: page(material, &figures),
    }];
    files.extend(figures.into_iter().map(|figure| ReportFile {
        name: format!("{}.svg", figure.name),
        text: figure.svg,
    }));
    files
}

/// A figure, its section on the page and what it says.
struct Figure {
    section: &'static str,
    name: String,
    caption: String,
    svg: String,
}

fn figures(material: &Material<'_>) -> Vec<Figure> {
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
        let spelt = headline::name(table);
        let floors: Vec<metrics_figure::Floor> = outcome
            .floors
            .iter()
            .filter(|floor| floor.condition.table == table)
            .map(|floor| (floor.condition.noise, floor.condition.rate, floor.ed_m))
            .collect();
        let cells: Vec<Cell> = outcome
            .cells
            .iter()
            .filter(|cell| cell.condition.table == table)
            .map(plain_cell)
            .collect();
        add(
            "metrics",
            format!("metrics-{table}"),
            format!("Angle figures as {spelt}."),
            metrics_figure::draw(&cells, &floors),
        );
        let full = groups(outcome, &radar.rates, table, 0);
        let caption = format!("All samples measured; angle figures as {spelt}.");
        add(
            "reliability",
            format!("reliability-{table}"),
            caption.clone(),
            reliability_figure::draw(&full),
        );
        if let Some(reference) = reference(&campaign.methods) {
            let groups = comparison_groups(outcome, reference, &radar.rates, table);
            add(
                "comparison",
                format!("comparison-{table}"),
                caption,
                comparison_figure::draw(reference, &groups),
            );
        }
        let sparse = groups(outcome, &radar.rates, table, radar.rates.len() - 1);
        let caption = format!(
            "Sampling rate {}; angle figures as {spelt}.",
            radar.rates[radar.rates.len() - 1]
        );
        add(
            "phases",
            format!("phases-{table}"),
            caption,
            phases_figure::draw(&sparse),
        );
    }
    for noise in NoiseLevel::ALL {
        let caption = format!("{noise} noise, sampling rate {}.", radar.rates[0]);
        let svg = variation_figure::draw(
            &variation_rows(campaign, outcome, noise),
            &shown_methods(campaign),
        );
        add("variations", format!("variations-{noise}"), caption, svg);
    }
    let caption = "Readings far outside the view are counted, not drawn.".to_owned();
    add(
        "trajectory",
        "trajectory".to_owned(),
        caption,
        trajectory_figure::draw(examples),
    );
    let shown: Vec<&Flight> = campaign.flights.iter().collect();
    let caption = format!("The first of {} flights.", campaign.flights.len());
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
    let flight = &campaign.flights[0];
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
    let caption =
        "Median over flights at high noise, all samples measured, built with optimisation."
            .to_owned();
    add(
        "runtime",
        "runtime".to_owned(),
        caption,
        runtime_figure::draw(times),
    );
    figures
}

/// Error and NEES at `noise`, all samples measured.
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

/// The methods of [`SHOWN`] that took part.
fn shown_methods(campaign: &Campaign) -> Vec<Method> {
    SHOWN
        .into_iter()
        .filter(|method| campaign.methods.contains(method))
        .collect()
}

fn plain_cell(cell: &CellSummary) -> Cell {
    Cell {
        method: cell.method,
        noise: cell.condition.noise,
        rate: cell.condition.rate,
        metrics: cell.metrics,
    }
}

/// The cells of each noise level at the rate with number `rate`.
fn groups<'a>(
    outcome: &'a Outcome,
    rates: &[bnkf_model_export::gaps::SamplingRate],
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
    rates: &[bnkf_model_export::gaps::SamplingRate],
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

fn page(material: &Material<'_>, figures: &[Figure]) -> String {
    let Material {
        campaign,
        outcome,
        provenance,
        examples,
        ..
    } = material;
    let radar = &campaign.scenario.radar;
    let conditions = radar.conditions();
    let tables: String = radar
        .tables
        .iter()
        .map(|table| headline::headline(outcome, &campaign.methods, &conditions, *table))
        .collect();
    let full_rate: Vec<&CellSummary> = outcome
        .cells
        .iter()
        .filter(|cell| {
            cell.condition.table == radar.tables[0] && cell.condition.rate == radar.rates[0]
        })
        .collect();
    let mut text = include_str!("report/page.html").to_owned();
    let mut fill = |key: &str, value: &str| text = text.replace(&format!("{{{{{key}}}}}"), value);
    fill(
        "title",
        &escaped(&format!("Evaluation: scenario {}", campaign.scenario.name)),
    );
    fill("lead", &escaped(&lead(material)));
    fill("note", &note(provenance));
    fill("tables", &tables);
    for section in [
        "metrics",
        "trajectory",
        "reliability",
        "comparison",
        "phases",
        "variations",
        "flights",
        "gaps",
        "runtime",
    ] {
        let own = figures.iter().filter(|figure| figure.section == section);
        let html: String = own
            .map(|figure| {
                format!(
                    "<figure>\n{}<figcaption>{} ({}.svg)</figcaption></figure>\n",
                    figure.svg,
                    escaped(&figure.caption),
                    figure.name
                )
            })
            .collect();
        fill(section, &html);
    }
    fill("consistency", &headline::consistency(&full_rate));
    let cluster = match outcome.cluster {
        Cluster::Recording => "recording",
        Cluster::Flight => "flight",
    };
    fill("cluster", cluster);
    fill("methods", &headline::methods(&campaign.methods));
    fill("provenance", &provenance_list(provenance));
    fill("version", provenance.version);
    fill("css", include_str!("report/page.css"));
    // Script and data last: nothing of theirs is taken for a place to fill.
    fill("js", include_str!("report/page.js"));
    fill("data", &space::data(outcome, examples));
    text
}

fn lead(material: &Material<'_>) -> String {
    let Material {
        campaign,
        outcome,
        provenance,
        ..
    } = material;
    let steps: u64 = outcome.cells.iter().map(|cell| cell.metrics.steps).sum();
    format!(
        "{}. {} flights from {} recordings ({}), {} methods on the same readings, {} folds by recording, {} scored estimates.",
        campaign.scenario.summary,
        provenance.flights,
        provenance.recordings,
        provenance.data,
        campaign.methods.len(),
        provenance.folds,
        thousands(steps),
    )
}

fn note(provenance: &CampaignProvenance) -> String {
    if !provenance.quick {
        return String::new();
    }
    format!(
        "<p class=\"note\">This is a quick run: {} flights and {} training epochs. Its figures are rough; the networks are not trained out.</p>",
        provenance.flights, provenance.epochs
    )
}

fn provenance_list(provenance: &CampaignProvenance) -> String {
    let p = provenance;
    let rows = [
        ("command", p.command.clone()),
        ("version", p.version.to_owned()),
        ("tree", p.tree.to_owned()),
        ("seed", p.seed.to_string()),
        (
            "scenario",
            format!("{} (SHA-256 {})", p.scenario, p.scenario_sha256),
        ),
        ("flights", format!("{} (SHA-256 {})", p.data, p.data_sha256)),
        (
            "left out",
            if p.unplaced.is_empty() {
                "none".to_owned()
            } else {
                p.unplaced.join("; ")
            },
        ),
        (
            "training",
            format!("{} epochs in each of {} folds", p.epochs, p.folds),
        ),
        (
            "passes",
            p.passes
                .map_or("the models' own number".to_owned(), |passes| {
                    passes.to_string()
                }),
        ),
    ];
    let row =
        |(name, value): (&str, String)| format!("<dt>{name}</dt><dd>{}</dd>\n", escaped(&value));
    format!(
        "<dl>\n{}</dl>\n",
        rows.into_iter().map(row).collect::<String>()
    )
}

/// A number with blanks between thousands.
fn thousands(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push('\u{a0}');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::thousands;

    #[test]
    fn thousands_are_set_apart() {
        assert_eq!(thousands(7), "7");
        assert_eq!(thousands(1234), "1\u{a0}234");
        assert_eq!(thousands(12_345_678), "12\u{a0}345\u{a0}678");
    }
}
