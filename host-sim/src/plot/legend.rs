//! A line of names with the marks they stand for, above the data it explains.

use crate::plot::palette::Look;
use crate::plot::svg::{Rect, Stroke, Svg, lettering};

/// What stands before a name.
#[derive(Clone, Copy, Debug)]
pub enum Mark {
    /// Line and marker of a method.
    Method(Look),
    /// A line.
    Line(Stroke<'static>),
    /// A small dot.
    Dot(&'static str),
    /// A filled patch with this opacity.
    Patch(&'static str, f64),
}

const SIZE: f64 = 12.5;
const MARK_WIDTH: f64 = 26.0;

/// Draws the entries from left to right, starting at `(x, y)`.
pub fn draw(svg: &mut Svg, (mut x, y): (f64, f64), entries: &[(Mark, &str)]) {
    for (mark, name) in entries {
        let line = [(x, y), (x + MARK_WIDTH, y)];
        let middle = (x + 0.5 * MARK_WIDTH, y);
        match mark {
            Mark::Method(look) => {
                svg.polyline(&line, Stroke::solid(look.colour, 2.0));
                look.marker.draw(svg, middle, 4.5, look.colour);
            }
            Mark::Line(stroke) => svg.polyline(&line, *stroke),
            Mark::Dot(colour) => svg.circle(middle, 2.2, colour),
            Mark::Patch(colour, opacity) => {
                let patch = Rect {
                    x,
                    y: y - 6.0,
                    width: MARK_WIDTH,
                    height: 12.0,
                };
                svg.rect(patch, colour, *opacity);
            }
        }
        svg.text((x + MARK_WIDTH + 7.0, y), name, lettering(SIZE));
        x += MARK_WIDTH + 7.0 + text_width(name) + 22.0;
    }
}

/// Width of `text`, pixels, a little generous: the reader's font is not known.
fn text_width(text: &str) -> f64 {
    text.chars()
        .map(|c| if c.is_uppercase() { 0.72 } else { 0.55 } * SIZE)
        .sum()
}
