//! Error, consistency and coverage of every method over noise levels and sampling rates.

use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::NoiseLevel;

use crate::method::Method;
use crate::plot::legend::{self, Mark};
use crate::plot::palette::look;
use crate::plot::panel::Panel;
use crate::plot::scale::Scale;
use crate::plot::svg::{Anchor, FAINT_INK, INK, Lettering, Rect, Stroke, Svg, lettering};
use crate::scoring::cell::{Cell, CellMetrics};

const WIDTH: f64 = 1120.0;
const LEFT: f64 = 78.0;
const RIGHT: f64 = 92.0;
const HEADER: f64 = 112.0;
const PANEL_HEIGHT: f64 = 215.0;
const PANEL_GAP: f64 = 44.0;
const FOOTER: f64 = 58.0;
/// Part of a slot that its markers spread over.
const SPREAD: f64 = 0.72;

/// A row of the figure.
struct Row {
    title: &'static str,
    axis: &'static str,
    value: fn(&CellMetrics) -> f64,
    ideal: Option<(f64, &'static str)>,
    scale: fn(&[f64]) -> Scale,
}

const ROWS: [Row; 3] = [
    Row {
        title: "Mean distance to the truth",
        axis: "ED, m",
        value: |metrics| metrics.ed_mean_m,
        ideal: None,
        scale: |values| Scale::logarithmic_over(values.iter().copied()),
    },
    Row {
        title: "Consistency: mean squared Mahalanobis distance (above 3: overconfident)",
        axis: "NEES",
        value: |metrics| metrics.nees_mean,
        ideal: Some((3.0, "ideal: 3")),
        scale: |values| Scale::logarithmic_over(values.iter().copied().chain([3.0])),
    },
    Row {
        title: "Coverage: truths inside the 90% ellipsoid",
        axis: "fraction",
        value: |metrics| metrics.coverage90,
        ideal: Some((0.9, "ideal: 0.9")),
        scale: |_| Scale::linear(0.0, 1.0),
    },
];

/// A line below which the mean ED of a block cannot be: noise level, rate, metres.
pub type Floor = (NoiseLevel, SamplingRate, f64);

/// How [`Floor`]s are drawn.
const FLOOR: Stroke<'static> = Stroke {
    colour: INK,
    width: 2.0,
    dash: "2 3",
};

/// The figure over `cells`; methods, noise levels and rates appear in their order. `floors` may be
/// empty.
pub fn draw(cells: &[Cell], floors: &[Floor]) -> String {
    let methods = in_order(cells.iter().map(|cell| cell.method));
    let noises = in_order(cells.iter().map(|cell| cell.noise));
    let rates = in_order(cells.iter().map(|cell| cell.rate));
    let mut entries: Vec<_> = methods
        .iter()
        .map(|m| (Mark::Method(look(*m)), m.label()))
        .collect();
    if !floors.is_empty() {
        entries.push((Mark::Line(FLOOR), "bound of the fitted motion model"));
    }
    let (lines, legend_height) = legend::lines(&entries, WIDTH - LEFT - RIGHT);
    let header = HEADER + legend_height;
    let height = header + ROWS.len() as f64 * (PANEL_HEIGHT + PANEL_GAP) - PANEL_GAP + FOOTER;
    let mut svg = Svg::new(
        WIDTH,
        height,
        "Metrics of every method by noise level and sampling rate",
    );
    let title = "Every method by noise level and sampling rate";
    svg.heading((LEFT, 28.0), title);
    legend::draw_lines(&mut svg, (LEFT, 60.0), &lines);

    let slots = (noises.len() * rates.len()).max(1) as f64;
    for (number, row) in ROWS.iter().enumerate() {
        let values: Vec<_> = cells
            .iter()
            .map(|cell| (row.value)(&cell.metrics))
            .collect();
        let mut shown = values;
        if number == 0 {
            shown.extend(floors.iter().map(|floor| floor.2));
        }
        let panel = Panel {
            frame: Rect {
                x: LEFT,
                y: header + number as f64 * (PANEL_HEIGHT + PANEL_GAP),
                width: WIDTH - LEFT - RIGHT,
                height: PANEL_HEIGHT,
            },
            x: Scale::linear(0.0, slots),
            y: (row.scale)(&shown),
        };
        draw_axes(&mut svg, &panel, row, rates.len(), noises.len());
        for (index, method) in methods.iter().enumerate() {
            let shift = SPREAD * ((index as f64 + 0.5) / methods.len() as f64 - 0.5);
            for (group, noise) in noises.iter().enumerate() {
                let points: Vec<_> = rates
                    .iter()
                    .enumerate()
                    .map(|(place, rate)| {
                        let x = (group * rates.len() + place) as f64 + 0.5 + shift;
                        (x, find(cells, *method, *noise, *rate, row.value))
                    })
                    .collect();
                draw_group(&mut svg, &panel, *method, &points);
            }
        }
        if number == 0 {
            for (noise, rate, metres) in floors {
                draw_floor(
                    &mut svg,
                    &panel,
                    slot(&noises, &rates, *noise, *rate),
                    *metres,
                );
            }
        }
        panel.axes(&mut svg);
        if number + 1 == ROWS.len() {
            draw_footer(&mut svg, &panel, &noises, &rates);
        }
    }
    svg.finish("metrics")
}

fn draw_axes(svg: &mut Svg, panel: &Panel, row: &Row, rates: usize, noises: usize) {
    for group in (0..noises).skip(1).step_by(2) {
        let (low, high) = ((group * rates) as f64, ((group + 1) * rates) as f64);
        panel.stripe(svg, low, high, "#f4f6f8");
    }
    panel.y_grid(svg, true);
    panel.title(svg, row.title);
    panel.y_name(svg, row.axis, 54.0);
    if let Some((value, label)) = row.ideal {
        panel.ideal(svg, value);
        let (x, y) = panel.at(panel.x.high(), value);
        svg.text(
            (x + 8.0, y),
            label,
            Lettering {
                colour: INK,
                ..lettering(12.0)
            },
        );
    }
}

