//! Consistency over the target's true speed or acceleration: flat is honest.

use crate::plot::ink::FAINT_INK;
use crate::plot::legend::{self, Mark};
use crate::plot::palette::look;
use crate::plot::panel::{IDEAL, Panel};
use crate::plot::scale::Scale;
use crate::plot::svg::{Anchor, Lettering, Rect, Svg, lettering};
use crate::scoring::bin::By;
use crate::scoring::binned::{BinSums, Pooled, STEPS_MIN};

const LEFT: f64 = 70.0;
const PANEL_WIDTH: f64 = 310.0;
const PANEL_HEIGHT: f64 = 190.0;
const COLUMN_GAP: f64 = 56.0;
const ROW_GAP: f64 = 74.0;

/// One measure, a row of panels.
#[derive(Clone, Copy)]
struct Measure {
    name: &'static str,
    ideal: f64,
    of: fn(&BinSums) -> f64,
    y: Scale,
}

/// The figure over `groups`, the methods of one noise level each, every bin of `by` a place on the
/// horizontal axis. Bins of few steps are left out.
pub fn draw(by: By, groups: &[Vec<Pooled>]) -> String {
    let columns = groups.len().max(1) as f64;
    let width = LEFT + columns * (PANEL_WIDTH + COLUMN_GAP) - COLUMN_GAP + 24.0;
    let methods = groups.first().map_or(&[][..], Vec::as_slice);
    let mut entries: Vec<_> = methods
        .iter()
        .map(|own| (Mark::Method(look(own.method)), own.method.label()))
        .collect();
    entries.push((Mark::Line(IDEAL), "ideal"));
    let (lines, legend_height) = legend::lines(&entries, width - LEFT - 24.0);
    let header = 128.0 + legend_height;
    let measures = measures(by, groups);
    let used = used(by, groups);
    let rows = measures.len() as f64;
    let height = header + rows * (PANEL_HEIGHT + ROW_GAP) - ROW_GAP + 52.0;
    let title = format!("Consistency by the true {} of the target", by.label());
    let mut svg = Svg::new(
        width,
        height,
        &title,
        "NEES above, coverage of the 90% ellipsoid below; a panel per noise level, a line per method, a place per bin.",
    );
    svg.heading(
        (LEFT, 26.0),
        &format!("{title}: an honest covariance is flat"),
    );
    let note =
        format!("All sampling rates together; bins of fewer than {STEPS_MIN} steps are left out.");
    svg.note((LEFT, 50.0), &note);
    legend::draw_lines(&mut svg, (LEFT, 78.0), &lines);
    for (row, measure) in measures.iter().enumerate() {
        for (column, group) in groups.iter().enumerate() {
            let panel = Panel {
                frame: Rect {
                    x: LEFT + column as f64 * (PANEL_WIDTH + COLUMN_GAP),
                    y: header + row as f64 * (PANEL_HEIGHT + ROW_GAP),
                    width: PANEL_WIDTH,
                    height: PANEL_HEIGHT,
                },
                x: Scale::linear(0.0, used as f64),
                y: measure.y,
            };
            panel.y_grid(&mut svg, true);
            if let Some(first) = group.first() {
                panel.title(
                    &mut svg,
                    &format!("{}, {} noise", measure.name, first.noise),
                );
            }
            if column == 0 {
                panel.y_name(&mut svg, measure.name, 48.0);
            }
            name_bins(&mut svg, &panel, by, used);
            panel.ideal(&mut svg, measure.ideal);
            for own in group {
                draw_method(&mut svg, &panel, by, own, measure);
            }
            panel.axes(&mut svg);
        }
    }
    svg.finish()
}

/// Bins up to the last that any step is in; all of them if there are none.
fn used(by: By, groups: &[Vec<Pooled>]) -> usize {
    let all = groups
        .iter()
        .flatten()
        .flat_map(|own| bins(own, by).enumerate());
    let last = all
        .filter(|(_, bin)| bin.means().steps > 0)
        .map(|(slot, _)| slot + 1)
        .max();
    last.unwrap_or(by.bins().len())
}

