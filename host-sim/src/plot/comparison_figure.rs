//! Every method beside one reference on the same steps: the paired difference and its interval.

use crate::campaign::comparison::Comparison;
use crate::method::Method;
use crate::plot::ink::{FAINT_INK, GRID, INK};
use crate::plot::palette::look;
use crate::plot::panel::Panel;
use crate::plot::scale::Scale;
use crate::plot::svg::{Anchor, Lettering, Rect, Stroke, Svg, lettering};

const LEFT: f64 = 120.0;
const PANEL_WIDTH: f64 = 300.0;
const GAP: f64 = 40.0;
const ROW: f64 = 24.0;
const HEADER: f64 = 100.0;
/// Ends of the axis, part of the reference's error: beyond, an arrow says where a method lies.
const REACH: f64 = 1.0;

/// One panel: a title, the reference's mean ED (m), and its comparisons, `b` being the reference.
#[derive(Clone, Debug)]
pub struct Group {
    /// What stands above the panel.
    pub title: String,
    /// Mean ED of the reference, metres.
    pub reference_ed_m: f64,
    /// Method, difference and interval ends, metres.
    pub rows: Vec<(Method, f64, f64, f64)>,
}

impl Group {
    /// The comparisons of `reference` among `comparisons`, turned so that it comes second.
    pub fn new(
        title: String,
        reference: Method,
        reference_ed_m: f64,
        comparisons: &[&Comparison],
    ) -> Self {
        let row = |comparison: &&&Comparison| {
            let Comparison { a, b, ed_m, .. } = ***comparison;
            let (d, low, high) = (ed_m.difference, ed_m.interval.low, ed_m.interval.high);
            if b == reference {
                (a, d, low, high)
            } else {
                (b, -d, -high, -low)
            }
        };
        let own = comparisons
            .iter()
            .filter(|comparison| comparison.a == reference || comparison.b == reference);
        Self {
            title,
            reference_ed_m,
            rows: own.collect::<Vec<_>>().iter().map(row).collect(),
        }
    }
}

/// The figure over `groups`, all against `reference`.
pub fn draw(reference: Method, groups: &[Group]) -> String {
    let rows = groups
        .iter()
        .map(|group| group.rows.len())
        .max()
        .unwrap_or(0) as f64;
    let width = LEFT + groups.len().max(1) as f64 * (PANEL_WIDTH + GAP) - GAP + 30.0;
    let mut svg = Svg::new(
        width,
        HEADER + rows * ROW + 56.0,
        "Paired differences from the reference",
        "A row per method, a panel per noise level: the difference of its mean distance from the reference's, in per cent of that, with a 95% interval.",
    );
    let title = format!("Mean error beside {reference}, on the same steps");
    svg.heading((LEFT, 26.0), &title);
    let note = "Left of zero: better. Bars: 95% intervals by bootstrap. Arrows: beyond the axis.";
    svg.note((LEFT, 50.0), note);
    for (index, group) in groups.iter().enumerate() {
        let panel = Panel {
            frame: Rect {
                x: LEFT + index as f64 * (PANEL_WIDTH + GAP),
                y: HEADER,
                width: PANEL_WIDTH,
                height: rows * ROW,
            },
            x: Scale::linear(-REACH, REACH),
            y: Scale::linear(0.0, rows.max(1.0)),
        };
        draw_group(&mut svg, &panel, group, index == 0, rows);
    }
    svg.finish()
}

fn draw_group(svg: &mut Svg, panel: &Panel, group: &Group, named: bool, rows: f64) {
    panel.title(svg, &group.title);
    for part in [-1.0, -0.5, 0.0, 0.5, 1.0] {
        let ends = [panel.at(part, 0.0), panel.at(part, rows)];
        let zero = part == 0.0;
        // The ends' names would run into those of the next panel.
        let named = part.abs() < REACH;
        svg.polyline(&ends, Stroke::solid(if zero { INK } else { GRID }, 1.0));
        let (x, y) = ends[0];
        let text = format!("{:+.0}%", 100.0 * part);
        let text = match (named, zero) {
            (false, _) => continue,
            (true, true) => "0",
            (true, false) => &text,
        };
        svg.text(
            (x, y + 13.0),
            text,
            Lettering {
                anchor: Anchor::Middle,
                colour: FAINT_INK,
                ..lettering(11.0)
            },
        );
    }
    panel.x_name(svg, "difference of the mean ED");
    for (index, (method, difference, low, high)) in group.rows.iter().enumerate() {
        let row = rows - index as f64 - 0.5;
        let look = look(*method);
        if named {
            let at = panel.at(-REACH, row);
            svg.text(
                (at.0 - 10.0, at.1),
                method.label(),
                Lettering {
                    anchor: Anchor::End,
                    ..lettering(12.0)
                },
            );
        }
        let part = |metres: f64| metres / group.reference_ed_m;
        let text = format!("{method}: {difference:+.4} m, 95% interval {low:+.4} to {high:+.4} m");
        svg.titled(&text, |svg| {
            let ends = [part(*low), part(*high)].map(|x| panel.at(x.clamp(-REACH, REACH), row));
            // Both ends beyond the axis: the arrow says all.
            if ends[0] != ends[1] {
                svg.polyline(&ends, Stroke::solid(look.colour, 3.0));
            }
            let middle = part(*difference);
            if middle.abs() <= REACH {
                look.marker
                    .draw(svg, panel.at(middle, row), 4.6, look.colour);
            } else if middle.is_finite() {
                draw_arrow(
                    svg,
                    panel.at(REACH.copysign(middle), row),
                    middle,
                    look.colour,
                );
            }
        });
    }
}

/// An arrow head at the edge, and how far beyond it the value lies.
fn draw_arrow(svg: &mut Svg, (x, y): (f64, f64), part: f64, colour: &str) {
    let side = part.signum();
    let tip = [(x, y), (x - side * 9.0, y - 5.0), (x - side * 9.0, y + 5.0)];
    svg.polygon(&tip, colour, 1.0);
    let anchor = if side > 0.0 {
        Anchor::End
    } else {
        Anchor::Start
    };
    let text = format!("{:+.0}%", 100.0 * part);
    svg.text(
        (x - side * 14.0, y),
        &text,
        Lettering {
            anchor,
            colour: FAINT_INK,
            ..lettering(11.0)
        },
    );
}
