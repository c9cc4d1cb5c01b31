//! What filters were tuned on, as a table.

use bnkf_model_export::radar::noise::NoiseTable;

use crate::campaign::tuning_choice::Candidate;
use crate::contest::tuned_on::TunedOn;
use crate::report::html::push;
use crate::report::noise_table_name::spelt;
use crate::report::swatch::swatched;
use crate::report::table::number;

/// Mean ED of the tuned methods with each set of parameters, for the cells of one noise table.
pub fn tunings(candidates: &[Candidate], table: NoiseTable) -> String {
    let own: Vec<_> = candidates
        .iter()
        .filter(|candidate| candidate.condition.table == table)
        .collect();
    let mut html = format!(
        "<details><summary>Every fit, angle figures as {}</summary><div class=\"scroll\"><table>\n<thead><tr>\
         <th class=\"method\">method</th><th>noise</th><th>rate</th>",
        spelt(table)
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
