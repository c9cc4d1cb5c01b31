//! A row per method and two panels side by side: all methods on a broad axis, and what lies near the
//! best on a narrow one. Nothing hides behind anything, and names stand where the values are.

use crate::method::Method;
use crate::plot::ink::{INK, STRIPE};
use crate::plot::palette::look;
use crate::plot::panel::Panel;
use crate::plot::scale::Scale;
use crate::plot::svg::{Anchor, Lettering, Rect, Stroke, Svg, lettering};

/// Left of the first panel: names.
pub const LEFT: f64 = 118.0;
const BROAD: f64 = 150.0;
const NARROW: f64 = 136.0;
const PANEL_GAP: f64 = 24.0;
const GROUP_GAP: f64 = 36.0;
const RIGHT: f64 = 16.0;
const ABOVE: f64 = 62.0;
const BELOW: f64 = 46.0;
/// Distance of the places in a row, and what is left between rows.
const PLACE: f64 = 6.0;
const ROW_GAP: f64 = 9.0;
const RADIUS: f64 = 3.6;

/// The values of one group, say of one noise level: for every method one at each place.
#[derive(Clone, Debug)]
pub struct Group {
    /// What stands above its panels.
    pub title: String,
    /// The methods in their order; NaN where there is no value.
    pub rows: Vec<(Method, Vec<f64>)>,
    /// A bound at each place; may be empty.
    pub bound: Vec<f64>,
}

/// What is shown of all groups, and how.
#[derive(Clone, Copy, Debug)]
pub struct Measure {
    /// What stands above the block.
    pub title: &'static str,
    /// Name of the broad axis.
    pub axis: &'static str,
    /// What the narrow axis shows.
    pub near: Near,
    /// Value that is ideal.
    pub ideal: Option<f64>,
}

/// The narrow axis.
#[derive(Clone, Copy, Debug)]
pub enum Near {
    /// Per cent above the smallest value at the same place, up to so many; the broad axis is logarithmic.
    AboveBest(f64),
    /// The values themselves from here to there; the broad axis is logarithmic.
    Magnified(f64, f64),
    /// The same; the broad axis goes from 0 to 1.
    MagnifiedPart(f64, f64),
}

/// Width of a figure with so many groups.
pub fn width(groups: usize) -> f64 {
    let own = BROAD + PANEL_GAP + NARROW;
    LEFT + groups.max(1) as f64 * (own + GROUP_GAP) - GROUP_GAP + RIGHT
}

/// Height of a block.
pub fn height(groups: &[Group]) -> f64 {
    ABOVE + rows_height(groups) + BELOW
}

fn rows_height(groups: &[Group]) -> f64 {
    let rows = groups.first().map_or(0, |group| group.rows.len());
    let bound = groups.iter().any(|group| !group.bound.is_empty());
    (rows + usize::from(bound)) as f64 * row_height(groups)
}

fn row_height(groups: &[Group]) -> f64 {
    let places = groups.iter().flat_map(|group| &group.rows);
    let places = places.map(|(_, values)| values.len()).max().unwrap_or(1);
    places as f64 * PLACE + ROW_GAP
}

/// Draws the block with its upper edge at `top`.
pub fn draw(svg: &mut Svg, top: f64, measure: &Measure, groups: &[Group]) {
    let heavy = Lettering {
        bold: true,
        ..lettering(14.0)
    };
    svg.text((LEFT, top + 12.0), measure.title, heavy);
    let all = groups.iter().flat_map(|group| {
        let rows = group.rows.iter().flat_map(|(_, values)| values);
        rows.chain(&group.bound).copied()
    });
    let broad = match measure.near {
        Near::MagnifiedPart(..) => Scale::linear(0.0, 1.0),
        _ => Scale::logarithmic_over(all.chain(measure.ideal)),
    };
    let row = row_height(groups);
    for (number, group) in groups.iter().enumerate() {
        let x = LEFT + number as f64 * (BROAD + PANEL_GAP + NARROW + GROUP_GAP);
        let frame = Rect {
            x,
            y: top + ABOVE,
            width: BROAD,
            height: rows_height(groups),
        };
        let y = Scale::linear(0.0, rows_height(groups) / row);
        stripes(svg, frame, group, row);
        if number == 0 {
            names(svg, frame, group, row);
        }
        let whole = Panel { frame, x: broad, y };
        whole.title(svg, &group.title);
        panel(svg, &whole, measure.axis, 3, measure.ideal, group);
        let (name, ideal, scale, shown) = magnified(measure, group);
        let near = Panel {
            frame: Rect {
                x: x + BROAD + PANEL_GAP,
                width: NARROW,
                ..frame
            },
            x: scale,
            y,
        };
        panel(svg, &near, &name, 4, ideal, &shown);
    }
}

/// Name, ideal, scale and values of the narrow axis.
fn magnified(measure: &Measure, group: &Group) -> (String, Option<f64>, Scale, Group) {
    match measure.near {
        Near::Magnified(low, high) | Near::MagnifiedPart(low, high) => {
            let name = format!("{}, magnified", measure.axis);
            (name, measure.ideal, Scale::linear(low, high), group.clone())
        }
        Near::AboveBest(most) => {
            let best = |place: usize| {
                let rows = group.rows.iter();
                let values = rows.filter_map(|(_, values)| values.get(place).copied());
                values
                    .filter(|v| v.is_finite())
                    .fold(f64::INFINITY, f64::min)
            };
            let above = |values: &[f64]| -> Vec<f64> {
                let values = values.iter().enumerate();
                values
                    .map(|(place, value)| 100.0 * (value / best(place) - 1.0))
                    .collect()
            };
            let rows = group.rows.iter();
            let shown = Group {
                title: String::new(),
                rows: rows.map(|(m, values)| (*m, above(values))).collect(),
                bound: above(&group.bound),
            };
            let scale = Scale::linear(-0.2 * most, most);
            ("% above the best".to_owned(), Some(0.0), scale, shown)
        }
    }
}

