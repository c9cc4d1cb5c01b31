//! What a step of each method costs, as bars on a logarithmic axis.

use crate::contest::runtime::MethodTime;
use crate::plot::palette::look;
use crate::plot::panel::Panel;
use crate::plot::scale::Scale;
use crate::plot::svg::{Anchor, Lettering, Rect, Svg, lettering};

const WIDTH: f64 = 900.0;
const LEFT: f64 = 128.0;
const RIGHT: f64 = 90.0;
const HEADER: f64 = 78.0;
const ROW: f64 = 26.0;

/// The figure over `times`.
pub fn draw(times: &[MethodTime]) -> String {
    let rows = times.len() as f64;
    let mut svg = Svg::new(
        WIDTH,
        HEADER + rows * ROW + 54.0,
        "Time of one step of every method",
        "A bar per method on a logarithmic axis of microseconds, its marker at the tip.",
    );
    let title = "Time of one step on this machine, one thread";
    svg.heading((LEFT, 26.0), title);
    let note = "Bars start at the left end of a logarithmic axis: compare their tips.";
    svg.note((LEFT, 50.0), note);
    let panel = Panel {
        frame: Rect {
            x: LEFT,
            y: HEADER,
            width: WIDTH - LEFT - RIGHT,
            height: rows * ROW,
        },
        x: Scale::logarithmic_over(times.iter().map(|time| time.step_us)),
        y: Scale::linear(0.0, rows.max(1.0)),
    };
    panel.x_grid(&mut svg, 5);
    panel.x_name(&mut svg, "microseconds");
    for (index, time) in times.iter().enumerate() {
        let row = rows - index as f64 - 0.5;
        let (tip, y) = panel.at(time.step_us, row);
        let bar = Rect {
            x: LEFT,
            y: y - 5.0,
            width: (tip - LEFT).max(0.0),
            height: 10.0,
        };
        let look = look(time.method);
        svg.rect(bar, look.colour, 0.3);
        look.marker.draw(&mut svg, (tip, y), 4.6, look.colour);
        let name = Lettering {
            anchor: Anchor::End,
            ..lettering(12.0)
        };
        svg.text((LEFT - 10.0, y), time.method.label(), name);
        svg.text(
            (tip + 12.0, y),
            &microseconds(time.step_us),
            lettering(12.0),
        );
    }
    panel.axes(&mut svg);
    svg.finish()
}

fn microseconds(value: f64) -> String {
    if value < 10.0 {
        format!("{value:.1} µs")
    } else {
        format!("{value:.0} µs")
    }
}

#[cfg(test)]
mod tests {
    use super::draw;
    use crate::contest::runtime::MethodTime;
    use crate::method::Method;

    #[test]
    fn every_method_has_a_bar() {
        let time = |(i, method): (usize, Method)| MethodTime {
            method,
            step_us: 1.5 * 10_f64.powi(i as i32),
            flight_ms: 1.0,
        };
        let times: Vec<_> = Method::PAPER.into_iter().enumerate().map(time).collect();
        let text = draw(&times);
        assert!(text.contains(">1.5 µs</text>") && text.contains(">15000 µs</text>"));
        // The page itself is the sixth rectangle.
        assert_eq!(text.matches("<rect").count(), 6);
    }
}
