//! Colour and marker of every method: distinct for colour-blind readers (Okabe and Ito's palette)
//! and, by the marker, in grey print.

use crate::method::Method;
use crate::own_name::OwnName;
use crate::plot::svg::{Stroke, Svg};

/// How a method looks in every figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// CSS colour.
    pub colour: &'static str,
    /// Marker.
    pub marker: Marker,
}

/// Shape of a marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// Disc.
    Circle,
    /// Upright square.
    Square,
    /// Square on its corner.
    Diamond,
    /// Point up.
    TriangleUp,
    /// Point down.
    TriangleDown,
    /// Upright cross.
    Plus,
    /// Cross on its side.
    Cross,
}

/// The look of `method`.
pub const fn look(method: Method) -> Look {
    let (colour, marker) = match method {
        Method::Ekf => ("#0072b2", Marker::Circle),
        Method::Ukf => ("#56b4e9", Marker::Square),
        Method::Bnn => ("#e69f00", Marker::TriangleDown),
        Method::Bnkf => ("#d55e00", Marker::Diamond),
        Method::Bnkfe => ("#cc79a7", Marker::TriangleUp),
        Method::BnkfMoments => ("#f28e5c", Marker::Diamond),
        Method::BnkfeMoments => ("#e3b4cd", Marker::TriangleUp),
        Method::RecursiveMoments => ("#3a3a5c", Marker::Diamond),
        Method::Recursive => ("#111111", Marker::Circle),
        Method::RecursiveTuned => ("#b00020", Marker::Square),
        Method::EkfTuned => ("#009e73", Marker::Circle),
        Method::UkfTuned => ("#5fbf9f", Marker::Square),
        Method::CkfTuned => ("#00604a", Marker::Diamond),
        Method::Imm5 => ("#7b3294", Marker::TriangleDown),
        Method::Imm10 => ("#a98bd0", Marker::TriangleUp),
        Method::Particle => ("#8a7a00", Marker::Diamond),
        // The trivial rules are grey: they are the ground that the others stand on.
        Method::Converted => ("#4d4d4d", Marker::Plus),
        Method::PopulationMean => ("#8c8c8c", Marker::Cross),
        Method::ConstantRange => ("#6e6e6e", Marker::Square),
        Method::Fused => ("#a8a8a8", Marker::Circle),
        Method::Own(name) => return own_look(name),
    };
    Look { colour, marker }
}

/// One of a few looks that no built-in method has; names stand beside them.
const fn own_look(name: OwnName) -> Look {
    const LOOKS: [Look; 4] = [
        Look {
            colour: "#e0007a",
            marker: Marker::Plus,
        },
        Look {
            colour: "#00a0c6",
            marker: Marker::Cross,
        },
        Look {
            colour: "#c75000",
            marker: Marker::TriangleUp,
        },
        Look {
            colour: "#3355ff",
            marker: Marker::Diamond,
        },
    ];
    let (text, mut sum, mut at) = (name.get().as_bytes(), 0, 0);
    while at < text.len() {
        sum += text[at] as usize;
        at += 1;
    }
    LOOKS[sum % LOOKS.len()]
}

impl Marker {
    /// Draws the marker with a white rim at `(x, y)`; all shapes cover about the same area.
    pub fn draw(self, svg: &mut Svg, (x, y): (f64, f64), radius: f64, colour: &str) {
        let outline: &[(f64, f64)] = match self {
            Self::Circle => {
                svg.circle((x, y), radius + 1.0, "#ffffff");
                svg.circle((x, y), radius, colour);
                return;
            }
            Self::Plus => {
                for (dx, dy) in [(1.2, 0.0), (0.0, 1.2)] {
                    let ends = [
                        (x - radius * dx, y - radius * dy),
                        (x + radius * dx, y + radius * dy),
                    ];
                    svg.polyline(&ends, Stroke::solid(colour, 2.0));
                }
                return;
            }
            Self::Cross => {
                for turn in [-1.0, 1.0] {
                    let ends = [
                        (x - radius, y - turn * radius),
                        (x + radius, y + turn * radius),
                    ];
                    svg.polyline(&ends, Stroke::solid(colour, 2.0));
                }
                return;
            }
            Self::Square => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
            Self::Diamond => &[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)],
            Self::TriangleUp => &[(0.0, -1.25), (1.15, 0.85), (-1.15, 0.85)],
            Self::TriangleDown => &[(0.0, 1.25), (1.15, -0.85), (-1.15, -0.85)],
        };
        let mut corners: Vec<_> = outline
            .iter()
            .map(|(dx, dy)| (x + radius * dx, y + radius * dy))
            .collect();
        svg.polygon(&corners, colour, 1.0);
        corners.push(corners[0]);
        svg.polyline(&corners, Stroke::solid("#ffffff", 1.0));
    }
}

#[cfg(test)]
mod tests {
    use clap::ValueEnum;

    use super::look;
    use crate::method::Method;

    #[test]
    fn no_two_methods_look_alike() {
        let methods = Method::value_variants();
        for (index, one) in methods.iter().enumerate() {
            for other in &methods[index + 1..] {
                assert_ne!(look(*one).colour, look(*other).colour);
            }
        }
        for (index, one) in Method::PAPER.into_iter().enumerate() {
            for other in Method::PAPER.into_iter().skip(index + 1) {
                assert_ne!(look(one).marker, look(other).marker);
            }
        }
    }
}
