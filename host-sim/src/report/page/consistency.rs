//! How honest the methods are, as a table.

use crate::campaign::cell_summary::CellSummary;
use crate::report::html::push;
use crate::report::swatch::swatched;
use crate::report::table::number;

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
