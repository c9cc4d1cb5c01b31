//! Forecasts of every method: distance and coverage at every horizon.

use bnkf_model_export::radar::noise::NoiseLevel;

use crate::filter::HORIZONS_US;
use crate::plot::method_rows::{self, Group, LEFT, Measure, Near};
use crate::plot::svg::Svg;
use crate::scoring::forecast::{ForecastCell, ForecastMetrics};

const HEADER: f64 = 78.0;
/// What a block shows of a cell.
type Value = fn(&ForecastMetrics) -> f64;

const MEASURES: [(Value, Measure); 2] = [
    (
        |metrics| metrics.ed_mean_m,
        Measure {
            title: "Mean distance of the forecast from the truth (ED)",
            axis: "ED, m",
            near: Near::AboveBest(50.0),
            ideal: None,
        },
    ),
    (
        |metrics| metrics.coverage90,
        Measure {
            title: "Coverage: part of the truths inside the forecast's 90% ellipsoid (ideal 0.9)",
            axis: "coverage",
            near: Near::MagnifiedPart(0.68, 1.02),
            ideal: Some(0.9),
        },
    ),
];

/// The figure over `cells`, all of one noise table and sampling rate, ordered by noise level, method and
/// horizon. Methods that forecast nothing are left out.
pub fn draw(cells: &[ForecastCell]) -> String {
    let rows = |value: Value| -> Vec<Group> {
        let by_noise = cells.chunk_by(|a, b| a.condition.noise == b.condition.noise);
        by_noise
            .map(|own| Group {
                title: title(own[0].condition.noise),
                rows: own
                    .chunks(HORIZONS_US.len())
                    .filter(|of| of.iter().any(|cell| cell.metrics.forecasts > 0))
                    .map(|of| {
                        let made = |m: &ForecastMetrics| m.diverged < m.forecasts;
                        let of_made = |m| if made(m) { value(m) } else { f64::NAN };
                        let values = of.iter().map(|cell| of_made(&cell.metrics));
                        (of[0].method, values.collect())
                    })
                    .collect(),
                bound: Vec::new(),
            })
            .collect()
    };
    let blocks = MEASURES.map(|(value, measure)| (rows(value), measure));
    let height: f64 = blocks
        .iter()
        .map(|(groups, _)| method_rows::height(groups))
        .sum();
    let mut svg = Svg::new(
        method_rows::width(blocks[0].0.len()),
        HEADER + height,
        "Forecasts of every method",
        "Two blocks: mean distance and coverage. A row per method, two panels per noise level: the whole range on \
         the left, what lies near the best on the right; three marks a row, one per horizon.",
    );
    svg.heading((LEFT, 26.0), "Forecasts: where the target will be");
    let ahead = HORIZONS_US.map(|us| format!("{} s ahead", 1e-6 * us as f64));
    svg.note((LEFT, 50.0), &method_rows::note(&ahead));
    let mut top = HEADER;
    for (groups, measure) in &blocks {
        method_rows::draw(&mut svg, top, measure, groups);
        top += method_rows::height(groups);
    }
    svg.finish()
}

fn title(noise: NoiseLevel) -> String {
    format!("{noise} noise")
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
    use bnkf_model_export::scoring::step_score::StepScore;

    use super::draw;
    use crate::method::Method;
    use crate::scenario::radar::Condition;
    use crate::scoring::forecast::{ForecastCell, ScoredForecast};

    #[test]
    fn every_horizon_of_a_method_that_forecasts_is_drawn() {
        let condition = Condition {
            table: NoiseTable::Radians,
            noise: NoiseLevel::Low,
            rate: SamplingRate::FULL,
        };
        let forecast = |horizon: usize| ScoredForecast {
            horizon,
            score: StepScore {
                error_m: 1.0 + horizon as f64,
                mahalanobis_squared: 3.0,
                det_p_m6: 1.0,
            },
            diverged: false,
        };
        let all = [0, 1, 2].map(forecast);
        let mut cells = ForecastCell::all(
            Method::Recursive,
            condition,
            &all.iter().collect::<Vec<_>>(),
        )
        .to_vec();
        cells.extend(ForecastCell::all(Method::Bnn, condition, &[]));
        let text = draw(&cells);
        // In both panels of both blocks.
        assert_eq!(text.matches("<title>recursive: ").count(), 12);
        assert!(!text.contains(">BNN<") && text.contains("0.5 s ahead, 1 s ahead, 2 s ahead."));
        assert!(draw(&[]).ends_with("</svg>\n"));
    }
}
