//! Example flights: the nearest tracks from above, and every method's error beside what it claimed.

use nalgebra::Matrix3;

use crate::contest::example::Example;
use crate::contest::track::TrackStep;
use crate::method::Method;
use crate::plot::ink::{GAP, READING};
use crate::plot::legend::{self, Mark};
use crate::plot::palette::look;
use crate::plot::panel::Panel;
use crate::plot::scale::Scale;
use crate::plot::slot::stretches;
use crate::plot::svg::{Anchor, Rect, Stroke, Svg};
use crate::plot::view_from_above;
use crate::scoring::chi_square;

const LEFT: f64 = 58.0;
const VIEW: f64 = 180.0;
const VIEW_GAP: f64 = 66.0;
const PANEL_GAP: f64 = 14.0;
const RIGHT: f64 = 16.0;
const HEADER: f64 = 92.0;
const ROW_GAP: f64 = 64.0;
const FOOTER: f64 = 44.0;
/// As wide as a page shows whole.
const WIDTH: f64 = 1120.0;
/// Part of the errors that lie in the band if a method's covariance is right.
const BAND: (f64, f64) = (0.05, 0.95);

/// The figure: one row per example.
pub fn draw(examples: &[Example<'_>]) -> String {
    let entries = entries(examples);
    let (lines, legend_height) = legend::lines(&entries, WIDTH - LEFT - RIGHT);
    let header = HEADER + legend_height;
    let height = header + examples.len() as f64 * (VIEW + ROW_GAP) - ROW_GAP + FOOTER;
    let mut svg = Svg::new(
        WIDTH,
        height,
        "Example flights with the error of every method",
        "A row per flight: on the left the flight from above with radar, start, readings and the nearest tracks; then a \
         panel per method with its distance to the truth over time and the band where nine of ten distances belong.",
    );
    let title = "Example flights, seen from above, and the error over time";
    svg.heading((LEFT, 26.0), title);
    legend::draw_lines(&mut svg, (LEFT, 54.0), &lines);
    for (row, example) in examples.iter().enumerate() {
        let top = header + row as f64 * (VIEW + ROW_GAP);
        let frame = Rect {
            x: LEFT,
            y: top,
            width: VIEW,
            height: VIEW,
        };
        view_from_above::draw(&mut svg, example, frame);
        draw_errors(&mut svg, example, top);
    }
    svg.finish()
}

fn entries(examples: &[Example<'_>]) -> Vec<legend::Entry<'static>> {
    let mut entries = view_from_above::entries();
    let mut named: Vec<Method> = Vec::new();
    for method in examples.iter().flat_map(view_from_above::shown) {
        if !named.contains(&method) {
            named.push(method);
            entries.push((Mark::Line(look(method).stroke(2.0)), method.label()));
        }
    }
    entries.push((
        Mark::Patch(READING, 0.4),
        "where 90% of the errors belong by the method's own covariance",
    ));
    entries.push((Mark::Patch(GAP, 1.0), "gap: no readings"));
    entries
}

/// One panel per method: error, band and gaps over time, on one scale per flight.
fn draw_errors(svg: &mut Svg, example: &Example<'_>, top: f64) {
    let steps = || example.tracks.iter().flat_map(|(_, steps)| steps);
    let highest = steps()
        .map(|step| step.scored.score.error_m)
        .fold(0.0, f64::max);
    let mut errors: Vec<_> = steps().map(|step| step.scored.score.error_m).collect();
    errors.sort_unstable_by(f64::total_cmp);
    // A few lucky steps near zero would stretch a logarithmic axis over empty decades.
    let lowest = errors.get(errors.len() / 50).copied().unwrap_or(0.1);
    // Room above for what stands in the panels.
    let y = Scale::logarithmic_over([lowest, 1.8 * highest].into_iter());
    let x = Scale::linear(0.0, example.flight.duration_s());
    let first = LEFT + VIEW + VIEW_GAP;
    let slot = (WIDTH - RIGHT - first + PANEL_GAP) / example.tracks.len().max(1) as f64;
    for (index, (method, steps)) in example.tracks.iter().enumerate() {
        let left = first + index as f64 * slot;
        let panel = Panel {
            frame: Rect {
                x: left,
                y: top,
                width: slot - PANEL_GAP,
                height: VIEW,
            },
            x,
            y,
        };
        for (low, high) in gaps_s(steps) {
            panel.stripe(svg, low, high, GAP);
        }
        panel.y_grid(svg, index == 0);
        panel.x_grid(svg, 3);
        if index == 0 {
            panel.y_name(svg, "distance to the truth, m", 48.0);
        }
        panel.x_name(svg, "time, s");
        panel.title(svg, method.label());
        let mean = format!("mean {}", metres(view_from_above::mean_m(steps)));
        let at = (left + slot - PANEL_GAP - 3.0, top + 9.0);
        let band: Vec<_> = steps
            .iter()
            .map(|step| {
                let (low, high) = claimed_errors_m(&step.covariance_m2);
                (step.time_s, low, high)
            })
            .collect();
        panel.band(svg, &band, look(*method).colour);
        let line: Vec<_> = steps
            .iter()
            .map(|step| (step.time_s, step.scored.score.error_m))
            .collect();
        panel.line(svg, &line, Stroke::solid(look(*method).colour, 1.5));
        panel.axes(svg);
        svg.remark(at, &mean, Anchor::End);
    }
}

/// Where the length of a zero-mean Gaussian error with this covariance lies nine times of ten, m.
///
/// Its square is approximated by a scaled chi-square with the same mean and variance
/// (Satterthwaite): `g chi2_h`, `g = tr P^2 / tr P`, `h = (tr P)^2 / tr P^2`.
fn claimed_errors_m(covariance_m2: &Matrix3<f64>) -> (f64, f64) {
    let trace = covariance_m2.trace();
    let square = (covariance_m2 * covariance_m2).trace();
    let (scale, dof) = (square / trace, trace * trace / square);
    let at = |probability| (scale * chi_square::quantile(probability, dof)).sqrt();
    (at(BAND.0), at(BAND.1))
}

/// Stretches without readings, seconds.
fn gaps_s(steps: &[TrackStep]) -> Vec<(f64, f64)> {
    stretches(steps.iter().map(|step| (step.time_s, step.in_gap)))
}

/// Metres with two or three significant digits.
fn metres(value: f64) -> String {
    if value < 1.0 {
        format!("{value:.2} m")
    } else {
        format!("{value:.1} m")
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::{Flight, Motion};
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
    use bnkf_model_export::radar::sampling::{RadarSettings, sample_radar};
    use bnkf_model_export::scoring::step_score::StepScore;
    use nalgebra::{Matrix3, Vector3};

    use super::{Example, claimed_errors_m, draw, gaps_s};
    use crate::contest::track::TrackStep;
    use crate::method::Method;
    use crate::scoring::cell::ScoredStep;

    fn flight() -> Flight {
        let row = |i: i32| {
            let t = f64::from(i) * 0.1;
            [t, 20.0 + 5.0 * t.cos(), 5.0 * t.sin(), 10.0]
        };
        Flight::from_track("circle", "circle", &(0..150).map(row).collect::<Vec<_>>()).unwrap()
    }

    /// An estimate half a metre east of the truth.
    fn steps(flight: &Flight, seen: &[bool]) -> Vec<TrackStep> {
        let step = |(sample, seen): (&bnkf_model_export::flights::flight::Sample, &bool)| {
            let truth_m = Vector3::from(sample.position_m);
            let position_m = truth_m + Vector3::x() * 0.5;
            let covariance_m2 = Matrix3::identity() * 0.1;
            let score = StepScore::new(&position_m, &covariance_m2, &truth_m).unwrap();
            TrackStep {
                time_s: sample.time_s,
                position_m,
                covariance_m2,
                nis: None,
                scored: ScoredStep::tracked(score),
                in_gap: !seen,
                motion: Motion::default(),
            }
        };
        flight.samples.iter().zip(seen).skip(1).map(step).collect()
    }

    #[test]
    fn every_method_has_a_panel_with_line_and_band() {
        let flight = flight();
        let settings =
            RadarSettings::paper(NoiseLevel::High, NoiseTable::Radians, SamplingRate::HALF, 7);
        let readings = sample_radar(&flight, &settings);
        let seen: Vec<_> = readings.iter().map(Option::is_some).collect();
        let tracks = Method::PAPER
            .map(|method| (method, steps(&flight, &seen)))
            .to_vec();
        let example = Example {
            flight: &flight,
            noise: NoiseLevel::High,
            rate: SamplingRate::HALF,
            readings,
            tracks,
        };
        let text = draw(&[example]);
        for method in Method::PAPER {
            assert!(text.contains(&format!(">{method}</text>")), "{method}");
        }
        assert_eq!(text.matches(">mean 0.50 m</text>").count(), 5);
        // One band a method; readings with 100 m noise mostly leave the view, and that is said.
        assert_eq!(text.matches("fill-opacity=\"0.2\"").count(), 5);
        assert!(text.contains(" readings outside"));
        // All five are as near; three are enough. The radar is 20 m from the middle of a circle of 5 m.
        assert!(text.contains("radar, "), "{text}");
    }

    #[test]
    fn gaps_reach_half_a_step_beyond_their_samples() {
        let flight = flight();
        let mut seen = vec![true; 150];
        seen[10..15].fill(false);
        seen[149] = false;
        let gaps = gaps_s(&steps(&flight, &seen));
        assert_eq!(gaps.len(), 2);
        assert!((gaps[0].0 - 0.95).abs() < 1e-9 && (gaps[0].1 - 1.45).abs() < 1e-9);
        assert!((gaps[1].1 - 14.9).abs() < 1e-9);
    }

    /// With equal axes the approximation is exact: chi-square with three degrees of freedom.
    #[test]
    fn the_band_of_a_round_covariance_is_the_chi_distribution() {
        let (low, high) = claimed_errors_m(&(Matrix3::identity() * 4.0));
        assert!((low - 2.0 * 0.351_846_f64.sqrt()).abs() < 1e-5);
        assert!((high - 2.0 * 7.814_728_f64.sqrt()).abs() < 1e-5);
    }
}
