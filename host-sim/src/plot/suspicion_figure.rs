//! What the tracker suspects over time: the target's true acceleration, the probabilities of its
//! hypotheses, and its mode.

use bnkf::Mode;

use crate::contest::suspicion::Suspicion;
use crate::plot::ink::{ACCENT, ALARM, FAINT_INK, GAP, GRID, INK};
use crate::plot::legend::{self, Mark};
use crate::plot::marker::{Marker, Shape};
use crate::plot::panel::Panel;
use crate::plot::scale::Scale;
use crate::plot::slot;
use crate::plot::svg::{Anchor, Lettering, Rect, Stroke, Svg, lettering};

const WIDTH: f64 = 1120.0;
const LEFT: f64 = 96.0;
const HEADER: f64 = 118.0;
const ACCELERATION_HEIGHT: f64 = 110.0;
const DOUBT_HEIGHT: f64 = 150.0;
const MODE_ROW: f64 = 20.0;
const PANEL_GAP: f64 = 56.0;
const MODES: [Mode; 5] = [
    Mode::Tracking,
    Mode::Coasting,
    Mode::Rejected,
    Mode::Restarted,
    Mode::Started,
];

/// Stands where a reading was made wrong.
const WRONG: Marker = Marker::filled(Shape::Cross);

/// The figure of one flight, which `title` names; `wrong_s` are the times of readings that were made wrong.
pub fn draw(title: &str, steps: &[Suspicion], wrong_s: &[f64]) -> String {
    let modes_height = MODES.len() as f64 * MODE_ROW;
    let height =
        HEADER + ACCELERATION_HEIGHT + DOUBT_HEIGHT + modes_height + 2.0 * PANEL_GAP + 50.0;
    let mut svg = Svg::new(
        WIDTH,
        height,
        "What the tracker suspects in flight",
        "Three panels over time: the target's true acceleration; the probability that it manoeuvred, from below, and \
         that the reading is wrong, from above; the tracker's mode at every step.",
    );
    svg.heading((LEFT, 26.0), "In flight: manoeuvre, or a reading to doubt?");
    svg.note((LEFT, 50.0), title);
    let entries = [
        (Mark::Patch(ACCENT, 1.0), "target manoeuvred (from below)"),
        (Mark::Patch(ALARM, 1.0), "reading wrong (from above)"),
        (Mark::Marker(WRONG, INK), "reading made wrong"),
        (Mark::Patch(GAP, 1.0), "gap: no readings"),
    ];
    legend::draw(&mut svg, (LEFT, 78.0), &entries);
    let last_s = steps.last().map_or(1.0, |step| step.time_s);
    let highest = steps.iter().map(|step| step.acceleration_mps2);
    let highest = highest.fold(1.0, f64::max);
    let panel = |y, height, scale| Panel {
        frame: Rect {
            x: LEFT,
            y,
            width: WIDTH - LEFT - 24.0,
            height,
        },
        x: Scale::linear(0.0, last_s),
        y: scale,
    };
    let truth = panel(
        HEADER,
        ACCELERATION_HEIGHT,
        Scale::linear(0.0, 1.08 * highest),
    );
    let second = HEADER + ACCELERATION_HEIGHT + PANEL_GAP;
    let doubt = panel(second, DOUBT_HEIGHT, Scale::linear(0.0, 1.0));
    let third = second + DOUBT_HEIGHT + PANEL_GAP;
    let modes = panel(third, modes_height, Scale::linear(0.0, MODES.len() as f64));
    for panel in [&truth, &doubt, &modes] {
        for (low, high, step) in slots(steps) {
            if step.in_gap {
                panel.stripe(&mut svg, low, high, GAP);
            }
        }
    }
    truth.y_grid(&mut svg, true);
    truth.title(&mut svg, "True acceleration, m/s²");
    let line: Vec<_> = steps
        .iter()
        .map(|step| (step.time_s, step.acceleration_mps2))
        .collect();
    truth.line(&mut svg, &line, Stroke::solid(INK, 1.6));
    truth.axes(&mut svg);
    doubt.y_grid(&mut svg, true);
    // Higher than a panel's title: the marks of wrong readings lie between.
    let raised = Rect {
        y: second - 12.0,
        ..doubt.frame
    };
    let above = Panel {
        frame: raised,
        ..doubt
    };
    above.title(&mut svg, "Probability after the reading");
    draw_doubts(&mut svg, &doubt, steps);
    doubt.axes(&mut svg);
    for time_s in wrong_s {
        let (x, y) = doubt.at(*time_s, 1.0);
        WRONG.draw(&mut svg, (x, y - 8.0), 4.0, INK);
    }
    modes.title(&mut svg, "Mode");
    draw_modes(&mut svg, &modes, steps);
    modes.x_grid(&mut svg, 8);
    modes.axes(&mut svg);
    modes.x_name(&mut svg, "time, s");
    svg.finish()
}

