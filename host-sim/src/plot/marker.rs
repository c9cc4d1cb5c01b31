//! Shapes that tell methods apart where colours do not: in grey print and to colour-blind readers.

use crate::plot::ink::PAPER;
use crate::plot::svg::{Stroke, Svg};

/// A shape, and whether it is filled with its colour or with paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Marker {
    /// Its outline.
    pub shape: Shape,
    /// Filled with paper, its outline in the colour. Shapes of lines alone are not.
    pub hollow: bool,
}

/// Outline of a marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Disc.
    Circle,
    /// Upright square.
    Square,
    /// Square on its corner.
    Diamond,
    /// Triangle, point up.
    Up,
    /// Triangle, point down.
    Down,
    /// Triangle, point left.
    Left,
    /// Star of five points.
    Star,
    /// Two triangles that touch.
    Bow,
    /// Upright cross, of lines.
    Plus,
    /// Cross on its side, of lines.
    Cross,
    /// Six rays, of lines.
    Rays,
    /// Upright line.
    Post,
}

impl Marker {
    /// Filled with its colour.
    pub const fn filled(shape: Shape) -> Self {
        Self {
            shape,
            hollow: false,
        }
    }

    /// Filled with paper.
    pub const fn hollow(shape: Shape) -> Self {
        Self {
            shape,
            hollow: true,
        }
    }

    /// Draws the marker at `at`; all shapes cover about the same area. Filled ones have a rim of paper.
    pub fn draw(self, svg: &mut Svg, at: (f64, f64), radius: f64, colour: &str) {
        let (fill, stroke) = self.ink(colour);
        svg.path(&self.outline(radius), at, fill, stroke);
    }

    /// What fills it and what goes around it.
    pub const fn ink(self, colour: &str) -> (&str, Stroke<'_>) {
        match (self.is_of_lines(), self.hollow) {
            (true, _) => ("none", Stroke::solid(colour, 2.0)),
            (false, true) => (PAPER, Stroke::solid(colour, 1.6)),
            (false, false) => (colour, Stroke::solid(PAPER, 1.0)),
        }
    }

    /// Whether it has no inside.
    pub const fn is_of_lines(self) -> bool {
        matches!(
            self.shape,
            Shape::Plus | Shape::Cross | Shape::Rays | Shape::Post
        )
    }

    /// Its outline around the origin as the path of an SVG.
    pub fn outline(self, radius: f64) -> String {
        let closed = |corners: &[(f64, f64)]| line(corners, radius) + "Z";
        let rays = |ends: &[(f64, f64)]| -> String {
            let ray = |(x, y): &(f64, f64)| line(&[(-x, -y), (*x, *y)], radius);
            ends.iter().map(ray).collect()
        };
        match self.shape {
            Shape::Circle => {
                format!(
                    "M{r:.2},0A{r:.2},{r:.2} 0 1 0 -{r:.2},0A{r:.2},{r:.2} 0 1 0 {r:.2},0Z",
                    r = radius
                )
            }
            Shape::Square => closed(&[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)]),
            Shape::Diamond => closed(&[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)]),
            Shape::Up => closed(&[(0.0, -1.25), (1.15, 0.85), (-1.15, 0.85)]),
            Shape::Down => closed(&[(0.0, 1.25), (1.15, -0.85), (-1.15, -0.85)]),
            Shape::Left => closed(&[(-1.25, 0.0), (0.85, 1.15), (0.85, -1.15)]),
            Shape::Star => {
                let corner = |k: usize| {
                    let turn = std::f64::consts::PI * k as f64 / 5.0;
                    let reach = if k.is_multiple_of(2) { 1.4 } else { 0.62 };
                    (reach * turn.sin(), -reach * turn.cos())
                };
                closed(&core::array::from_fn::<_, 10, _>(corner))
            }
            Shape::Bow => closed(&[(-1.4, -1.2), (1.4, 1.2), (1.4, -1.2), (-1.4, 1.2)]),
            Shape::Plus => rays(&[(1.2, 0.0), (0.0, 1.2)]),
            Shape::Cross => rays(&[(1.0, 1.0), (1.0, -1.0)]),
            Shape::Rays => rays(&[(1.2, 0.0), (0.6, 1.04), (0.6, -1.04)]),
            Shape::Post => rays(&[(0.0, 1.25)]),
        }
    }
}

fn line(corners: &[(f64, f64)], radius: f64) -> String {
    let points: Vec<_> = corners
        .iter()
        .map(|(x, y)| format!("{:.2},{:.2}", radius * x, radius * y))
        .collect();
    format!("M{}", points.join("L"))
}

#[cfg(test)]
mod tests {
    use super::{Marker, Shape};
    use crate::plot::svg::Svg;

    #[test]
    fn shapes_are_closed_or_of_lines() {
        for shape in [Shape::Circle, Shape::Star, Shape::Bow, Shape::Left] {
            let outline = Marker::filled(shape).outline(4.0);
            assert!(
                outline.starts_with('M') && outline.ends_with('Z'),
                "{outline}"
            );
        }
        let rays = Marker::filled(Shape::Rays);
        assert!(rays.is_of_lines());
        assert_eq!(rays.outline(1.0).matches('M').count(), 3);
        assert_eq!(
            Marker::filled(Shape::Post).outline(2.0),
            "M-0.00,-2.50L0.00,2.50"
        );
    }

    #[test]
    fn hollow_markers_have_paper_inside() {
        let drawn = |marker: Marker| {
            let mut svg = Svg::new(10.0, 10.0, "", "");
            marker.draw(&mut svg, (5.0, 5.0), 3.0, "#123456");
            svg.finish()
        };
        let hollow = drawn(Marker::hollow(Shape::Square));
        assert!(
            hollow.contains("fill=\"#ffffff\" stroke=\"#123456\""),
            "{hollow}"
        );
        assert!(
            drawn(Marker::filled(Shape::Square)).contains("fill=\"#123456\" stroke=\"#ffffff\"")
        );
    }
}
