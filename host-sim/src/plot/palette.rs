//! Colour, marker and dash of every method: distinct for colour-blind readers (after Okabe and
//! Ito's palette, dark enough for white paper) and, by marker and dash, in grey print.

use crate::method::Method;
use crate::own_name::OwnName;
use crate::plot::marker::{Marker, Shape};
use crate::plot::svg::Stroke;

/// How a method looks in every figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// CSS colour.
    pub colour: &'static str,
    /// Marker.
    pub marker: Marker,
    /// Lengths of dash and blank of its lines, pixels; empty for a solid line.
    pub dash: &'static str,
}

impl Look {
    /// Its line, `width` pixels wide.
    pub const fn stroke(self, width: f64) -> Stroke<'static> {
        Stroke {
            colour: self.colour,
            width,
            dash: self.dash,
        }
    }
}

/// The recursive trackers', and a rule's.
const SOLID: &str = "";
/// Filters that are not fitted, or banks of them; a rule's.
const DASHED: &str = "7 4";
/// Networks without a filter's memory; a rule's.
const DOTTED: &str = "1.5 4";
/// Filters fitted to flights; a rule's.
const DOT_DASHED: &str = "8 4 1.5 4";

/// The look of `method`.
pub const fn look(method: Method) -> Look {
    use Marker as M;
    let (colour, marker, dash) = match method {
        Method::Ekf => ("#0072b2", M::hollow(Shape::Circle), DASHED),
        Method::Ukf => ("#1f8fd0", M::hollow(Shape::Square), DASHED),
        Method::Bnn => ("#b87a00", M::hollow(Shape::Down), DOTTED),
        Method::Bnkf => ("#d55e00", M::hollow(Shape::Up), DOTTED),
        Method::Bnkfe => ("#bf5f93", M::hollow(Shape::Left), DOTTED),
        Method::BnkfMoments => ("#a34a00", M::hollow(Shape::Star), DOTTED),
        Method::BnkfeMoments => ("#8c3f6e", M::hollow(Shape::Bow), DOTTED),
        Method::RecursiveMoments => ("#3a3a5c", M::filled(Shape::Diamond), SOLID),
        Method::Recursive => ("#111111", M::filled(Shape::Circle), SOLID),
        Method::RecursiveTuned => ("#b00020", M::filled(Shape::Square), SOLID),
        Method::EkfTuned => ("#009e73", M::filled(Shape::Up), DOT_DASHED),
        Method::UkfTuned => ("#4f9d1f", M::filled(Shape::Down), DOT_DASHED),
        Method::CkfTuned => ("#00604a", M::filled(Shape::Left), DOT_DASHED),
        Method::Imm5 => ("#7b3294", M::hollow(Shape::Diamond), DASHED),
        Method::Imm10 => ("#9470c4", M::filled(Shape::Star), DASHED),
        Method::Particle => ("#8a7a00", M::filled(Shape::Bow), DOT_DASHED),
        // The trivial rules are nearly grey, each with a dash of its own: they are the ground that the others stand on.
        Method::Converted => ("#4d4d4d", M::filled(Shape::Plus), DASHED),
        Method::PopulationMean => ("#857a6a", M::filled(Shape::Cross), DOTTED),
        Method::ConstantRange => ("#5a6672", M::filled(Shape::Post), SOLID),
        Method::Fused => ("#949494", M::filled(Shape::Rays), DOT_DASHED),
        Method::Own(name) => return own_look(name),
    };
    Look {
        colour,
        marker,
        dash,
    }
}

/// Looks of methods from outside, in colours that no built-in method has; names stand beside them.
pub const OWN_LOOKS: [Look; 4] = [
    Look {
        colour: "#e0007a",
        marker: Marker::filled(Shape::Plus),
        dash: SOLID,
    },
    Look {
        colour: "#0091b5",
        marker: Marker::filled(Shape::Cross),
        dash: DOT_DASHED,
    },
    Look {
        colour: "#c75000",
        marker: Marker::filled(Shape::Rays),
        dash: DASHED,
    },
    Look {
        colour: "#3355ff",
        marker: Marker::filled(Shape::Post),
        dash: DOTTED,
    },
];

/// One of [`OWN_LOOKS`], always the same for a name.
const fn own_look(name: OwnName) -> Look {
    let (text, mut sum, mut at) = (name.get().as_bytes(), 0, 0);
    while at < text.len() {
        sum += text[at] as usize;
        at += 1;
    }
    OWN_LOOKS[sum % OWN_LOOKS.len()]
}

#[cfg(test)]
mod tests {
    use clap::ValueEnum;

    use super::look;
    use crate::method::Method;

    /// In colour, and in grey.
    #[test]
    fn no_two_methods_look_alike() {
        let methods = Method::value_variants();
        for (index, one) in methods.iter().enumerate() {
            for other in &methods[index + 1..] {
                assert_ne!(look(*one).colour, look(*other).colour);
                assert_ne!(look(*one).marker, look(*other).marker, "{one}, {other}");
            }
        }
    }
}
