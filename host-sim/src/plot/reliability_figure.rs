//! Reliability: how often the truth lies inside ellipsoids that claim a probability.

use crate::campaign::cell_summary::CellSummary;
use crate::plot::ink::FAINT_INK;
use crate::plot::legend::{self, Mark};
use crate::plot::palette::look;
use crate::plot::panel::{IDEAL, Panel};
use crate::plot::scale::Scale;
use crate::plot::svg::{Lettering, Rect, Svg, lettering};
use crate::scoring::consistency::NOMINAL;

const LEFT: f64 = 70.0;
const SIDE: f64 = 310.0;
const GAP: f64 = 56.0;
const NEAR_HEIGHT: f64 = 240.0;
const ROW_GAP: f64 = 84.0;
/// How far from what they claim the lower panels show methods.
const NEAR: f64 = 0.1;
/// Every so many points of a line have a marker.
const STAGGER: usize = 3;

/// The figure over `groups`, a title and the cells of each: above every method, below how far those lie
/// from the diagonal that are near it.
pub fn draw(groups: &[(String, Vec<&CellSummary>)]) -> String {
    let columns = groups.len().max(1) as f64;
    let width = LEFT + columns * (SIDE + GAP) - GAP + 24.0;
    let cells = groups.first().map_or(&[][..], |(_, cells)| cells);
    let mut entries: Vec<_> = cells
        .iter()
        .map(|cell| (Mark::Method(look(cell.method)), cell.method.label()))
        .collect();
    entries.push((Mark::Line(IDEAL), "ideal"));
    let (lines, legend_height) = legend::lines(&entries, width - LEFT - 24.0);
    let header = 104.0 + legend_height;
    let mut svg = Svg::new(
        width,
        header + SIDE + ROW_GAP + NEAR_HEIGHT + 52.0,
        "Reliability diagram of every method",
        "A panel per noise level: the part of the truths inside an ellipsoid over the probability that it claims, a \
         line per method; below, the difference of the two for methods near the diagonal.",
    );
    let title = "Reliability: below the ideal line a covariance is too small";
    svg.heading((LEFT, 26.0), title);
    legend::draw_lines(&mut svg, (LEFT, 56.0), &lines);
    for (index, (title, cells)) in groups.iter().enumerate() {
        let frame = Rect {
            x: LEFT + index as f64 * (SIDE + GAP),
            y: header,
            width: SIDE,
            height: SIDE,
        };
        let whole = Panel {
            frame,
            x: Scale::linear(0.0, 1.0),
            y: Scale::linear(0.0, 1.0),
        };
        let near = Panel {
            frame: Rect {
                y: header + SIDE + ROW_GAP,
                height: NEAR_HEIGHT,
                ..frame
            },
            y: Scale::linear(-NEAR, NEAR),
            ..whole
        };
        for (panel, name, tilt) in [
            (whole, "truths inside", 0.0),
            (near, "inside minus claimed", 1.0),
        ] {
            panel.y_grid(&mut svg, true);
            panel.x_grid(&mut svg, 5);
            panel.x_name(&mut svg, "claimed probability");
            if index == 0 {
                panel.y_name(&mut svg, name, 48.0);
            }
            panel.line(&mut svg, &[(0.0, 0.0), (1.0, 1.0 - tilt)], IDEAL);
            for (number, cell) in cells.iter().enumerate() {
                if tilt == 0.0 || is_near(cell) {
                    draw_cell(&mut svg, &panel, cell, tilt, number);
                }
            }
            panel.axes(&mut svg);
        }
        whole.title(&mut svg, title);
        near.title(&mut svg, &format!("{title}: near the ideal"));
        if cells.is_empty() {
            let at = (frame.x + 12.0, frame.y + 20.0);
            let faint = Lettering {
                colour: FAINT_INK,
                ..lettering(12.0)
            };
            svg.text(at, "no cells", faint);
        }
    }
    svg.finish()
}

/// Whether a method is drawn near the ideal: the whole of its line is there.
fn is_near(cell: &CellSummary) -> bool {
    let mut pairs = NOMINAL.into_iter().zip(cell.reliability);
    pairs.all(|(claimed, inside)| (inside - claimed).abs() <= NEAR)
}

/// The line of the method with this number, less `tilt` times what it claims; markers where they lie inside the
/// panel, those of one method not above those of the next.
fn draw_cell(svg: &mut Svg, panel: &Panel, cell: &CellSummary, tilt: f64, number: usize) {
    let look = look(cell.method);
    let line: Vec<_> = NOMINAL
        .into_iter()
        .zip(cell.reliability)
        .map(|(claimed, inside)| (claimed, inside - tilt * claimed))
        .collect();
    svg.titled(cell.method.label(), |svg| {
        panel.line(svg, &line, look.stroke(1.4));
        for (x, y) in line.iter().skip(1 + number % STAGGER).step_by(STAGGER) {
            if (0.0..=1.0).contains(&panel.y.fraction(*y)) {
                look.marker.draw(svg, panel.at(*x, *y), 3.4, look.colour);
            }
        }
    });
}
