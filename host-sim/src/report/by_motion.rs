//! Results by the target's true speed and acceleration: as text, on the page and as CSV.

use std::fmt::Write as _;

use bnkf_model_export::radar::noise::NoiseTable;
use bnkf_model_export::scoring::means::Means;

use crate::csv_text::{self, csv};
use crate::method::Method;
use crate::report::noise_table_name::spelt;
use crate::report::swatch::swatched;
use crate::report::table::number;
use crate::scoring::bin::By;
use crate::scoring::binned::{BinSums, Pooled, STEPS_MIN, over_rates};
use crate::scoring::cell::Cell;

/// Methods that text, page and figures show when more took part than these are: those whose
/// covariance is honest somewhere, or the axes would show nothing of them. The CSV file has all.
const SHOWN: [Method; 6] = [
    Method::EkfTuned,
    Method::UkfTuned,
    Method::Imm5,
    Method::Imm10,
    Method::Particle,
    Method::Recursive,
];

/// The methods of `cells` that are shown, the sampling rates of each noise level together; grouped
/// by noise level.
pub fn shown(cells: &[Cell]) -> Vec<Vec<Pooled>> {
    let pooled = over_rates(cells);
    let mut groups: Vec<Vec<Pooled>> = pooled
        .chunk_by(|a, b| a.noise == b.noise)
        .map(<[Pooled]>::to_vec)
        .collect();
    for group in &mut groups {
        if group.len() > SHOWN.len() {
            group.retain(|own| SHOWN.contains(&own.method));
        }
    }
    groups
}

/// For a terminal: NEES and coverage in every bin of the shown methods.
pub fn text(cells: &[Cell]) -> String {
    let mut text = format!(
        "NEES (3) and coverage (90%) by the target's true motion, all sampling rates; - where fewer than {STEPS_MIN} steps\n"
    );
    for group in shown(cells) {
        let Some(first) = group.first() else { continue };
        for by in By::ALL {
            line(
                &mut text,
                format_args!("\n{} noise, {} in {}", first.noise, by.label(), by.unit()),
            );
            row(&mut text, "", of(first, by).map(|own| own.bin.to_string()));
            let steps = of(first, by).map(|own| own.means().steps.to_string());
            row(&mut text, "steps", steps);
            for own in &group {
                row(
                    &mut text,
                    own.method.label(),
                    of(own, by).map(nees_and_coverage),
                );
            }
        }
    }
    text
}

/// For the page: the same, both quantities side by side.
pub fn html(cells: &[Cell], table: NoiseTable) -> String {
    let mut html = format!("<h3>Angle figures as {}</h3>\n", spelt(table));
    for group in shown(cells) {
        let Some(first) = group.first() else { continue };
        html += "<div class=\"scroll\"><table>\n<thead><tr>";
        line(
            &mut html,
            format_args!("<th class=\"method\">{} noise</th>", first.noise),
        );
        for by in By::ALL {
            let columns = by.bins().len();
            let head = format_args!(
                "<th class=\"group\" colspan=\"{columns}\">{}, {}</th>",
                by.label(),
                by.unit()
            );
            line(&mut html, head);
        }
        html += "</tr>\n<tr><th class=\"method\">steps</th>";
        for own in &first.bins {
            let steps = own.means().steps;
            line(
                &mut html,
                format_args!("<th{}>{}<br>{steps}</th>", edge(own), own.bin),
            );
        }
        html += "</tr></thead>\n<tbody>\n";
        for own in &group {
            line(
                &mut html,
                format_args!("<tr><th class=\"method\">{}</th>", swatched(own.method)),
            );
            for bin in &own.bins {
                line(
                    &mut html,
                    format_args!("<td{}>{}</td>", edge(bin), on_page(bin)),
                );
            }
            html += "</tr>\n";
        }
        html += "</tbody></table></div>\n";
    }
    html
}

/// Every method: each condition by itself, then each noise level with its rates together.
pub fn file<'a>(tables: impl Iterator<Item = (NoiseTable, &'a [Cell])>) -> Vec<u8> {
    let header = [
        "noise_table",
        "noise",
        "rate",
        "method",
        "by",
        "low",
        "high",
        "steps",
        "ed_mean_m",
        "nees_mean",
        "coverage90",
        "nll",
    ];
    let mut rows = Vec::new();
    for (table, cells) in tables {
        let mut add = |noise: String, rate: String, method: Method, bins: &[BinSums]| {
            for own in bins {
                let place = [
                    table.to_string(),
                    noise.clone(),
                    rate.clone(),
                    method.to_string(),
                ];
                let mut row = place.to_vec();
                row.push(own.bin.by.label().to_owned());
                row.extend([own.bin.low, own.bin.high].map(csv_text::number));
                let Means {
                    steps,
                    distance_m,
                    nees,
                    coverage90,
                    surprise,
                } = own.means();
                row.push(steps.to_string());
                row.extend([distance_m, nees, coverage90, surprise].map(csv_text::number));
                rows.push(row);
            }
        };
        for cell in cells {
            add(
                cell.noise.to_string(),
                cell.rate.to_string(),
                cell.method,
                &cell.bins,
            );
        }
        for own in over_rates(cells) {
            add(
                own.noise.to_string(),
                "all".to_owned(),
                own.method,
                &own.bins,
            );
        }
    }
    csv(&header, rows.into_iter())
}

