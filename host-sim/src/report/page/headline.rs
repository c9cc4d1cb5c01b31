//! The headline table: mean ED of every method under every condition.

use bnkf_model_export::radar::noise::NoiseTable;

use crate::campaign::outcome::Outcome;
use crate::method::Method;
use crate::report::html::push;
use crate::report::noise_table_name::spelt;
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
        spelt(table)
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
