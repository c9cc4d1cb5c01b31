//! Error, consistency and coverage of every method over noise levels and sampling rates.

use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::NoiseLevel;

use crate::method::Method;
use crate::plot::method_rows::{self, Group, LEFT, Measure, Near};
use crate::plot::svg::Svg;
use crate::scoring::cell::{Cell, CellMetrics};

const HEADER: f64 = 78.0;

/// What a block shows of a cell.
type Value = fn(&CellMetrics) -> f64;

/// What is shown, from top to bottom.
const MEASURES: [(Value, Measure); 3] = [
    (
        |metrics| metrics.ed_mean_m,
        Measure {
            title: "Mean distance to the truth (ED)",
            axis: "ED, m",
            near: Near::AboveBest(50.0),
            ideal: None,
        },
    ),
    (
        |metrics| metrics.nees_mean,
        Measure {
            title: "Consistency: mean squared Mahalanobis distance (NEES; ideal 3, above it overconfident)",
            axis: "NEES",
            near: Near::Magnified(1.8, 5.2),
            ideal: Some(3.0),
        },
    ),
    (
        |metrics| metrics.coverage90,
        Measure {
            title: "Coverage: part of the truths inside the 90% ellipsoid (ideal 0.9)",
            axis: "coverage",
            near: Near::MagnifiedPart(0.78, 1.02),
            ideal: Some(0.9),
        },
    ),
];

/// A line below which the mean ED of a block cannot be: noise level, rate, metres.
pub type Floor = (NoiseLevel, SamplingRate, f64);

/// The figure over `cells`; methods, noise levels and rates appear in their order. `floors` may be
/// empty.
pub fn draw(cells: &[Cell], floors: &[Floor]) -> String {
    let methods = in_order(cells.iter().map(|cell| cell.method));
    let noises = in_order(cells.iter().map(|cell| cell.noise));
    let rates = in_order(cells.iter().map(|cell| cell.rate));
    let groups = |number: usize, value: Value| -> Vec<Group> {
        let group = |noise: &NoiseLevel| {
            let at =
                |method: &Method, rate: &SamplingRate| find(cells, *method, *noise, *rate, value);
            let row = |method: &Method| {
                let values = rates.iter().map(|rate| at(method, rate));
                (*method, values.collect())
            };
            let floor = |rate: &SamplingRate| {
                let own = floors.iter();
                let own = own.filter(|floor| (floor.0, floor.1) == (*noise, *rate));
                own.map(|floor| floor.2).next().unwrap_or(f64::NAN)
            };
            Group {
                title: format!("{noise} noise"),
                rows: methods.iter().map(row).collect(),
                bound: match number {
                    0 if !floors.is_empty() => rates.iter().map(floor).collect(),
                    _ => Vec::new(),
                },
            }
        };
        noises.iter().map(group).collect()
    };
    let blocks: Vec<(Vec<Group>, Measure)> = MEASURES
        .iter()
        .enumerate()
        .map(|(number, (value, measure))| (groups(number, *value), *measure))
        .collect();
    let height: f64 = blocks
        .iter()
        .map(|(groups, _)| method_rows::height(groups))
        .sum();
    let mut svg = Svg::new(
        method_rows::width(noises.len()),
        HEADER + height,
        "Metrics of every method by noise level and sampling rate",
        "Three blocks: mean distance, NEES, coverage. A row per method, two panels per noise level: the whole range \
         on the left, what lies near the best on the right; three marks a row, one per sampling rate.",
    );
    svg.heading(
        (LEFT, 26.0),
        "Every method by noise level and sampling rate",
    );
    let places: Vec<_> = rates.iter().map(|rate| format!("rate {rate}")).collect();
    svg.note((LEFT, 50.0), &method_rows::note(&places));
    let mut top = HEADER;
    for (groups, measure) in &blocks {
        method_rows::draw(&mut svg, top, measure, groups);
        top += method_rows::height(groups);
    }
    svg.finish()
}

fn find(
    cells: &[Cell],
    method: Method,
    noise: NoiseLevel,
    rate: SamplingRate,
    value: Value,
) -> f64 {
    cells
        .iter()
        .find(|cell| cell.method == method && cell.noise == noise && cell.rate == rate)
        .filter(|cell| cell.metrics.is_tracked())
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
        // In both panels; the bound lies left of the narrow one.
        assert_eq!(markers, 2 * (3 * 45 - 3) + 1);
        assert!(text.contains("<title>bound: 0.0500</title>"));
        assert!(text.contains("<title>EKF: 0.1000</title>"));
        assert!(text.contains("from the top: rate 1.00, rate 0.75, rate 0.50."));
        assert!(!text.contains("NaN"));
    }

    #[test]
    fn no_cells_make_an_empty_figure() {
        assert!(draw(&[], &[]).ends_with("</svg>\n"));
    }
}
