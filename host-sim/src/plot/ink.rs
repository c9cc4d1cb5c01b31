//! The colours of what is no method, and every colour's counterpart on dark paper.
//!
//! Figures are written in the colours of white paper. A reader whose system is dark gets a rule for
//! each colour in the figure's own style element, so one drawing serves both.

use std::fmt::Write as _;

use clap::ValueEnum;

use crate::method::Method;
use crate::plot::palette::{OWN_LOOKS, look};

/// What figures are drawn on; also the rim of markers.
pub const PAPER: &str = "#ffffff";
/// Text and the lines of ideals.
pub const INK: &str = "#1a1a1a";
/// Axes and secondary text.
pub const FAINT_INK: &str = "#5f6368";
/// Grid lines.
pub const GRID: &str = "#e3e5e8";
/// Every other group of a panel.
pub const STRIPE: &str = "#f4f6f8";
/// Stretches without readings.
pub const GAP: &str = "#eceff2";
/// The truth below methods' lines, of which one is black.
pub const TRUTH: &str = "#c3c8ce";
/// Readings.
pub const READING: &str = "#9aa0a6";
/// What wants to be seen: one line, a start.
pub const ACCENT: &str = "#0072b2";
/// What is suspicious.
pub const ALARM: &str = "#d55e00";

/// Dark paper.
const NIGHT_PAPER: &str = "#14171a";
/// What does not just become lighter.
const NIGHT: [(&str, &str); 9] = [
    (PAPER, NIGHT_PAPER),
    (INK, "#e8eaed"),
    (FAINT_INK, "#a5abb3"),
    (GRID, "#2f353b"),
    (STRIPE, "#1c2024"),
    (GAP, "#272d33"),
    (TRUTH, "#565e67"),
    (READING, "#8b929a"),
    // The method that is black.
    (look(Method::Recursive).colour, "#f2f3f5"),
];
/// Contrast that a mark has with dark paper at least; WCAG asks 3 of what is no text.
const CONTRAST_MIN: f64 = 4.5;

/// `colour`, `#rrggbb`, as dark paper needs it: the same hue, with so much white that it stands out.
pub fn at_night(colour: &str) -> String {
    if let Some((_, night)) = NIGHT.iter().find(|(day, _)| *day == colour) {
        return (*night).to_owned();
    }
    let own = channels(colour);
    let mixed =
        |white: u8| own.map(|channel| channel + (255.0 - channel) * f64::from(white) / 100.0);
    let paper = channels(NIGHT_PAPER);
    let enough = (0..=100)
        .map(mixed)
        .find(|mixed| contrast(*mixed, paper) >= CONTRAST_MIN);
    let [r, g, b] = enough
        .unwrap_or([255.0; 3])
        .map(|channel| channel.round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The style that turns a figure dark where the reader's system is.
pub fn night_style() -> String {
    let mut colours = vec![ACCENT, ALARM];
    colours.extend(NIGHT.iter().map(|(day, _)| *day));
    let methods = Method::value_variants().iter().map(|method| look(*method));
    colours.extend(methods.chain(OWN_LOOKS).map(|look| look.colour));
    colours.sort_unstable();
    colours.dedup();
    let mut style = "<style>@media screen and (prefers-color-scheme:dark){".to_owned();
    for day in colours {
        let night = at_night(day);
        if night != day {
            write!(
                style,
                "[fill=\"{day}\"]{{fill:{night}}}[stroke=\"{day}\"]{{stroke:{night}}}"
            )
            .expect("a String grows");
        }
    }
    style + "}</style>"
}

fn channels(colour: &str) -> [f64; 3] {
    let channel = |at: usize| {
        let digits = colour.get(at..at + 2).unwrap_or("00");
        u8::from_str_radix(digits, 16).map_or(0.0, f64::from)
    };
    [channel(1), channel(3), channel(5)]
}

/// Contrast of two colours as WCAG 2 has it, 1 to 21.
fn contrast(one: [f64; 3], other: [f64; 3]) -> f64 {
    let (a, b) = (luminance(one), luminance(other));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

fn luminance(colour: [f64; 3]) -> f64 {
    let linear = |channel: f64| {
        let part = channel / 255.0;
        if part <= 0.040_45 {
            part / 12.92
        } else {
            ((part + 0.055) / 1.055).powf(2.4)
        }
    };
    let [r, g, b] = colour.map(linear);
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::ValueEnum;

    use super::{
        ALARM, FAINT_INK, GAP, INK, NIGHT_PAPER, OWN_LOOKS, PAPER, STRIPE, at_night, channels,
        contrast, night_style,
    };
    use crate::method::Method;
    use crate::plot::palette::look;

    fn told(one: &str, other: &str) -> f64 {
        contrast(channels(one), channels(other))
    }

    #[test]
    fn contrast_is_that_of_the_standard() {
        assert!((told("#000000", "#ffffff") - 21.0).abs() < 1e-9);
        // WebAIM's checker: 4.54.
        assert!((told("#767676", "#ffffff") - 4.54).abs() < 0.01);
    }

    #[test]
    fn text_can_be_read_by_day_and_at_night() {
        for text in [INK, FAINT_INK] {
            for paper in [PAPER, STRIPE, GAP] {
                assert!(told(text, paper) >= 4.5, "{text} on {paper}");
                let (text, paper) = (at_night(text), at_night(paper));
                assert!(told(&text, &paper) >= 4.5, "{text} on {paper}");
            }
        }
    }

    /// WCAG asks 3 of what is no text; every other group has a shaded ground.
    #[test]
    fn methods_stand_out_by_day() {
        let built_in = Method::value_variants().iter().map(|method| look(*method));
        for look in built_in.chain(OWN_LOOKS) {
            assert!(told(look.colour, PAPER) >= 3.0, "{}", look.colour);
            assert!(told(look.colour, STRIPE) >= 2.7, "{}", look.colour);
        }
    }

    #[test]
    fn methods_stand_out_at_night_and_stay_apart() {
        let mut seen = BTreeSet::new();
        for method in Method::value_variants() {
            let night = at_night(look(*method).colour);
            assert!(told(&night, NIGHT_PAPER) >= 4.4, "{method}: {night}");
            assert!(seen.insert(night), "{method}");
        }
        // Light enough as it is.
        assert_eq!(at_night("#f0a070"), "#f0a070");
        assert!(night_style().contains(&format!("[fill=\"{INK}\"]{{fill:#e8eaed}}")));
        assert_eq!(at_night(ALARM).len(), 7);
    }
}