/// NEES and coverage with axes that hold all groups, so that panels of a row compare.
fn measures(by: By, groups: &[Vec<Pooled>]) -> [Measure; 2] {
    let nees = |own: &BinSums| own.telling().map_or(f64::NAN, |means| means.nees);
    let coverage = |own: &BinSums| own.telling().map_or(f64::NAN, |means| means.coverage90);
    let all = || groups.iter().flatten().flat_map(|own| bins(own, by));
    let lowest = all().map(coverage).fold(0.8, f64::min);
    [
        Measure {
            name: "NEES",
            ideal: 3.0,
            of: nees,
            y: Scale::logarithmic_over(all().map(nees).chain([3.0])),
        },
        Measure {
            name: "90% coverage",
            ideal: 0.9,
            of: coverage,
            y: Scale::linear((10.0 * lowest).floor() / 10.0, 1.0),
        },
    ]
}

fn bins(own: &Pooled, by: By) -> impl Iterator<Item = &BinSums> {
    own.bins.iter().filter(move |own| own.bin.by == by)
}

fn name_bins(svg: &mut Svg, panel: &Panel, by: By, used: usize) {
    for (slot, bin) in by.bins().iter().enumerate().take(used) {
        let (x, y) = panel.at(slot as f64 + 0.5, panel.y.low());
        let text = Lettering {
            anchor: Anchor::Middle,
            colour: FAINT_INK,
            ..lettering(11.0)
        };
        svg.text((x, y + 12.0), &bin.to_string(), text);
    }
    panel.x_name(svg, &format!("{}, {}", by.label(), by.unit()));
}

fn draw_method(svg: &mut Svg, panel: &Panel, by: By, own: &Pooled, measure: &Measure) {
    let look = look(own.method);
    let points: Vec<_> = bins(own, by)
        .enumerate()
        .take(panel.x.high() as usize)
        .map(|(slot, bin)| (slot as f64 + 0.5, (measure.of)(bin)))
        .collect();
    panel.line(svg, &points, look.stroke(1.5));
    for ((slot, value), bin) in points.iter().zip(bins(own, by)) {
        if value.is_finite() {
            let steps = bin.means().steps;
            let said = format!("{}, {}: {value:.3}, {steps} steps", own.method, bin.bin);
            svg.titled(&said, |svg| {
                look.marker
                    .draw(svg, panel.at(*slot, *value), 3.6, look.colour);
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Motion;
    use bnkf_model_export::radar::noise::NoiseLevel;
    use bnkf_model_export::scoring::step_score::StepScore;

    use super::draw;
    use crate::method::Method;
    use crate::scoring::bin::By;
    use crate::scoring::binned::{Pooled, STEPS_MIN, binned};

    #[test]
    fn bins_of_few_steps_are_left_out() {
        let steps = |speed_mps, count| {
            let motion = Motion {
                speed_mps,
                acceleration_mps2: 1.0,
            };
            let score = StepScore {
                error_m: 1.0,
                mahalanobis_squared: 4.0,
                det_p_m6: 1.0,
            };
            std::iter::repeat_n((motion, score), count as usize)
        };
        let pooled = Pooled {
            method: Method::Recursive,
            noise: NoiseLevel::Low,
            bins: binned(steps(1.0, STEPS_MIN).chain(steps(5.0, STEPS_MIN - 1))),
        };
        let text = draw(By::Speed, &[vec![pooled.clone()]]);
        assert_eq!(text.matches("<title>recursive, 0-2: 4.000").count(), 1);
        assert_eq!(text.matches("<title>recursive, 0-2: 1.000").count(), 1);
        assert!(!text.contains("<title>recursive, 4-6"), "{text}");
        assert!(text.contains(">4-6</text>") && !text.contains("NaN"));
        // Bins beyond are empty.
        assert!(!text.contains(">6-8</text>") && !text.contains(">12+</text>"));
        let text = draw(By::Acceleration, &[vec![pooled]]);
        assert_eq!(text.matches(", 399 steps</title>").count(), 2);
        assert!(draw(By::Speed, &[]).contains("ideal"));
    }
}
