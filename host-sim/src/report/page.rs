//! The report's page: the template with its places filled.

mod consistency;
mod headline;
mod lost;
mod methods;
mod tunings;

use super::figures::Figure;
use super::noise_table_name::spelt;
use super::{Material, by_motion, forecasts, space, swatch};
use crate::campaign::cell_summary::CellSummary;
use crate::campaign::outcome::{Cluster, Outcome};
use crate::plot::svg::escaped;
use crate::report::campaign_results::CampaignProvenance;

/// The whole page.
pub(super) fn page(material: &Material<'_>, figures: &[Figure]) -> String {
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
    let mut text = include_str!("page.html").to_owned();
    let mut fill = |key: &str, value: &str| text = text.replace(&format!("{{{{{key}}}}}"), value);
    fill(
        "title",
        &escaped(&format!("Evaluation: scenario {}", campaign.scenario.name)),
    );
    fill("lead", &escaped(&lead(material)));
    fill("note", &note(provenance));
    fill("symbols", &swatch::symbols(&campaign.methods));
    fill("tables", &tables);
    fill("lost", &lost::lost(&outcome.cells));
    fill("tuning", &tuning(provenance));
    fill("tunings", &tunings(outcome, provenance));
    for section in [
        "metrics",
        "trajectory",
        "reliability",
        "comparison",
        "phases",
        "motion",
        "forecast-figure",
        "suspicion",
        "variations",
        "flights",
        "gaps",
        "runtime",
    ] {
        let own = figures.iter().filter(|figure| figure.section == section);
        let html: String = own
            .map(|figure| {
                format!(
                    "<figure>\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{0}\">{1}</div>\
                     <figcaption>{2} ({0}.svg)</figcaption></figure>\n",
                    figure.name,
                    figure.svg,
                    escaped(&figure.caption),
                )
            })
            .collect();
        fill(section, &html);
    }
    let by_motion: String = radar
        .tables
        .iter()
        .map(|table| by_motion::html(&outcome.plain_cells(*table), *table))
        .collect();
    fill("by-motion", &by_motion);
    let ahead = outcome.forecast_cells(radar.tables[0]);
    fill("forecasts", &forecasts::html(&ahead));
    let shown = spelt(radar.tables[0]);
    let consistency = consistency::consistency(&full_rate);
    fill(
        "consistency",
        &format!("<p>Angle figures as {shown}.</p>\n{consistency}"),
    );
    let cluster = match outcome.cluster {
        Cluster::Recording => "recording",
        Cluster::Flight => "flight",
    };
    fill("cluster", cluster);
    fill("methods", &methods::methods(&campaign.methods));
    fill("provenance", &provenance_list(provenance));
    fill("version", provenance.version);
    fill("css", include_str!("page.css"));
    // Script and data last: nothing of theirs is taken for a place to fill.
    fill("js", include_str!("page.js"));
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
        "{}. {} flights from {} recordings{} ({}), {} methods on the same readings, {} folds by recording, {} scored estimates.",
        campaign.scenario.summary,
        provenance.flights,
        provenance.recordings,
        match provenance.runs {
            1 => String::new(),
            runs => format!(", each {runs} times"),
        },
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

fn tuning(provenance: &CampaignProvenance) -> String {
    let generated = format!(
        "Filters are tuned on {} generated flights of a seed of their own, in every run the same.",
        provenance.tuning_flights
    );
    if provenance.tuned_on.len() == 1 {
        return generated;
    }
    format!(
        "{generated} They are also tuned on the recordings that the fold does not test, and on both. Every cell shows \
         the best of the three, which favours the filters: the choice knows the flights that it is judged by."
    )
}

/// Nothing if there was nothing to choose.
fn tunings(outcome: &Outcome, provenance: &CampaignProvenance) -> String {
    if provenance.tuned_on.len() == 1 || outcome.candidates.is_empty() {
        return String::new();
    }
    tunings::tunings(&outcome.candidates, provenance.noise_tables[0])
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
            "tuning",
            format!(
                "{} generated flights (SHA-256 {})",
                p.tuning_flights, p.tuning_sha256
            ),
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
