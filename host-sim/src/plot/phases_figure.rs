//! The error in the first two seconds, in gaps and elsewhere, apart.

use crate::campaign::cell_summary::CellSummary;
use crate::plot::method_rows::{self, Group, LEFT, Measure, Near};
use crate::plot::svg::Svg;
use crate::scoring::phase::Phase;

const HEADER: f64 = 78.0;
const MEASURE: Measure = Measure {
    title: "Mean distance to the truth (ED)",
    axis: "ED, m",
    near: Near::AboveBest(50.0),
    ideal: None,
};

/// The figure over `groups`: a title and the cells of one noise level each.
pub fn draw(groups: &[(String, Vec<&CellSummary>)]) -> String {
    let group = |(title, cells): &(String, Vec<&CellSummary>)| {
        let row = |cell: &&CellSummary| {
            let of = |ed_m| {
                if cell.metrics.is_tracked() {
                    ed_m
                } else {
                    f64::NAN
                }
            };
            let values = cell.phases.iter().map(|phase| of(phase.metrics.ed_mean_m));
            (cell.method, values.collect())
        };
        Group {
            title: title.clone(),
            rows: cells.iter().map(row).collect(),
            bound: Vec::new(),
        }
    };
    let groups: Vec<Group> = groups.iter().map(group).collect();
    let mut svg = Svg::new(
        method_rows::width(groups.len()),
        HEADER + method_rows::height(&groups),
        "Error by phase of the flight",
        "A row per method, two panels per noise level: the whole range on the left, what lies near the best on the \
         right; three marks a row: first two seconds, gaps, readings.",
    );
    svg.heading(
        (LEFT, 26.0),
        "Mean error in the first two seconds, in later gaps, and at later readings",
    );
    let places = Phase::ALL.map(|phase| name(phase).to_owned());
    svg.note((LEFT, 50.0), &method_rows::note(&places));
    method_rows::draw(&mut svg, HEADER, &MEASURE, &groups);
    svg.finish()
}

const fn name(phase: Phase) -> &'static str {
    match phase {
        Phase::Start => "first two seconds",
        Phase::Gap => "gaps",
        Phase::Measured => "readings",
    }
}
