//! One pair of axes: a frame with grid, ticks and labels, and values drawn inside it.

use crate::plot::ink::{FAINT_INK, GRID, INK};
use crate::plot::scale::{Scale, Tick};
use crate::plot::svg::{Anchor, Lettering, Rect, Stroke, Svg, lettering};

/// Font size of tick labels, pixels.
const TICK_SIZE: f64 = 11.0;
/// Font size of axis names, pixels.
const NAME_SIZE: f64 = 12.0;

/// What an ideal method would score.
pub const IDEAL: Stroke<'static> = Stroke {
    colour: INK,
    width: 1.2,
    dash: "6 4",
};

/// A pair of axes at a place in a picture.
#[derive(Clone, Copy, Debug)]
pub struct Panel {
    /// The inside of the frame.
    pub frame: Rect,
    /// Horizontal axis.
    pub x: Scale,
    /// Vertical axis.
    pub y: Scale,
}

impl Panel {
    /// Where a value lies in the picture.
    pub fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let Rect {
            x: left,
            y: top,
            width,
            height,
        } = self.frame;
        (
            left + width * self.x.fraction(x),
            top + height * (1.0 - self.y.fraction(y)),
        )
    }

    /// The title above the frame.
    pub fn title(&self, svg: &mut Svg, text: &str) {
        let at = (self.frame.x, self.frame.y - 12.0);
        svg.text(
            at,
            text,
            Lettering {
                bold: true,
                ..lettering(13.0)
            },
        );
    }

    /// Horizontal grid lines and, if `labelled`, their tick labels left of the frame.
    pub fn y_grid(&self, svg: &mut Svg, labelled: bool) {
        for Tick { value, label } in self.y.ticks(5) {
            let (_, y) = self.at(self.x.low(), value);
            let (left, right) = (self.frame.x, self.frame.x + self.frame.width);
            let width = if label.is_empty() { 0.4 } else { 1.0 };
            svg.polyline(&[(left, y), (right, y)], Stroke::solid(GRID, width));
            if labelled && !label.is_empty() {
                svg.text((left - 7.0, y), &label, tick_lettering(Anchor::End));
            }
        }
    }

    /// Vertical grid lines and their tick labels below the frame.
    pub fn x_grid(&self, svg: &mut Svg, wanted: usize) {
        for Tick { value, label } in self.x.ticks(wanted) {
            let (x, _) = self.at(value, self.y.low());
            let (top, bottom) = (self.frame.y, self.frame.y + self.frame.height);
            let width = if label.is_empty() { 0.4 } else { 1.0 };
            svg.polyline(&[(x, top), (x, bottom)], Stroke::solid(GRID, width));
            if !label.is_empty() {
                svg.text((x, bottom + 12.0), &label, tick_lettering(Anchor::Middle));
            }
        }
    }

    /// The line around the frame: left and bottom only.
    pub fn axes(&self, svg: &mut Svg) {
        let Rect {
            x,
            y,
            width,
            height,
        } = self.frame;
        let corner = [(x, y), (x, y + height), (x + width, y + height)];
        svg.polyline(&corner, Stroke::solid(FAINT_INK, 1.0));
    }

    /// Name of the vertical axis, `offset` pixels left of the frame, reading upwards.
    pub fn y_name(&self, svg: &mut Svg, text: &str, offset: f64) {
        let at = (
            self.frame.x - offset,
            self.frame.y + 0.5 * self.frame.height,
        );
        svg.text(
            at,
            text,
            Lettering {
                upright: true,
                anchor: Anchor::Middle,
                colour: FAINT_INK,
                ..lettering(NAME_SIZE)
            },
        );
    }

    /// Name of the horizontal axis, below its tick labels.
    pub fn x_name(&self, svg: &mut Svg, text: &str) {
        let Rect {
            x,
            y,
            width,
            height,
        } = self.frame;
        svg.text(
            (x + 0.5 * width, y + height + 29.0),
            text,
            Lettering {
                anchor: Anchor::Middle,
                colour: FAINT_INK,
                ..lettering(NAME_SIZE)
            },
        );
    }

    /// A line through `(x, y)` values; cut at the frame.
    pub fn line(&self, svg: &mut Svg, values: &[(f64, f64)], stroke: Stroke<'_>) {
        let points: Vec<_> = values.iter().map(|(x, y)| self.at(*x, *y)).collect();
        svg.clipped(self.frame, |svg| svg.polyline(&points, stroke));
    }

    /// The area between the lower and the upper of `(x, lower, upper)`; cut at the frame.
    pub fn band(&self, svg: &mut Svg, values: &[(f64, f64, f64)], colour: &str) {
        let finite = |&&(x, low, high): &&(f64, f64, f64)| {
            x.is_finite() && low.is_finite() && high.is_finite()
        };
        let values: Vec<_> = values.iter().filter(finite).collect();
        let upper = values.iter().map(|(x, _, high)| self.at(*x, *high));
        let lower = values.iter().rev().map(|(x, low, _)| self.at(*x, *low));
        let outline: Vec<_> = upper.chain(lower).collect();
        if outline.len() > 3 {
            svg.clipped(self.frame, |svg| svg.polygon(&outline, colour, 0.2));
        }
    }

    /// A vertical stripe from `low` to `high` over the whole height.
    pub fn stripe(&self, svg: &mut Svg, low: f64, high: f64, colour: &str) {
        let (left, _) = self.at(low, self.y.low());
        let (right, _) = self.at(high, self.y.low());
        let stripe = Rect {
            x: left,
            width: right - left,
            ..self.frame
        };
        svg.clipped(self.frame, |svg| svg.rect(stripe, colour, 1.0));
    }

    /// A dashed line across the frame at `value`, for what an ideal method would score.
    pub fn ideal(&self, svg: &mut Svg, value: f64) {
        let ends = [self.at(self.x.low(), value), self.at(self.x.high(), value)];
        svg.polyline(&ends, IDEAL);
    }

    /// The same down the frame, for a horizontal axis.
    pub fn x_ideal(&self, svg: &mut Svg, value: f64) {
        let ends = [self.at(value, self.y.low()), self.at(value, self.y.high())];
        svg.polyline(&ends, IDEAL);
    }
}

fn tick_lettering(anchor: Anchor) -> Lettering {
    Lettering {
        anchor,
        colour: FAINT_INK,
        ..lettering(TICK_SIZE)
    }
}
