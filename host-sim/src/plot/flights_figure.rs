//! Example flights from above, and how the sampling rates leave gaps in one of them.

use bnkf_model_export::flights::flight::Flight;

use crate::plot::ink::{ACCENT, INK};
use crate::plot::panel::Panel;
use crate::plot::scale::Scale;
use crate::plot::svg::{Anchor, Rect, Stroke, Svg};

const LEFT: f64 = 58.0;
const SIDE: f64 = 190.0;
const GAP_X: f64 = 52.0;
const GAP_Y: f64 = 66.0;
const HEADER: f64 = 88.0;
const COLUMNS: usize = 5;

/// The figure over the first `2 * COLUMNS` of `flights`. All panels have the same scale.
pub fn draw(flights: &[&Flight]) -> String {
    let shown = &flights[..flights.len().min(2 * COLUMNS)];
    let rows = shown.len().div_ceil(COLUMNS).max(1) as f64;
    let width = LEFT + COLUMNS as f64 * (SIDE + GAP_X) - GAP_X + 24.0;
    let height = HEADER + rows * (SIDE + GAP_Y) - GAP_Y + 48.0;
    let mut svg = Svg::new(
        width,
        height,
        "Example flights from above",
        "A panel per flight, all on one scale: its path over the ground, a disc where it starts.",
    );
    let title = "Example flights, seen from above";
    svg.heading((LEFT, 26.0), title);
    let note = "All panels have the same scale. The disc marks the start.";
    svg.note((LEFT, 50.0), note);
    let half_m = shown
        .iter()
        .map(|flight| half_extent_m(flight))
        .fold(2.0, f64::max)
        * 1.1;
    for (index, flight) in shown.iter().enumerate() {
        let (row, column) = (index / COLUMNS, index % COLUMNS);
        let frame = Rect {
            x: LEFT + column as f64 * (SIDE + GAP_X),
            y: HEADER + row as f64 * (SIDE + GAP_Y),
            width: SIDE,
            height: SIDE,
        };
        draw_flight(&mut svg, flight, frame, half_m, column == 0);
    }
    svg.finish()
}

fn draw_flight(svg: &mut Svg, flight: &Flight, frame: Rect, half_m: f64, named: bool) {
    let around = |axis: usize| {
        let (low, high) = span_m(flight, axis);
        Scale::linear(0.5 * (low + high) - half_m, 0.5 * (low + high) + half_m)
    };
    let panel = Panel {
        frame,
        x: around(0),
        y: around(1),
    };
    panel.y_grid(svg, true);
    panel.x_grid(svg, 4);
    panel.title(svg, &flight.name);
    panel.x_name(svg, "x (east), m");
    if named {
        panel.y_name(svg, "y (north), m", 42.0);
    }
    let line: Vec<_> = flight
        .samples
        .iter()
        .map(|s| (s.position_m[0], s.position_m[1]))
        .collect();
    panel.line(svg, &line, Stroke::solid(ACCENT, 1.8));
    let (x, y) = line[0];
    svg.circle(panel.at(x, y), 4.0, INK);
    panel.axes(svg);
    let (low, high) = span_m(flight, 2);
    let text = format!("{low:.0} to {high:.0} m high");
    let at = (frame.x + frame.width - 4.0, frame.y + 10.0);
    svg.remark(at, &text, Anchor::End);
}

fn half_extent_m(flight: &Flight) -> f64 {
    let width_m = |axis| {
        let (low, high) = span_m(flight, axis);
        high - low
    };
    0.5 * width_m(0).max(width_m(1))
}

fn span_m(flight: &Flight, axis: usize) -> (f64, f64) {
    let values = flight.samples.iter().map(|sample| sample.position_m[axis]);
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    })
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Flight;

    use super::draw;

    #[test]
    fn every_flight_has_a_panel() {
        let rows = [
            [0.0, 1.0, 2.0, 3.0],
            [1.0, 2.0, 2.0, 3.0],
            [2.0, 3.0, 2.0, 9.0],
        ];
        let flights: Vec<_> = (0..7)
            .map(|i| Flight::from_track(&format!("f-{i}"), "f", &rows).unwrap())
            .collect();
        let text = draw(&flights.iter().collect::<Vec<_>>());
        for flight in &flights {
            assert!(text.contains(&format!(">{}</text>", flight.name)));
        }
        assert_eq!(text.matches("3 to 9 m high").count(), 7);
    }
}
