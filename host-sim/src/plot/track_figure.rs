//! A track without a truth: from above, its height, and its innovations.

use bnkf_model_export::radar::reading::Reading;
use nalgebra::Vector3;

use crate::contest::track::position_of;
use crate::exchange::tracked::Answer;
use crate::method::Method;
use crate::plot::ink::{ALARM, READING};
use crate::plot::legend::{self, Mark};
use crate::plot::palette::look;
use crate::plot::panel::Panel;
use crate::plot::scale::Scale;
use crate::plot::svg::{Rect, Stroke, Svg};
use crate::scoring::chi_square;

const WIDTH: f64 = 980.0;
const LEFT: f64 = 70.0;
const VIEW: f64 = 380.0;
const TOP: f64 = 122.0;
const SIDE: f64 = LEFT + VIEW + 100.0;
const SIDE_WIDTH: f64 = WIDTH - SIDE - 24.0;
const SIDE_HEIGHT: f64 = 150.0;
/// That of the recursive tracker, the default, whichever made it: the file has one track.
const TRACK: &str = look(Method::Recursive).colour;
/// Normal deviation that 95 % of errors on one axis lie within.
const DEVIATIONS: f64 = 1.96;

/// The figure of one target's track.
pub fn draw(name: &str, answers: &[Answer]) -> String {
    let mut svg = Svg::new(
        WIDTH,
        TOP + VIEW + 60.0,
        "A track from above, its height and its innovations",
        "Three panels: east and north, height over time with its claimed deviation, and how well every reading agreed.",
    );
    let title = if name.is_empty() {
        "Track".to_owned()
    } else {
        format!("Track of {name}")
    };
    svg.heading((LEFT, 28.0), &title);
    let entries = [
        (Mark::Dot(READING), "readings with range and angles"),
        (Mark::Line(Stroke::solid(TRACK, 2.0)), "track"),
        (
            Mark::Patch(TRACK, 0.2),
            "95 % of the tracker's own deviation",
        ),
    ];
    let (lines, _) = legend::lines(&entries, WIDTH - LEFT - 24.0);
    legend::draw_lines(&mut svg, (LEFT, 62.0), &lines);
    let points: Vec<(f64, Vector3<f64>, f64)> = answers.iter().filter_map(point).collect();
    let places: Vec<Vector3<f64>> = answers
        .iter()
        .filter_map(|answer| answer.plot.reading.as_ref())
        .filter(|reading| is_a_place(reading))
        .map(position_of)
        .collect();
    from_above(&mut svg, &points, &places);
    height(&mut svg, &points);
    innovations(&mut svg, answers);
    svg.finish()
}

/// Time, s, position and deviation of the height, m.
fn point(answer: &Answer) -> Option<(f64, Vector3<f64>, f64)> {
    let estimate = answer.estimate.as_ref().ok()?;
    let position_m = Vector3::from(estimate.position_m).map(f64::from);
    let deviation_m = f64::from(estimate.covariance_m2[2][2]).sqrt();
    Some((1e-6 * estimate.time_us as f64, position_m, deviation_m))
}

fn is_a_place(reading: &Reading) -> bool {
    let parts = [reading.range_m, reading.elevation_rad, reading.azimuth_rad];
    parts.iter().all(|part| part.is_finite())
}

fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let ends = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    if ends.0.is_finite() && ends.1.is_finite() {
        ends
    } else {
        (0.0, 1.0)
    }
}

/// Equal scales on both axes, wide enough for the track; readings beyond are cut off.
fn from_above(svg: &mut Svg, points: &[(f64, Vector3<f64>, f64)], places: &[Vector3<f64>]) {
    let (x, y) = (
        span(points.iter().map(|p| p.1.x)),
        span(points.iter().map(|p| p.1.y)),
    );
    let half_m = (0.5 * (x.1 - x.0).max(y.1 - y.0) * 1.3).max(4.0);
    let around = |(low, high): (f64, f64)| {
        Scale::linear(0.5 * (low + high) - half_m, 0.5 * (low + high) + half_m)
    };
    let panel = Panel {
        frame: Rect {
            x: LEFT,
            y: TOP,
            width: VIEW,
            height: VIEW,
        },
        x: around(x),
        y: around(y),
    };
    panel.y_grid(svg, true);
    panel.x_grid(svg, 5);
    panel.title(svg, "From above");
    panel.x_name(svg, "x (east), m");
    panel.y_name(svg, "y (north), m", 50.0);
    svg.clipped(panel.frame, |svg| {
        for at in places {
            svg.circle(panel.at(at.x, at.y), 1.7, READING);
        }
    });
    let line: Vec<_> = points.iter().map(|p| (p.1.x, p.1.y)).collect();
    panel.line(svg, &line, Stroke::solid(TRACK, 1.5));
    panel.axes(svg);
}

fn side(row: usize, x: (f64, f64), y: Scale) -> Panel {
    Panel {
        frame: Rect {
            x: SIDE,
            y: TOP + row as f64 * (VIEW - SIDE_HEIGHT),
            width: SIDE_WIDTH,
            height: SIDE_HEIGHT,
        },
        x: Scale::linear(x.0, x.1.max(x.0 + 1e-3)),
        y,
    }
}

fn height(svg: &mut Svg, points: &[(f64, Vector3<f64>, f64)]) {
    let band: Vec<_> = points
        .iter()
        .map(|(time_s, at, sigma)| {
            (
                *time_s,
                at.z - DEVIATIONS * sigma,
                at.z + DEVIATIONS * sigma,
            )
        })
        .collect();
    let (low, high) = span(points.iter().map(|p| p.1.z));
    let margin = (0.4 * (high - low)).max(2.0);
    let panel = side(
        0,
        span(points.iter().map(|p| p.0)),
        Scale::linear(low - margin, high + margin),
    );
    panel.y_grid(svg, true);
    panel.x_grid(svg, 5);
    panel.title(svg, "Height");
    panel.y_name(svg, "z (up), m", 50.0);
    panel.x_name(svg, "time, s");
    panel.band(svg, &band, TRACK);
    let line: Vec<_> = points.iter().map(|p| (p.0, p.1.z)).collect();
    panel.line(svg, &line, Stroke::solid(TRACK, 1.5));
    panel.axes(svg);
}

fn innovations(svg: &mut Svg, answers: &[Answer]) {
    let shares: Vec<(f64, f64)> = answers
        .iter()
        .filter_map(|answer| {
            let nis = answer.nis()?;
            let dof = nis.degrees.max(1) as f64;
            // Each on the scale of its own distribution, so that readings with parts missing stand beside whole ones.
            Some((
                1e-6 * answer.plot.time_us as f64,
                nis.value / chi_square::quantile(0.99, dof),
            ))
        })
        .collect();
    let times = span(
        answers
            .iter()
            .map(|answer| 1e-6 * answer.plot.time_us as f64),
    );
    let highest = shares
        .iter()
        .map(|share| share.1)
        .fold(1.4, f64::max)
        .min(4.0);
    let panel = side(1, times, Scale::linear(0.0, highest));
    panel.y_grid(svg, true);
    panel.x_grid(svg, 5);
    panel.title(svg, "Innovations: NIS over its 99 % limit");
    panel.x_name(svg, "time, s");
    panel.ideal(svg, 1.0);
    for (time_s, share) in shares {
        svg.circle(
            panel.at(time_s, share.min(highest)),
            1.7,
            if share > 1.0 { ALARM } else { TRACK },
        );
    }
    panel.axes(svg);
}
