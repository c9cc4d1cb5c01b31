//! Names with the marks they stand for, in lines above the data they explain.

use crate::plot::marker::Marker;
use crate::plot::palette::Look;
use crate::plot::svg::{Rect, Stroke, Svg, lettering};

/// What stands before a name.
#[derive(Clone, Copy, Debug)]
pub enum Mark {
    /// Line and marker of a method.
    Method(Look),
    /// A line.
    Line(Stroke<'static>),
    /// A marker without a line.
    Marker(Marker, &'static str),
    /// A small dot.
    Dot(&'static str),
    /// A filled patch with this opacity.
    Patch(&'static str, f64),
}

/// An entry: mark and name.
pub type Entry<'a> = (Mark, &'a str);

const SIZE: f64 = 12.5;
const MARK_WIDTH: f64 = 26.0;
const SPACE: f64 = 22.0;
const LINE_HEIGHT: f64 = 22.0;

/// The entries broken into lines no wider than `width`, and the height that further lines than
/// the first add.
pub fn lines<'a>(entries: &[Entry<'a>], width: f64) -> (Vec<Vec<Entry<'a>>>, f64) {
    let mut lines = vec![Vec::new()];
    let mut used = 0.0;
    for entry in entries {
        let own = entry_width(entry.1);
        if used > 0.0 && used + own - SPACE > width {
            lines.push(Vec::new());
            used = 0.0;
        }
        used += own;
        lines
            .last_mut()
            .expect("there is a first line")
            .push(*entry);
    }
    let extra = (lines.len() - 1) as f64 * LINE_HEIGHT;
    (lines, extra)
}

/// Draws broken lines from `(x, y)` down.
pub fn draw_lines(svg: &mut Svg, (x, y): (f64, f64), lines: &[Vec<Entry<'_>>]) {
    for (index, line) in lines.iter().enumerate() {
        draw(svg, (x, y + index as f64 * LINE_HEIGHT), line);
    }
}

/// Draws the entries from left to right, starting at `(x, y)`.
pub fn draw(svg: &mut Svg, (mut x, y): (f64, f64), entries: &[Entry<'_>]) {
    for (mark, name) in entries {
        let line = [(x, y), (x + MARK_WIDTH, y)];
        let middle = (x + 0.5 * MARK_WIDTH, y);
        match mark {
            Mark::Method(look) => {
                svg.polyline(&line, look.stroke(2.0));
                look.marker.draw(svg, middle, 4.5, look.colour);
            }
            Mark::Line(stroke) => svg.polyline(&line, *stroke),
            Mark::Marker(marker, colour) => marker.draw(svg, middle, 4.5, colour),
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
        x += entry_width(name);
    }
}

/// Width of an entry, pixels, a little generous: the reader's font is not known.
fn entry_width(name: &str) -> f64 {
    let text: f64 = name
        .chars()
        .map(|c| if c.is_uppercase() { 0.72 } else { 0.55 } * SIZE)
        .sum();
    MARK_WIDTH + 7.0 + text + SPACE
}

#[cfg(test)]
mod tests {
    use super::{Mark, lines};

    #[test]
    fn long_legends_break_and_lose_nothing() {
        let entries = vec![(Mark::Dot("#000"), "a name of some length"); 9];
        let (broken, extra) = lines(&entries, 500.0);
        assert!(broken.len() > 2);
        assert_eq!(broken.iter().map(Vec::len).sum::<usize>(), 9);
        assert_eq!(extra, 22.0 * (broken.len() - 1) as f64);
        assert_eq!(lines(&entries, 1e6).0.len(), 1);
        // One that is too wide stands alone.
        assert_eq!(lines(&entries, 1.0).0.len(), 9);
    }
}