fn of(pooled: &Pooled, by: By) -> impl Iterator<Item = &BinSums> {
    pooled.bins.iter().filter(move |own| own.bin.by == by)
}

/// The first bin of a quantity stands apart from the last of another.
fn edge(own: &BinSums) -> &'static str {
    if own.bin.low == 0.0 {
        " class=\"first\""
    } else {
        ""
    }
}

fn nees_and_coverage(own: &BinSums) -> String {
    own.telling().map_or("-".to_owned(), |means| {
        format!("{} {:.0}%", number(means.nees), 100.0 * means.coverage90)
    })
}

fn on_page(own: &BinSums) -> String {
    own.telling().map_or("-".to_owned(), |means| {
        format!(
            "<span title=\"ED {} m, NLL {} nats\">{}<br>{:.0}%</span>",
            number(means.distance_m),
            number(means.surprise),
            number(means.nees),
            100.0 * means.coverage90,
        )
    })
}

fn row(text: &mut String, name: &str, values: impl Iterator<Item = String>) {
    let values: String = values.map(|value| format!("{value:>14}")).collect();
    line(text, format_args!("  {name:<12}{values}"));
}

fn line(text: &mut String, content: std::fmt::Arguments<'_>) {
    // Writing to a String cannot fail.
    writeln!(text, "{content}").expect("a String grows");
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Motion;
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
    use bnkf_model_export::scoring::step_score::StepScore;
    use clap::ValueEnum;

    use super::{SHOWN, file, html, shown, text};
    use crate::method::Method;
    use crate::scoring::binned::binned;
    use crate::scoring::cell::{Cell, CellMetrics};

    /// 150 steps at 5 m/s and 9 m/s^2, at each of two rates.
    fn cells(methods: &[Method]) -> Vec<Cell> {
        let motion = Motion {
            speed_mps: 5.0,
            acceleration_mps2: 9.0,
        };
        let score = StepScore {
            error_m: 0.5,
            mahalanobis_squared: 3.25,
            det_p_m6: 1.0,
        };
        let rates = [SamplingRate::FULL, SamplingRate::HALF];
        let cell = |rate| {
            move |method: &Method| Cell {
                method: *method,
                noise: NoiseLevel::Low,
                rate,
                metrics: CellMetrics::new(&[]),
                bins: binned(std::iter::repeat_n((motion, score), 150)),
            }
        };
        rates
            .into_iter()
            .flat_map(|rate| methods.iter().map(cell(rate)))
            .collect()
    }

    #[test]
    fn only_rates_together_tell_here() {
        let cells = cells(&[Method::Ekf, Method::Bnkf]);
        let text = text(&cells);
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines[2], "low noise, speed in m/s");
        assert_eq!(lines[3].split_whitespace().nth(2), Some("4-6"));
        let steps: Vec<_> = lines[4].split_whitespace().collect();
        assert_eq!(steps, ["steps", "0", "0", "300", "0", "0", "0", "0"]);
        assert_eq!(lines[5].split_whitespace().nth(3), Some("3.250"));
        assert_eq!(lines[5].split_whitespace().nth(4), Some("100%"));
        assert_eq!(lines[8], "low noise, acceleration in m/s²");
        assert!(lines.iter().all(|line| line.chars().count() < 116));
        let page = html(&cells, NoiseTable::Radians);
        assert_eq!(page.matches("3.250<br>100%").count(), 4);
        assert_eq!(page.matches("<td").count(), 26);
    }

    #[test]
    fn the_file_has_every_method_bin_and_rate_and_all_rates() {
        let cells = cells(Method::value_variants());
        let bytes = file([(NoiseTable::Printed, cells.as_slice())].into_iter());
        let mut reader = csv::Reader::from_reader(bytes.as_slice());
        let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
        assert_eq!(rows.len(), 3 * 13 * Method::value_variants().len());
        let all = rows
            .iter()
            .filter(|row| &row[2] == "all" && &row[3] == "IMM5");
        let steps: Vec<_> = all
            .map(|row| [&row[4], &row[5], &row[6], &row[7]])
            .collect();
        assert_eq!(steps[2], ["speed", "4", "6", "300"]);
        assert_eq!(steps[6], ["speed", "12", "", "0"]);
        assert_eq!(steps[9], ["acceleration", "8", "12", "300"]);
        let one = rows.iter().find(|row| &row[5] == "4" && &row[2] == "0.50");
        assert_eq!(&one.unwrap()[7], "150");
    }

    #[test]
    fn of_many_methods_the_useful_ones_are_shown() {
        let all = shown(&cells(Method::value_variants()));
        assert_eq!(all.len(), 1);
        let mut methods: Vec<_> = all[0].iter().map(|own| own.method).collect();
        let mut expected = SHOWN.to_vec();
        methods.sort_unstable();
        expected.sort_unstable();
        assert_eq!(methods, expected);
        assert_eq!(shown(&cells(&Method::PAPER))[0].len(), 5);
    }
}