/// Every other row on a stripe, over both panels.
fn stripes(svg: &mut Svg, frame: Rect, group: &Group, row: f64) {
    for index in (1..group.rows.len()).step_by(2) {
        let stripe = Rect {
            y: frame.y + index as f64 * row,
            width: BROAD + PANEL_GAP + NARROW,
            height: row,
            ..frame
        };
        svg.rect(stripe, STRIPE, 1.0);
    }
}

fn names(svg: &mut Svg, frame: Rect, group: &Group, row: f64) {
    let labels = group.rows.iter().map(|(method, _)| method.label());
    let bound = (!group.bound.is_empty()).then_some("bound");
    for (index, label) in labels.chain(bound).enumerate() {
        let at = (frame.x - 10.0, frame.y + (index as f64 + 0.5) * row);
        let right = Lettering {
            anchor: Anchor::End,
            ..lettering(12.0)
        };
        svg.text(at, label, right);
    }
}

fn panel(
    svg: &mut Svg,
    panel: &Panel,
    name: &str,
    ticks: usize,
    ideal: Option<f64>,
    group: &Group,
) {
    panel.x_grid(svg, ticks);
    panel.x_name(svg, name);
    if let Some(ideal) = ideal {
        panel.x_ideal(svg, ideal);
    }
    let row = panel.frame.height / panel.y.high();
    let row_at = |index: usize| panel.frame.y + (index as f64 + 0.5) * row;
    for (index, (method, values)) in group.rows.iter().enumerate() {
        let look = look(*method);
        let places = places(panel, row_at(index), values);
        let line: Vec<_> = places.iter().map(|place| place.at).collect();
        svg.polyline(&line, Stroke::solid(look.colour, 0.8));
        for place in places.iter().filter(|place| place.value.is_finite()) {
            svg.titled(&format!("{method}: {:.4}", place.value), |svg| {
                if place.beyond == 0.0 {
                    look.marker.draw(svg, place.at, RADIUS, look.colour);
                } else {
                    arrow(svg, place.at, place.beyond, look.colour);
                }
            });
        }
    }
    for place in places(panel, row_at(group.rows.len()), &group.bound) {
        if place.value.is_finite() && place.beyond == 0.0 {
            let (x, y) = place.at;
            svg.titled(&format!("bound: {:.4}", place.value), |svg| {
                svg.polyline(&[(x, y - 2.6), (x, y + 2.6)], Stroke::solid(INK, 2.0));
            });
        }
    }
    panel.axes(svg);
}

struct Place {
    at: (f64, f64),
    value: f64,
    /// -1 and 1 where the value lies left and right of the axis: it is drawn on its edge, for what is
    /// hidden would look like absent.
    beyond: f64,
}

fn places(panel: &Panel, middle: f64, values: &[f64]) -> Vec<Place> {
    let first = middle - 0.5 * (values.len() as f64 - 1.0) * PLACE;
    let place = |(index, value): (usize, &f64)| {
        let fraction = panel.x.fraction(*value);
        let beyond = f64::from(fraction > 1.0) - f64::from(fraction < 0.0);
        Place {
            at: (
                panel.frame.x + panel.frame.width * fraction.clamp(0.0, 1.0),
                first + index as f64 * PLACE,
            ),
            value: *value,
            beyond,
        }
    };
    values.iter().enumerate().map(place).collect()
}

fn arrow(svg: &mut Svg, (x, y): (f64, f64), side: f64, colour: &str) {
    let tip = [
        (x + side * 3.0, y),
        (x - side * 4.0, y - 2.8),
        (x - side * 4.0, y + 2.8),
    ];
    svg.polygon(&tip, colour, 1.0);
}

/// The note that says how to read the rows; `places` from top to bottom.
pub fn note(places: &[String]) -> String {
    format!(
        "In every row from the top: {}. Arrows: beyond the axis.",
        places.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::{Group, Measure, Near, draw, height, width};
    use crate::method::Method;
    use crate::plot::svg::Svg;

    fn drawn(near: Near, values: [[f64; 2]; 2]) -> String {
        let [one, other] = values;
        let groups = [Group {
            title: "low noise".to_owned(),
            rows: vec![
                (Method::Ekf, one.to_vec()),
                (Method::Recursive, other.to_vec()),
            ],
            bound: Vec::new(),
        }];
        let measure = Measure {
            title: "t",
            axis: "ED, m",
            near,
            ideal: None,
        };
        let mut svg = Svg::new(width(1), height(&groups), "", "");
        draw(&mut svg, 0.0, &measure, &groups);
        svg.finish()
    }

    #[test]
    fn the_narrow_axis_starts_at_the_best_of_each_place() {
        let text = drawn(Near::AboveBest(50.0), [[1.2, 9.0], [1.0, 10.0]]);
        assert!(text.contains("<title>EKF: 20.0000</title>"), "{text}");
        assert!(text.contains("<title>EKF: 0.0000</title>"));
        assert!(text.contains("<title>recursive: 11.1111</title>"));
        assert_eq!(text.matches("<polygon").count(), 0);
    }

    #[test]
    fn what_lies_beyond_is_an_arrow_and_what_is_missing_nothing() {
        let text = drawn(Near::Magnified(1.0, 5.0), [[9.0, f64::NAN], [3.0, 0.1]]);
        assert_eq!(text.matches("<polygon").count(), 2);
        // Three values, each in both panels.
        assert_eq!(text.matches("<g><title>").count(), 6);
        assert!(!text.contains("NaN"));
    }
}