/// The values of one method at one noise level, joined over the rates.
fn draw_group(svg: &mut Svg, panel: &Panel, method: Method, points: &[(f64, f64)]) {
    let look = look(method);
    let (low, high) = (panel.y.low(), panel.y.high());
    // What lies beyond the axis is drawn on its edge: hidden would look like absent.
    let points: Vec<_> = points
        .iter()
        .map(|(x, y)| (*x, y.clamp(low, high), *y))
        .collect();
    let line: Vec<_> = points.iter().map(|(x, y, _)| panel.at(*x, *y)).collect();
    svg.polyline(&line, Stroke::solid(look.colour, 1.3));
    for (x, shown, value) in points {
        if value.is_nan() {
            continue;
        }
        svg.titled(&format!("{method}: {value:.4}"), |svg| {
            look.marker.draw(svg, panel.at(x, shown), 4.6, look.colour);
        });
    }
}

/// Number of the slot of a noise level and rate.
fn slot(
    noises: &[NoiseLevel],
    rates: &[SamplingRate],
    noise: NoiseLevel,
    rate: SamplingRate,
) -> Option<f64> {
    let group = noises.iter().position(|other| *other == noise)?;
    let place = rates.iter().position(|other| *other == rate)?;
    Some((group * rates.len() + place) as f64)
}

fn draw_floor(svg: &mut Svg, panel: &Panel, slot: Option<f64>, metres: f64) {
    if let Some(slot) = slot
        && metres.is_finite()
    {
        let ends = [panel.at(slot + 0.06, metres), panel.at(slot + 0.94, metres)];
        svg.titled(&format!("bound: {metres:.4} m"), |svg| {
            svg.polyline(&ends, FLOOR)
        });
    }
}

fn draw_footer(svg: &mut Svg, panel: &Panel, noises: &[NoiseLevel], rates: &[SamplingRate]) {
    let bottom = panel.frame.y + panel.frame.height;
    let middle = |size| Lettering {
        anchor: Anchor::Middle,
        ..lettering(size)
    };
    for (group, noise) in noises.iter().enumerate() {
        for (place, rate) in rates.iter().enumerate() {
            let slot = (group * rates.len() + place) as f64 + 0.5;
            let (x, _) = panel.at(slot, panel.y.low());
            let text = format!("rate {rate}");
            svg.text(
                (x, bottom + 14.0),
                &text,
                Lettering {
                    colour: FAINT_INK,
                    ..middle(11.0)
                },
            );
        }
        let centre = (group as f64 + 0.5) * rates.len() as f64;
        let (x, _) = panel.at(centre, panel.y.low());
        let text = format!("{noise} noise");
        svg.text(
            (x, bottom + 36.0),
            &text,
            Lettering {
                bold: true,
                ..middle(13.0)
            },
        );
    }
}

fn find(
    cells: &[Cell],
    method: Method,
    noise: NoiseLevel,
    rate: SamplingRate,
    value: fn(&CellMetrics) -> f64,
) -> f64 {
    cells
        .iter()
        .find(|cell| cell.method == method && cell.noise == noise && cell.rate == rate)
        .map_or(f64::NAN, |cell| value(&cell.metrics))
}

/// The distinct values in the order of their first appearance.
fn in_order<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::NoiseLevel;

    use super::draw;
    use crate::method::Method;
    use crate::scoring::cell::{Cell, CellMetrics};

    fn cells() -> Vec<Cell> {
        let noises = [NoiseLevel::Low, NoiseLevel::Medium, NoiseLevel::High];
        let mut cells = Vec::new();
        for (m, method) in Method::PAPER.into_iter().enumerate() {
            for (n, noise) in noises.into_iter().enumerate() {
                for (r, rate) in SamplingRate::ALL.into_iter().enumerate() {
                    let scale = 10_f64.powi(n as i32) * (1.0 + 0.3 * r as f64);
                    let metrics = CellMetrics {
                        steps: 100,
                        ed_mean_m: 0.1 * scale * (1.0 + m as f64),
                        ed_median_m: 0.08 * scale,
                        d_mean: 1.6,
                        nees_mean: if m == 1 && n == 2 {
                            f64::NAN
                        } else {
                            2.0 + m as f64 * scale
                        },
                        coverage90: 0.95 - 0.1 * m as f64,
                        nll: 1.0,
                        det_p_median_m6: 1.0,
                        diverged: 0,
                        rejected: 0,
                        restarted: 0,
                        not_tracked: 0,
                        outside: 0,
                    };
                    cells.push(Cell {
                        method,
                        noise,
                        rate,
                        metrics,
                        bins: Vec::new(),
                    });
                }
            }
        }
        cells
    }

    /// Every value has its marker in every row, and a missing value none.
    #[test]
    fn every_cell_is_drawn() {
        let floor = (NoiseLevel::Low, SamplingRate::HALF, 0.05);
        let text = draw(&cells(), &[floor]);
        let markers = text.matches("<g><title>").count();
        assert_eq!(markers, 3 * 45 - 3 + 1);
        assert!(text.contains("<title>bound: 0.0500 m</title>"));
        assert!(text.contains("<title>EKF: 0.1000</title>"));
        assert!(!text.contains("NaN"));
    }

    #[test]
    fn no_cells_make_an_empty_figure() {
        assert!(draw(&[], &[]).ends_with("</svg>\n"));
    }
}
