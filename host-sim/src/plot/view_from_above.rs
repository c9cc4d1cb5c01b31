//! A flight from above: truth, readings, radar, start, and the tracks that come near the truth.

use bnkf_model_export::radar::reading::Reading;
use nalgebra::Vector3;

use crate::contest::example::Example;
use crate::contest::track::{TrackStep, position_of};
use crate::method::Method;
use crate::plot::ink::{INK, READING, TRUTH};
use crate::plot::legend::{Entry, Mark};
use crate::plot::marker::{Marker, Shape};
use crate::plot::palette::look;
use crate::plot::panel::Panel;
use crate::plot::scale::Scale;
use crate::plot::svg::{Anchor, Rect, Stroke, Svg};

/// Tracks in a view at most: more would be a tangle.
const TRACKS_MAX: usize = 3;
/// A track whose mean error is so many times the best one's is not drawn.
const NEAR: f64 = 1.6;
/// The radar is inside the view if that makes the view at most so many times as wide.
const ZOOM_OUT_MAX: f64 = 2.2;
/// Broad and pale below the methods' lines, of which one is black.
const TRUTH_LINE: Stroke<'static> = Stroke::solid(TRUTH, 6.0);
const RADAR: Marker = Marker::hollow(Shape::Up);
const START: Marker = Marker::hollow(Shape::Circle);

/// The marks that are no method's.
pub fn entries() -> Vec<Entry<'static>> {
    vec![
        (Mark::Line(TRUTH_LINE), "truth"),
        (Mark::Marker(START, INK), "its start"),
        (Mark::Marker(RADAR, INK), "radar, or the way to it"),
        (Mark::Dot(READING), "readings"),
    ]
}

/// The methods whose tracks the view of `example` shows, the nearest first.
pub fn shown(example: &Example<'_>) -> Vec<Method> {
    let held = |step: &TrackStep| step.scored.not_tracked;
    let tracks = example.tracks.iter();
    let mut errors: Vec<_> = tracks
        .filter(|(_, steps)| !steps.iter().all(held))
        .map(|(method, steps)| (*method, mean_m(steps)))
        .collect();
    errors.sort_by(|a, b| a.1.total_cmp(&b.1));
    let best = errors.first().map_or(0.0, |(_, error_m)| *error_m);
    errors
        .into_iter()
        .filter(|(_, error_m)| *error_m <= NEAR * best)
        .take(TRACKS_MAX)
        .map(|(method, _)| method)
        .collect()
}

/// Mean distance of a track from the truth, metres.
pub fn mean_m(steps: &[TrackStep]) -> f64 {
    let errors = steps.iter().map(|step| step.scored.score.error_m);
    errors.sum::<f64>() / steps.len() as f64
}

/// Draws `example` into `frame`, with equal scales on both axes.
pub fn draw(svg: &mut Svg, example: &Example<'_>, frame: Rect) {
    let samples = &example.flight.samples;
    let truth: Vec<_> = samples
        .iter()
        .map(|s| (s.position_m[0], s.position_m[1]))
        .collect();
    let radars = radars(&example.readings);
    let (x, y) = axes(&truth, &radars);
    let panel = Panel { frame, x, y };
    panel.y_grid(svg, true);
    panel.x_grid(svg, 4);
    panel.title(
        svg,
        &format!("{} noise, rate {}", example.noise, example.rate),
    );
    panel.x_name(svg, "x (east), m");
    panel.y_name(svg, "y (north), m", 40.0);
    let readings: Vec<Vector3<f64>> = example.readings.iter().flatten().map(position_of).collect();
    let is_inside = |at: &(f64, f64)| {
        let within = |scale: Scale, value: f64| (0.0..=1.0).contains(&scale.fraction(value));
        within(panel.x, at.0) && within(panel.y, at.1)
    };
    panel.line(svg, &truth, TRUTH_LINE);
    let places = readings.iter().map(|at| (at.x, at.y));
    let (inside, outside): (Vec<_>, Vec<_>) = places.partition(is_inside);
    for (x, y) in inside {
        svg.circle(panel.at(x, y), 1.5, READING);
    }
    for method in shown(example).into_iter().rev() {
        let own = example.tracks.iter().filter(|(other, _)| *other == method);
        for (_, steps) in own {
            let line: Vec<_> = steps
                .iter()
                .map(|step| (step.position_m.x, step.position_m.y))
                .collect();
            panel.line(svg, &line, look(method).stroke(1.3));
        }
    }
    if let Some((x, y)) = truth.first() {
        START.draw(svg, panel.at(*x, *y), 4.4, INK);
    }
    for radar in &radars {
        if is_inside(radar) {
            RADAR.draw(svg, panel.at(radar.0, radar.1), 4.6, INK);
        } else {
            point_to(svg, &panel, *radar);
        }
    }
    panel.axes(svg);
    if !outside.is_empty() {
        let text = format!("{} of {} readings outside", outside.len(), readings.len());
        // Above or below, where no arrow to the radar is.
        let is_above = radars
            .iter()
            .any(|(_, y)| *y > 0.5 * (panel.y.low() + panel.y.high()));
        let y = if is_above { frame.height - 9.0 } else { 9.0 };
        svg.remark(
            (frame.x + frame.width - 3.0, frame.y + y),
            &text,
            Anchor::End,
        );
    }
}

