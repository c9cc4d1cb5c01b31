//! The error in the first two seconds, in gaps and elsewhere, apart.

use crate::campaign::cell_summary::CellSummary;
use crate::plot::legend::{self, Mark};
use crate::plot::palette::look;
use crate::plot::panel::Panel;
use crate::plot::scale::Scale;
use crate::plot::svg::{Anchor, FAINT_INK, Lettering, Rect, Stroke, Svg, lettering};
use crate::scoring::phase::Phase;

const LEFT: f64 = 70.0;
const PANEL_WIDTH: f64 = 310.0;
const PANEL_HEIGHT: f64 = 280.0;
const GAP: f64 = 56.0;
/// Part of a slot that its markers spread over.
const SPREAD: f64 = 0.8;

/// The figure over `groups`: a title and the cells of one panel each.
pub fn draw(groups: &[(String, Vec<&CellSummary>)]) -> String {
    let columns = groups.len().max(1) as f64;
    let width = LEFT + columns * (PANEL_WIDTH + GAP) - GAP + 24.0;
    let cells = groups.first().map_or(&[][..], |(_, cells)| cells);
    let entries: Vec<_> = cells
        .iter()
        .map(|cell| (Mark::Method(look(cell.method)), cell.method.label()))
        .collect();
    let (lines, legend_height) = legend::lines(&entries, width - LEFT - 24.0);
    let header = 104.0 + legend_height;
    let mut svg = Svg::new(
        width,
        header + PANEL_HEIGHT + 44.0,
        "Error by phase of the flight",
    );
    let title = "Mean error in the first two seconds, in later gaps, and at later readings";
    svg.heading((LEFT, 26.0), title);
    legend::draw_lines(&mut svg, (LEFT, 56.0), &lines);
    for (index, (title, cells)) in groups.iter().enumerate() {
        let values = cells
            .iter()
            .flat_map(|cell| cell.phases.iter().map(|phase| phase.metrics.ed_mean_m));
        let panel = Panel {
            frame: Rect {
                x: LEFT + index as f64 * (PANEL_WIDTH + GAP),
                y: header,
                width: PANEL_WIDTH,
                height: PANEL_HEIGHT,
            },
            x: Scale::linear(0.0, Phase::ALL.len() as f64),
            y: Scale::logarithmic_over(values),
        };
        panel.stripe(&mut svg, 1.0, 2.0, "#f4f6f8");
        panel.y_grid(&mut svg, true);
        panel.title(&mut svg, title);
        if index == 0 {
            panel.y_name(&mut svg, "ED, m", 48.0);
        }
        for (slot, name) in ["first 2 s", "gaps", "readings"].into_iter().enumerate() {
            let (x, y) = panel.at(slot as f64 + 0.5, panel.y.low());
            let text = Lettering {
                anchor: Anchor::Middle,
                colour: FAINT_INK,
                ..lettering(12.0)
            };
            svg.text((x, y + 15.0), name, text);
        }
        for (number, cell) in cells.iter().enumerate() {
            draw_cell(
                &mut svg,
                &panel,
                cell,
                (number as f64 + 0.5) / cells.len() as f64 - 0.5,
            );
        }
        panel.axes(&mut svg);
    }
    svg.finish("phases")
}

fn draw_cell(svg: &mut Svg, panel: &Panel, cell: &CellSummary, place: f64) {
    let look = look(cell.method);
    let points: Vec<_> = cell
        .phases
        .iter()
        .enumerate()
        .map(|(slot, phase)| panel.at(slot as f64 + 0.5 + SPREAD * place, phase.metrics.ed_mean_m))
        .collect();
    svg.polyline(&points, Stroke::solid(look.colour, 0.8));
    for (point, phase) in points.iter().zip(&cell.phases) {
        let ed_m = phase.metrics.ed_mean_m;
        if ed_m.is_finite() {
            svg.titled(&format!("{}: {ed_m:.4} m", cell.method), |svg| {
                look.marker.draw(svg, *point, 4.2, look.colour);
            });
        }
    }
}
