//! The tables of the page, as HTML.

use std::fmt::Write as _;

use bnkf_model_export::radar::noise::NoiseTable;

use crate::campaign::cell_summary::CellSummary;
use crate::campaign::outcome::Outcome;
use crate::campaign::tuning_choice::Candidate;
use crate::contest::tuned_on::TunedOn;
use crate::method::Method;
use crate::plot::svg::escaped;
use crate::report::swatch::swatched;
use crate::report::table::number;
use crate::scenario::radar::Condition;

/// The headline table of one noise table: a row per method, a column per noise level and rate.
/// Cells carry the number of their entry in `outcome.cells`; the page's script fills in other
/// measures.
pub fn headline(
    outcome: &Outcome,
    methods: &[Method],
    conditions: &[Condition],
    table: NoiseTable,
) -> String {
    let own: Vec<_> = conditions
        .iter()
        .filter(|condition| condition.table == table)
        .collect();
    let mut html = format!(
        "<h3>Angle figures as {}</h3>\n<div class=\"scroll\"><table>\n<thead><tr><th></th>",
        name(table)
    );
    for group in own.chunk_by(|a, b| a.noise == b.noise) {
        push(
            &mut html,
            format_args!(
                "<th class=\"group\" colspan=\"{}\">{} noise</th>",
                group.len(),
                group[0].noise
            ),
        );
    }
    html.push_str("</tr>\n<tr><th class=\"method\">rate</th>");
    for condition in &own {
        push(&mut html, format_args!("<th>{}</th>", condition.rate));
    }
    html.push_str("</tr></thead>\n<tbody>\n");
    for method in methods {
        push(
            &mut html,
            format_args!("<tr><th class=\"method\">{}</th>", swatched(*method)),
        );
        for (column, condition) in own.iter().enumerate() {
            let found = outcome
                .cells
                .iter()
                .position(|cell| cell.method == *method && cell.condition == **condition);
            let Some(index) = found else {
                html.push_str("<td>-</td>");
                continue;
            };
            let best = best_of(outcome, condition);
            let (is_best, tie) = (
                best == Some(*method),
                best.is_some_and(|best| tied(outcome, condition, *method, best)),
            );
            let first = begins_noise(&own, column);
            push(
                &mut html,
                format_args!(
                    "<td class=\"{}{}{}\" data-cell=\"{index}\" data-column=\"{table}-{column}\" data-tie=\"{}\">{}</td>",
                    if first { "first " } else { "" },
                    if is_best { "best " } else { "" },
                    if tie { "tie" } else { "" },
                    u8::from(tie),
                    number(outcome.cells[index].metrics.ed_mean_m),
                ),
            );
        }
        html.push_str("</tr>\n");
    }
    push_floor(&mut html, outcome, &own);
    html.push_str("</tbody></table></div>\n");
    html
}

/// Whether a column is the first of its noise level.
fn begins_noise(conditions: &[&Condition], column: usize) -> bool {
    let before = column.checked_sub(1).map(|before| conditions[before].noise);
    before != Some(conditions[column].noise)
}

fn push_floor(html: &mut String, outcome: &Outcome, conditions: &[&Condition]) {
    html.push_str("<tr><th class=\"method\">bound</th>");
    for (column, condition) in conditions.iter().enumerate() {
        let floor = outcome
            .floors
            .iter()
            .find(|floor| floor.condition == **condition);
        let text = floor.map_or("-".to_owned(), |floor| number(floor.ed_m));
        let first = if begins_noise(conditions, column) {
            " class=\"first\""
        } else {
            ""
        };
        push(
            html,
            format_args!("<td{first} data-floor=\"{text}\">{text}</td>"),
        );
    }
    html.push_str("</tr>\n");
}

/// NEES and NIS against their bounds for the cells of one noise table.
pub fn consistency(cells: &[&CellSummary]) -> String {
    let mut html = "<div class=\"scroll\"><table>\n<thead><tr><th class=\"method\">method</th><th>noise</th><th>rate</th>\
                    <th>NEES</th><th>95% interval</th><th>NEES in bounds</th><th>above</th><th>NIS / dof</th>\
                    <th>NIS in bounds</th><th>in 50%</th><th>in 90%</th><th>in 95%</th></tr></thead>\n<tbody>\n"
        .to_owned();
    for cell in cells {
        let percent = |part: f64| {
            if part.is_finite() {
                format!("{:.0}%", 100.0 * part)
            } else {
                "-".to_owned()
            }
        };
        push(
            &mut html,
            format_args!(
                "<tr><th class=\"method\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{} to {}</td><td>{}</td><td>{}</td>\
                 <td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                swatched(cell.method),
                cell.condition.noise,
                cell.condition.rate,
                number(cell.metrics.nees_mean),
                number(cell.nees_interval.low),
                number(cell.nees_interval.high),
                percent(cell.nees_bounds.inside),
                percent(cell.nees_bounds.above),
                number(cell.nis_ratio),
                percent(cell.nis_bounds.inside),
                percent(cell.coverage50),
                percent(cell.metrics.coverage90),
                percent(cell.coverage95),
            ),
        );
    }
    html.push_str("</tbody></table></div>\n");
    html
}

