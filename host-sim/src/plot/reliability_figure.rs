//! Reliability: how often the truth lies inside ellipsoids that claim a probability.

use crate::campaign::cell_summary::CellSummary;
use crate::plot::legend::{self, Mark};
use crate::plot::palette::look;
use crate::plot::panel::Panel;
use crate::plot::scale::Scale;
use crate::plot::svg::{FAINT_INK, INK, Lettering, Rect, Stroke, Svg, lettering};
use crate::scoring::consistency::NOMINAL;

const LEFT: f64 = 70.0;
const SIDE: f64 = 310.0;
const GAP: f64 = 56.0;
const IDEAL: Stroke<'static> = Stroke {
    colour: INK,
    width: 1.2,
    dash: "6 4",
};

/// The figure over `groups`: a title and the cells of one panel each.
pub fn draw(groups: &[(String, Vec<&CellSummary>)]) -> String {
    let columns = groups.len().max(1) as f64;
    let width = LEFT + columns * (SIDE + GAP) - GAP + 24.0;
    let methods: Vec<_> = groups.first().map_or(Vec::new(), |(_, cells)| {
        cells.iter().map(|cell| cell.method).collect()
    });
    let mut entries: Vec<_> = methods
        .iter()
        .map(|m| (Mark::Method(look(*m)), m.label()))
        .collect();
    entries.push((Mark::Line(IDEAL), "ideal"));
    let (lines, legend_height) = legend::lines(&entries, width - LEFT - 24.0);
    let header = 104.0 + legend_height;
    let mut svg = Svg::new(
        width,
        header + SIDE + 52.0,
        "Reliability diagram of every method",
    );
    let title = "Reliability: below the diagonal a covariance is too small";
    svg.heading((LEFT, 26.0), title);
    legend::draw_lines(&mut svg, (LEFT, 56.0), &lines);
    for (index, (title, cells)) in groups.iter().enumerate() {
        let panel = Panel {
            frame: Rect {
                x: LEFT + index as f64 * (SIDE + GAP),
                y: header,
                width: SIDE,
                height: SIDE,
            },
            x: Scale::linear(0.0, 1.0),
            y: Scale::linear(0.0, 1.0),
        };
        panel.y_grid(&mut svg, true);
        panel.x_grid(&mut svg, 5);
        panel.title(&mut svg, title);
        panel.x_name(&mut svg, "claimed probability");
        if index == 0 {
            panel.y_name(&mut svg, "truths inside", 44.0);
        }
        panel.line(&mut svg, &[(0.0, 0.0), (1.0, 1.0)], IDEAL);
        for cell in cells {
            let look = look(cell.method);
            let line: Vec<_> = NOMINAL.into_iter().zip(cell.reliability).collect();
            svg.titled(cell.method.label(), |svg| {
                panel.line(svg, &line, Stroke::solid(look.colour, 1.5));
                for (x, y) in line
                    .iter()
                    .skip(1)
                    .step_by(2)
                    .filter(|(_, y)| y.is_finite())
                {
                    look.marker.draw(svg, panel.at(*x, *y), 3.2, look.colour);
                }
            });
        }
        panel.axes(&mut svg);
        if cells.is_empty() {
            let at = (panel.frame.x + 12.0, panel.frame.y + 20.0);
            svg.text(
                at,
                "no cells",
                Lettering {
                    colour: FAINT_INK,
                    ..lettering(12.0)
                },
            );
        }
    }
    svg.finish("reliability")
}
