//! The error of methods in worlds that differ from the one that they were fitted to.

use crate::campaign::generalisation::VariedCell;
use crate::method::Method;
use crate::plot::ink::STRIPE;
use crate::plot::legend::{self, Mark};
use crate::plot::palette::look;
use crate::plot::panel::Panel;
use crate::plot::scale::Scale;
use crate::plot::svg::{Anchor, Lettering, Rect, Svg, lettering};

const WIDTH: f64 = 1120.0;
const LEFT: f64 = 78.0;
const RIGHT: f64 = 80.0;
const PANEL_HEIGHT: f64 = 200.0;
const PANEL_GAP: f64 = 46.0;
const SPREAD: f64 = 0.7;

/// A panel: title, axis name, the value that is ideal, and the values by (world, method).
#[derive(Clone, Debug)]
pub struct Row<'a> {
    /// What stands above the panel.
    pub title: String,
    /// Name of the axis.
    pub axis: &'static str,
    /// Ideal value.
    pub ideal: Option<f64>,
    /// What is drawn of a cell.
    pub value: fn(&VariedCell) -> f64,
    /// The cells.
    pub cells: Vec<&'a VariedCell>,
}

/// The figure over `rows`, whose worlds stand in the order of the first row's cells.
pub fn draw(rows: &[Row<'_>], methods: &[Method]) -> String {
    let mut worlds: Vec<&str> = Vec::new();
    for cell in rows.first().map_or(&[][..], |row| &row.cells) {
        if !worlds.contains(&cell.variation.as_str()) {
            worlds.push(&cell.variation);
        }
    }
    let entries: Vec<_> = methods
        .iter()
        .map(|m| (Mark::Method(look(*m)), m.label()))
        .collect();
    let (lines, legend_height) = legend::lines(&entries, WIDTH - LEFT - RIGHT);
    let header = 108.0 + legend_height;
    let height = header + rows.len() as f64 * (PANEL_HEIGHT + PANEL_GAP) - PANEL_GAP + 84.0;
    let mut svg = Svg::new(
        WIDTH,
        height,
        "Methods in worlds that they were not fitted to",
        "Two panels, mean distance and NEES; a slot per world, a marker per method.",
    );
    let title = "Worlds that differ from the one that methods were fitted to";
    svg.heading((LEFT, 26.0), title);
    legend::draw_lines(&mut svg, (LEFT, 58.0), &lines);
    for (number, row) in rows.iter().enumerate() {
        let shown = row
            .cells
            .iter()
            .filter(|cell| methods.contains(&cell.method));
        let values = shown.map(|cell| (row.value)(cell)).chain(row.ideal);
        let panel = Panel {
            frame: Rect {
                x: LEFT,
                y: header + number as f64 * (PANEL_HEIGHT + PANEL_GAP),
                width: WIDTH - LEFT - RIGHT,
                height: PANEL_HEIGHT,
            },
            x: Scale::linear(0.0, worlds.len().max(1) as f64),
            y: Scale::logarithmic_over(values),
        };
        for index in (1..worlds.len()).step_by(2) {
            panel.stripe(&mut svg, index as f64, index as f64 + 1.0, STRIPE);
        }
        panel.y_grid(&mut svg, true);
        panel.title(&mut svg, &row.title);
        panel.y_name(&mut svg, row.axis, 54.0);
        if let Some(ideal) = row.ideal {
            panel.ideal(&mut svg, ideal);
            let (x, y) = panel.at(panel.x.high(), ideal);
            svg.text((x + 8.0, y), &format!("ideal: {ideal}"), lettering(12.0));
        }
        draw_row(&mut svg, &panel, row, &worlds, methods);
        panel.axes(&mut svg);
        if number + 1 == rows.len() {
            for (index, world) in worlds.iter().enumerate() {
                let (x, y) = panel.at(index as f64 + 0.5, panel.y.low());
                // Two lines: a world's name is wider than its slot.
                let (first, second) = world.split_once(' ').unwrap_or((world, ""));
                let middle = Lettering {
                    anchor: Anchor::Middle,
                    ..lettering(11.5)
                };
                svg.text((x, y + 15.0), first, middle);
                svg.text((x, y + 30.0), second, middle);
            }
        }
    }
    svg.finish()
}

fn draw_row(svg: &mut Svg, panel: &Panel, row: &Row<'_>, worlds: &[&str], methods: &[Method]) {
    for (place, method) in methods.iter().enumerate() {
        let look = look(*method);
        let shift = SPREAD * ((place as f64 + 0.5) / methods.len() as f64 - 0.5);
        for (index, world) in worlds.iter().enumerate() {
            let cell = row
                .cells
                .iter()
                .find(|cell| cell.method == *method && cell.variation == *world);
            let value = cell.map_or(f64::NAN, |cell| (row.value)(cell));
            // No lines: worlds have no order.
            let at = panel.at(index as f64 + 0.5 + shift, value);
            if value.is_finite() {
                svg.titled(&format!("{method}: {value:.4}"), |svg| {
                    look.marker.draw(svg, at, 4.2, look.colour)
                });
            }
        }
    }
}