/// The methods that lost whole flights, with how many over all conditions.
pub fn lost(cells: &[CellSummary]) -> String {
    let mut sums: Vec<(Method, usize)> = Vec::new();
    for cell in cells.iter().filter(|cell| cell.flights_not_tracked > 0) {
        match sums.iter_mut().find(|(method, _)| *method == cell.method) {
            Some((_, sum)) => *sum += cell.flights_not_tracked,
            None => sums.push((cell.method, cell.flights_not_tracked)),
        }
    }
    if sums.is_empty() {
        return "none.".to_owned();
    }
    let one = |(method, sum): &(Method, usize)| format!("{} {sum}", escaped(method.label()));
    let all: Vec<String> = sums.iter().map(one).collect();
    format!("{} (all conditions together).", all.join(", "))
}

/// Mean ED of the tuned methods with each set of parameters, for the cells of one noise table.
pub fn tunings(candidates: &[Candidate], table: NoiseTable) -> String {
    let own: Vec<_> = candidates
        .iter()
        .filter(|candidate| candidate.condition.table == table)
        .collect();
    let mut html = format!(
        "<details><summary>Every fit, angle figures as {}</summary><div class=\"scroll\"><table>\n<thead><tr>\
         <th class=\"method\">method</th><th>noise</th><th>rate</th>",
        name(table)
    );
    for tuned_on in TunedOn::ALL {
        push(&mut html, format_args!("<th>{tuned_on}, m</th>"));
    }
    html.push_str("</tr></thead>\n<tbody>\n");
    let same = |a: &&Candidate, b: &&Candidate| (a.method, a.condition) == (b.method, b.condition);
    for row in own.chunk_by(same) {
        push(
            &mut html,
            format_args!(
                "<tr><th class=\"method\">{}</th><td>{}</td><td>{}</td>",
                swatched(row[0].method),
                row[0].condition.noise,
                row[0].condition.rate,
            ),
        );
        for candidate in row {
            let best = if candidate.chosen {
                " class=\"best\""
            } else {
                ""
            };
            let ed_m = number(candidate.metrics.ed_mean_m);
            push(&mut html, format_args!("<td{best}>{ed_m}</td>"));
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</tbody></table></div></details>\n");
    html
}

/// What each method is.
pub fn methods(methods: &[Method]) -> String {
    let mut html = "<div class=\"scroll\"><table>\n<tbody>\n".to_owned();
    for method in methods {
        push(
            &mut html,
            format_args!(
                "<tr><th class=\"method\">{}</th><td class=\"text\">{}</td></tr>\n",
                swatched(*method),
                escaped(method.description())
            ),
        );
    }
    html.push_str("</tbody></table></div>\n");
    html
}

/// How a noise table is called in sentences.
pub fn name(table: NoiseTable) -> &'static str {
    match table {
        NoiseTable::Radians => "radians (as the authors' code uses them)",
        NoiseTable::Printed => "degrees (as the paper prints them)",
    }
}

/// The method with the smallest mean ED, of those that tracked at all.
fn best_of(outcome: &Outcome, condition: &Condition) -> Option<Method> {
    let own = outcome
        .cells
        .iter()
        .filter(|cell| cell.condition == *condition && cell.metrics.ed_mean_m.is_finite())
        .filter(|cell| cell.metrics.is_tracked());
    own.min_by(|a, b| a.metrics.ed_mean_m.total_cmp(&b.metrics.ed_mean_m))
        .map(|cell| cell.method)
}

/// Whether the interval of the difference between two methods holds zero.
fn tied(outcome: &Outcome, condition: &Condition, one: Method, other: Method) -> bool {
    let pair = outcome.comparisons.iter().find(|comparison| {
        comparison.condition == *condition
            && ((comparison.a, comparison.b) == (one, other)
                || (comparison.a, comparison.b) == (other, one))
    });
    pair.is_some_and(|comparison| !comparison.ed_m.decided())
}

fn push(html: &mut String, text: std::fmt::Arguments<'_>) {
    // Writing to a String cannot fail.
    html.write_fmt(text).expect("a String grows");
}