/// Where the radar stood, the first places of one that drives, without repeats.
fn radars(readings: &[Option<Reading>]) -> Vec<(f64, f64)> {
    let mut found: Vec<(f64, f64)> = Vec::new();
    for reading in readings.iter().flatten() {
        let [x, y, _] = reading.sensor.position_m;
        if found.len() < 2 && !found.contains(&(x, y)) {
            found.push((x, y));
        }
    }
    found
}

/// Around the flight, and the radars unless they lie far away.
fn axes(truth: &[(f64, f64)], radars: &[(f64, f64)]) -> (Scale, Scale) {
    let (x, y, half_m) = square(truth.iter());
    let all = square(truth.iter().chain(radars));
    let (x, y, half_m) = if all.2 <= ZOOM_OUT_MAX * half_m {
        all
    } else {
        (x, y, half_m)
    };
    let around = |middle: f64| Scale::linear(middle - half_m, middle + half_m);
    (around(x), around(y))
}

/// Middle and half the side of a square with a margin around `points`.
fn square<'a>(points: impl Iterator<Item = &'a (f64, f64)>) -> (f64, f64, f64) {
    let ends = [f64::INFINITY, f64::NEG_INFINITY];
    let ([left, right], [low, high]) = points.fold((ends, ends), |([l, r], [d, u]), (x, y)| {
        ([l.min(*x), r.max(*x)], [d.min(*y), u.max(*y)])
    });
    let half_m = (0.5 * (right - left).max(high - low) * 1.4).max(4.0);
    (0.5 * (left + right), 0.5 * (low + high), half_m)
}

/// An arrow at the edge towards what lies outside, with its distance from the middle of the view.
fn point_to(svg: &mut Svg, panel: &Panel, (x, y): (f64, f64)) {
    let middle = |scale: Scale| 0.5 * (scale.low() + scale.high());
    let (dx, dy) = (x - middle(panel.x), y - middle(panel.y));
    let away_m = dx.hypot(dy);
    let (dx, dy) = (dx / away_m, -dy / away_m);
    let half = 0.5 * panel.frame.width - 5.0;
    let reach = half / dx.abs().max(dy.abs());
    let centre = panel.at(middle(panel.x), middle(panel.y));
    let (tip_x, tip_y) = (centre.0 + reach * dx, centre.1 + reach * dy);
    let corner = |side: f64| {
        let (back_x, back_y) = (tip_x - 11.0 * dx, tip_y - 11.0 * dy);
        (back_x - side * dy, back_y + side * dx)
    };
    svg.polygon(&[(tip_x, tip_y), corner(4.5), corner(-4.5)], INK, 1.0);
    let text = format!("radar, {away_m:.0} m");
    let (anchor, shift) = if dx > 0.3 {
        (Anchor::End, -4.0)
    } else if dx < -0.3 {
        (Anchor::Start, 4.0)
    } else {
        (Anchor::Middle, 0.0)
    };
    let below = if dy > 0.0 { -1.0 } else { 1.0 };
    let at = (tip_x - 12.0 * dx + shift, tip_y - 12.0 * dy + 8.0 * below);
    svg.remark(at, &text, anchor);
}
