//! The results as text for a terminal: one block per noise level and sampling rate.

use std::fmt::Write as _;

use crate::scoring::cell::Cell;

/// The table of `cells`, which are grouped by noise level and rate in their order. The smallest
/// mean ED of a block carries a star, if its method has tracked at all. Refused are estimates that were refused or unusable, untracked
/// are steps as [`crate::contest::loss`] has them, outside are those that the method was not trained for.
pub fn render(cells: &[Cell]) -> String {
    let mut text = format!(
        "{:<16}{:>11}{:>11}{:>9}{:>11}{:>10}{:>9}{:>14}{:>9}{:>9}{:>10}{:>10}{:>9}\n{:<16}{:>11}{:>11}{:>9}{:>11}{:>10}{:>9}{:>14}{:>9}{:>9}{:>10}{:>10}{:>9}\n",
        "method",
        "ED mean",
        "ED median",
        "D mean",
        "NEES",
        "coverage",
        "NLL",
        "det P median",
        "refused",
        "rejected",
        "restarted",
        "untracked",
        "outside",
        "",
        "m",
        "m",
        "(1.596)",
        "(3)",
        "(90%)",
        "nats",
        "m^6",
        "steps",
        "steps",
        "steps",
        "steps",
        "steps",
    );
    let same_block = |a: &Cell, b: &Cell| a.noise == b.noise && a.rate == b.rate;
    for block in cells.chunk_by(same_block) {
        let Cell {
            noise,
            rate,
            metrics,
            ..
        } = block[0];
        let title = format!("{noise} noise, rate {rate}, {} steps", metrics.steps);
        let best = block
            .iter()
            .filter(|cell| cell.metrics.is_tracked())
            .map(|cell| cell.metrics.ed_mean_m)
            .fold(f64::INFINITY, f64::min);
        line(&mut text, format_args!("\n{title}"));
        for Cell {
            method, metrics, ..
        } in block
        {
            let is_best = metrics.ed_mean_m == best && metrics.is_tracked();
            let star = if is_best { "*" } else { " " };
            line(
                &mut text,
                format_args!(
                    "  {method:<14}{:>10}{star}{:>11}{:>9}{:>11}{:>10}{:>9}{:>14}{:>9}{:>9}{:>10}{:>10}{:>9}",
                    number(metrics.ed_mean_m),
                    number(metrics.ed_median_m),
                    number(metrics.d_mean),
                    number(metrics.nees_mean),
                    format!("{:.1}%", 100.0 * metrics.coverage90),
                    number(metrics.nll),
                    number(metrics.det_p_median_m6),
                    metrics.diverged,
                    metrics.rejected,
                    metrics.restarted,
                    metrics.not_tracked,
                    metrics.outside,
                ),
            );
        }
    }
    text
}

fn line(text: &mut String, content: std::fmt::Arguments<'_>) {
    // Writing to a String cannot fail.
    writeln!(text, "{content}").expect("a String grows");
}

/// Three digits after the point below 10, two below 100, one below 10,000; from there on, and below 0.01 but for 0,
/// three significant ones in scientific notation; a dash for what is not finite. The report's script (`text` in
/// `page.js`) writes its other measures the same way.
pub fn number(value: f64) -> String {
    let size = value.abs();
    if !value.is_finite() {
        "-".to_owned()
    } else if size != 0.0 && !(0.01..10_000.0).contains(&size) {
        format!("{value:.2e}")
    } else if size < 10.0 {
        format!("{value:.3}")
    } else if size < 100.0 {
        format!("{value:.2}")
    } else {
        format!("{value:.1}")
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::NoiseLevel;

    use super::{number, render};
    use crate::method::Method;
    use crate::scoring::cell::{Cell, CellMetrics};

    fn cell(method: Method, noise: NoiseLevel, ed_mean_m: f64) -> Cell {
        let metrics = CellMetrics {
            steps: 149,
            ed_mean_m,
            ed_median_m: 0.2,
            d_mean: 1.5,
            nees_mean: 123_456.0,
            coverage90: 0.875,
            nll: -3.25,
            det_p_median_m6: 3e-8,
            diverged: 2,
            rejected: 30,
            restarted: 10,
            not_tracked: 41,
            outside: 7,
        };
        Cell {
            method,
            noise,
            rate: SamplingRate::HALF,
            metrics,
            bins: Vec::new(),
        }
    }

    #[test]
    fn blocks_have_one_title_and_a_star_at_the_best() {
        let text = render(&[
            cell(Method::Ekf, NoiseLevel::Low, 0.5),
            cell(Method::Bnkf, NoiseLevel::Low, 0.25),
            cell(Method::Ekf, NoiseLevel::High, 35.0),
        ]);
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines[3], "low noise, rate 0.50, 149 steps");
        let ekf = "  EKF                0.500       0.200    1.500     1.23e5     87.5%   -3.250       3.00e-8        2       30        10        41        7";
        assert_eq!(lines[4], ekf);
        assert!(lines[5].starts_with("  BNKF               0.250* "));
        assert_eq!(lines[7], "high noise, rate 0.50, 149 steps");
        assert!(lines[8].contains("35.00* "));
    }

    /// The first estimate of a method that refused all others is held, and may lie well by chance.
    #[test]
    fn who_tracked_nothing_has_no_star() {
        let mut held = cell(Method::Bnn, NoiseLevel::Low, 0.25);
        held.metrics.diverged = held.metrics.steps;
        held.metrics.not_tracked = held.metrics.steps;
        let text = render(&[held.clone(), cell(Method::Ekf, NoiseLevel::Low, 0.5)]);
        assert!(text.contains("0.250 ") && text.contains("0.500*"), "{text}");
        assert!(!render(&[held]).contains('*'));
    }

    #[test]
    fn digits_after_the_point_get_fewer_as_numbers_grow() {
        let cases = [
            (0.0, "0.000"),
            (0.1234, "0.123"),
            (12.345, "12.35"),
            (f64::NAN, "-"),
        ];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
        assert_eq!(number(0.009), "9.00e-3");
        assert_eq!(number(9_999.0), "9999.0");
    }
}
