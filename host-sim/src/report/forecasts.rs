//! Forecasts as a table: a block for every condition, distance and coverage for every horizon.

use std::fmt::Write as _;

use super::swatch::swatched;
use super::table::number;
use crate::filter::HORIZONS_US;
use crate::scoring::forecast::ForecastCell;

/// For a terminal. `cells` are ordered by condition, then method, then horizon. Nothing if there are
/// none.
pub fn text(cells: &[ForecastCell]) -> String {
    let mut text = String::new();
    for block in blocks(cells) {
        let condition = block[0].condition;
        if text.is_empty() {
            text += "Forecasts: mean distance, m, NEES and coverage of the 90% ellipsoid\n";
        }
        let title = format!("{} noise, rate {}", condition.noise, condition.rate);
        let _ = write!(text, "{title:<26}");
        for cell in horizons(block) {
            let ahead = format!("{} s ahead", cell.horizon_s);
            let _ = write!(text, "{ahead:>24}");
        }
        text.push('\n');
        for own in block.chunks(HORIZONS_US.len()) {
            let _ = write!(text, "{:<26}", own[0].method.label());
            for cell in own {
                let m = &cell.metrics;
                let coverage = 100.0 * m.coverage90;
                let _ = write!(
                    text,
                    "{:>10} {:>8} {coverage:>3.0}%",
                    number(m.ed_mean_m),
                    number(m.nees_mean)
                );
            }
            text.push('\n');
        }
    }
    text
}

/// For the page.
pub fn html(cells: &[ForecastCell]) -> String {
    let mut html = String::new();
    for block in blocks(cells) {
        let condition = block[0].condition;
        html += "<div class=\"scroll\"><table>\n<thead><tr>";
        let _ = write!(
            html,
            "<th class=\"method\">{} noise, rate {}</th>",
            condition.noise, condition.rate
        );
        for cell in horizons(block) {
            let _ = write!(
                html,
                "<th class=\"first\">{} s: distance, m</th><th>NEES</th><th>inside 90%</th>",
                cell.horizon_s
            );
        }
        html += "</tr></thead>\n<tbody>\n";
        for own in block.chunks(HORIZONS_US.len()) {
            let _ = write!(
                html,
                "<tr><th class=\"method\">{}</th>",
                swatched(own[0].method)
            );
            for cell in own {
                let m = &cell.metrics;
                let _ = write!(
                    html,
                    "<td class=\"first\">{:.3}</td><td>{:.2}</td><td>{:.0}%</td>",
                    m.ed_mean_m,
                    m.nees_mean,
                    100.0 * m.coverage90
                );
            }
            html += "</tr>\n";
        }
        html += "</tbody></table></div>\n";
    }
    html
}

/// The cells of each condition, those without forecasts left out.
fn blocks(cells: &[ForecastCell]) -> impl Iterator<Item = &[ForecastCell]> {
    let blocks = cells.chunk_by(|a, b| a.condition == b.condition);
    blocks.filter(|block| block.iter().any(|cell| cell.metrics.forecasts > 0))
}

/// One cell for every horizon.
fn horizons(block: &[ForecastCell]) -> &[ForecastCell] {
    &block[..HORIZONS_US.len().min(block.len())]
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
    use bnkf_model_export::scoring::step_score::StepScore;

    use super::{html, text};
    use crate::method::Method;
    use crate::scenario::radar::Condition;
    use crate::scoring::forecast::{ForecastCell, ScoredForecast};

    #[test]
    fn every_horizon_has_its_place() {
        let condition = Condition {
            table: NoiseTable::Radians,
            noise: NoiseLevel::Low,
            rate: SamplingRate::HALF,
        };
        let forecast = |horizon| ScoredForecast {
            horizon,
            score: StepScore {
                error_m: 1.25 * horizon as f64,
                mahalanobis_squared: 3.0,
                det_p_m6: 1.0,
            },
            diverged: false,
        };
        let all = [forecast(0), forecast(1), forecast(2)];
        let cells = ForecastCell::all(Method::Imm5, condition, &all.iter().collect::<Vec<_>>());
        let lines: Vec<_> = text(&cells).lines().map(str::to_owned).collect();
        let words = |line: &str| {
            line.split_whitespace()
                .map(str::to_owned)
                .collect::<Vec<_>>()
        };
        assert_eq!(lines.len(), 3);
        assert_eq!(
            words(&lines[1])[..6],
            ["low", "noise,", "rate", "0.50", "0.5", "s"]
        );
        let row = [
            "IMM5", "0.000", "3.000", "100%", "1.250", "3.000", "100%", "2.500", "3.000", "100%",
        ];
        assert_eq!(words(&lines[2]), row);
        // Of a method that is lost every number is large, and still one by itself.
        let lost = all.map(|mut forecast| {
            forecast.score.error_m = 8_397.110_875;
            forecast.score.mahalanobis_squared = 592_424.4;
            forecast
        });
        let lost = ForecastCell::all(Method::Imm5, condition, &lost.iter().collect::<Vec<_>>());
        let lost = text(&lost);
        let lost = lost.lines().nth(2).unwrap();
        assert_eq!(words(lost)[1..4], ["8397.1", "5.92e5", "0%"]);
        assert_eq!(lost.len(), lines[2].len());
        let page = html(&cells);
        assert!(
            page.contains("<th class=\"first\">2 s: distance, m</th>"),
            "{page}"
        );
        assert!(page.contains("<td class=\"first\">2.500</td><td>3.00</td><td>100%</td>"));
        let none = ForecastCell::all(Method::Imm5, condition, &[]);
        assert_eq!((text(&none), html(&none)), (String::new(), String::new()));
    }
}