/// Every step with the time that it stands for, s.
fn slots(steps: &[Suspicion]) -> impl Iterator<Item = (f64, f64, &Suspicion)> {
    let times_s: Vec<f64> = steps.iter().map(|step| step.time_s).collect();
    let slots: Vec<_> = slot::slots(&times_s).collect();
    let slots = slots.into_iter().zip(steps);
    slots.map(|((low, high), step)| (low, high, step))
}

fn draw_doubts(svg: &mut Svg, panel: &Panel, steps: &[Suspicion]) {
    let bar = |low: f64, high: f64, from: f64, to: f64| {
        let (left, top) = panel.at(low, to);
        let (right, bottom) = panel.at(high, from);
        Rect {
            x: left,
            y: top,
            width: right - left,
            height: bottom - top,
        }
    };
    for (low, high, step) in slots(steps) {
        let [manoeuvre, outlier] =
            [step.doubt.manoeuvre, step.doubt.outlier].map(|p| f64::from(p).clamp(0.0, 1.0));
        if manoeuvre + outlier < 1e-3 {
            continue;
        }
        let said = format!(
            "{:.2} s: manoeuvre {manoeuvre:.3}, reading wrong {outlier:.3}",
            step.time_s
        );
        svg.titled(&said, |svg| {
            svg.rect(bar(low, high, 0.0, manoeuvre), ACCENT, 1.0);
            svg.rect(bar(low, high, 1.0 - outlier, 1.0), ALARM, 1.0);
        });
    }
}

fn draw_modes(svg: &mut Svg, panel: &Panel, steps: &[Suspicion]) {
    for (row, mode) in MODES.into_iter().enumerate() {
        let place = (MODES.len() - row) as f64 - 0.5;
        let (left, y) = panel.at(panel.x.low(), place);
        let (right, _) = panel.at(panel.x.high(), place);
        svg.polyline(&[(left, y), (right, y)], Stroke::solid(GRID, 1.0));
        let name = Lettering {
            anchor: Anchor::End,
            colour: FAINT_INK,
            ..lettering(11.0)
        };
        svg.text((left - 7.0, y), mode.name(), name);
        let colour = match mode {
            Mode::Rejected | Mode::Restarted => ALARM,
            _ => INK,
        };
        for step in steps.iter().filter(|step| step.mode == Some(mode)) {
            svg.circle(panel.at(step.time_s, place), 2.2, colour);
        }
    }
}

#[cfg(test)]
mod tests {
    use bnkf::{Doubt, Mode};

    use super::draw;
    use crate::contest::suspicion::Suspicion;

    #[test]
    fn every_step_has_its_mode_and_every_doubt_its_bars() {
        let step = |(i, mode, manoeuvre, outlier)| Suspicion {
            time_s: 0.1 * f64::from(i),
            in_gap: mode == Mode::Coasting,
            mode: Some(mode),
            doubt: Doubt { manoeuvre, outlier },
            acceleration_mps2: 2.0,
        };
        let steps = [
            (1, Mode::Tracking, 0.0, 0.0),
            (2, Mode::Tracking, 0.75, 0.125),
            (3, Mode::Coasting, 0.0, 0.0),
            (4, Mode::Rejected, 0.0, 1.0),
        ]
        .map(step);
        let text = draw("a flight", &steps, &[0.4]);
        assert_eq!(text.matches("<circle").count(), 4);
        assert!(text.contains("<title>0.20 s: manoeuvre 0.750, reading wrong 0.125</title>"));
        assert_eq!(text.matches("manoeuvre 0").count(), 2);
        assert!(!text.contains("NaN"));
        assert!(draw("none", &[], &[]).ends_with("</svg>\n"));
    }
}
