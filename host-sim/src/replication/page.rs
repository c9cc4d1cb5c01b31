//! The replication's page: Markdown whose tables are the results.
//!
//! A reader may write above and below the tables; the command renews what is between the markers
//! and leaves the rest.

use super::entry::Section;
use super::learner::{BATCH_ROWS, RATE};
use super::published::PUBLISHED;
use super::results::{Line, Results};
use super::summary::Summary;

/// First and last line of what the command writes.
const BEGIN: &str = "<!-- made by `host-sim replicate`: begin -->";
const END: &str = "<!-- made by `host-sim replicate`: end -->";

const TITLE: &str = "# The paper, replicated both ways\n";

/// The page: `existing` with its tables renewed, or a new one. `None` if the existing one has no place for them: it is
/// not this command's.
pub fn page(existing: Option<&str>, results: &Results) -> Option<String> {
    let tables = tables(results);
    let Some(existing) = existing else {
        return Some(format!("{TITLE}\n{tables}"));
    };
    let (before, _, after) = parts(existing)?;
    Some(format!("{before}{tables}{after}"))
}

/// Whether a page has a place for the tables.
pub fn has_place(page: &str) -> bool {
    parts(page).is_some()
}

/// The part of a page that the command makes, markers and all.
pub fn made_part(page: &str) -> Option<&str> {
    parts(page).map(|(_, made, _)| made)
}

fn parts(page: &str) -> Option<(&str, &str, &str)> {
    let begin = page.find(BEGIN)?;
    let (before, rest) = page.split_at(begin);
    let mut end = rest.find(END)? + END.len();
    if rest[end..].starts_with('\n') {
        end += 1;
    }
    let (made, after) = rest.split_at(end);
    Some((before, made, after))
}

/// Everything between the markers.
pub fn tables(results: &Results) -> String {
    let made = &results.provenance;
    let mut text = format!("{BEGIN}\n");
    let mut say = |line: &str| {
        text.push_str(line);
        text.push('\n');
    };
    say(
        "\nCells: ED, m / mean D / mean det P, m^6 (median det P), at low, medium and high noise, the",
    );
    say(
        "sampling rates 1.0, 0.75 and 0.5 together. A right covariance has mean D 1.60. \"Left out\":",
    );
    say("estimates dropped as outliers or not numbers.");
    if made.quick {
        say("\n**A quick run: fewer flights and epochs, rough figures.**");
    }
    say("\n## Published\n");
    say("| | low | medium | high |\n|---|---|---|---|");
    for (method, levels) in PUBLISHED {
        let cells = levels.map(|figures| figures.join(" / "));
        say(&format!("| {method} | {} |", cells.join(" | ")));
    }
    for section in Section::ALL {
        let lines: Vec<&Line> = results
            .lines
            .iter()
            .filter(|line| line.section == section)
            .collect();
        say(&format!(
            "\n## {}\n\n{}\n",
            section.title(),
            section.explanation()
        ));
        say("| | low | medium | high | left out, % |\n|---|---|---|---|---|");
        let base = lines.first().filter(|_| section.compares());
        for (index, line) in lines.iter().enumerate() {
            let compared = base.filter(|_| index > 0);
            let cells: Vec<String> = (0..line.cells.len())
                .map(|level| cell(&line.cells[level], compared.map(|base| &base.cells[level])))
                .collect();
            let left_out = line.cells.map(|summary| left_out(&summary));
            say(&format!(
                "| {} | {} | {} |",
                line.label,
                cells.join(" | "),
                left_out.join(" / ")
            ));
        }
    }
    say("\n## How it was made\n");
    say(&format!(
        "- Command: `{}`, version {}, tree {}",
        made.command, made.version, made.tree
    ));
    say(&format!(
        "- Seed {}; flights: {}, SHA-256 {}",
        made.seed, made.data, made.data_sha256
    ));
    say(&format!(
        "- {} segments of {} recordings; one of {} folds tested, the others train; {} did not fit",
        made.flights, made.recordings, made.folds, made.unplaced
    ));
    say(&format!(
        "- {} epochs, minibatches of {BATCH_ROWS}, Adam at {RATE} falling to 0; {} Monte Carlo passes",
        made.epochs, made.passes
    ));
    say("- One network (BNKFe: one set) for each noise level; features and targets normalised");
    text.push_str(END);
    text.push('\n');
    text
}

fn cell(summary: &Summary, base: Option<&Summary>) -> String {
    if summary.scored == 0 {
        return "none left".to_owned();
    }
    let change = base.map_or(String::new(), |base| {
        let percent = 100.0 * (summary.error_m / base.error_m - 1.0);
        format!(", {percent:+.0} %")
    });
    format!(
        "{}{change} / {} / {} ({})",
        three_digits(summary.error_m),
        three_digits(summary.distance),
        three_digits(summary.det_p_mean_m6),
        three_digits(summary.det_p_median_m6),
    )
}

fn left_out(summary: &Summary) -> String {
    let lost = summary.dropped + summary.unusable;
    let share = 100.0 * lost as f64 / (summary.scored + lost).max(1) as f64;
    if lost > 0 && share < 0.1 {
        "<0.1".to_owned()
    } else if lost == 0 {
        "0".to_owned()
    } else {
        format!("{share:.1}")
    }
}

/// About three significant digits, plain where that is short.
fn three_digits(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if !(0.001..1e5).contains(&size) => format!("{value:.2e}"),
        size if size < 0.1 => format!("{value:.3}"),
        size if size < 10.0 => format!("{value:.2}"),
        size if size < 100.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

#[cfg(test)]
mod tests {
    use super::{BEGIN, END, cell, left_out, made_part, page, three_digits};
    use crate::replication::entry::{Section, entries};
    use crate::replication::results::{Provenance, Results};
    use crate::replication::summary::Summary;

    fn results() -> Results {
        let summary = |error_m| Summary {
            scored: 90,
            dropped: 9,
            unusable: 1,
            error_m,
            distance: 1.6,
            distance_squared: 3.0,
            det_p_mean_m6: 2.5e-8,
            det_p_median_m6: 1234.5,
        };
        let entries = entries(true);
        let cells = (0..entries.len()).map(|i| [1.0, 2.0, 3.0 + i as f64].map(summary));
        let provenance = Provenance {
            command: "host-sim replicate".to_owned(),
            version: "1".to_owned(),
            tree: "abc".to_owned(),
            seed: 1,
            data: "built-in".to_owned(),
            data_sha256: "f00".to_owned(),
            flights: 10,
            recordings: 10,
            unplaced: 0,
            folds: 5,
            epochs: 2,
            passes: 3,
            quick: true,
        };
        Results::new(provenance, &entries, cells.collect())
    }

    #[test]
    fn a_new_page_holds_every_line_and_an_old_one_keeps_its_prose() {
        let results = results();
        let new = page(None, &results).expect("a new page");
        for line in &results.lines {
            assert!(
                new.contains(&format!("| {} | 1.00", line.label)),
                "{}",
                line.label
            );
        }
        assert!(new.contains("A quick run") && new.contains("f00"));
        assert!(new.contains("1.00 / 1.60 / 2.50e-8 (1234)"), "{new}");
        let old = format!("# Mine\n\nprose\n\n{BEGIN}\nold\n{END}\nmore\n");
        let renewed = page(Some(&old), &results).expect("markers");
        assert!(renewed.starts_with("# Mine\n\nprose\n") && renewed.ends_with("more\n"));
        assert_eq!(made_part(&renewed), made_part(&new));
        assert!(!renewed.contains("old\n"));
        // Where the last line has no end, and where a letter follows that is longer than a byte.
        for after in ["", "é"] {
            let old = format!("# Mine\n{BEGIN}\nold\n{END}{after}");
            let renewed = page(Some(&old), &results).expect("markers");
            assert!(renewed.starts_with("# Mine\n") && renewed.ends_with(after));
            assert!(!renewed.contains("old\n"));
        }
        // A page without markers is no page of ours.
        assert_eq!(page(Some("other"), &results), None);
    }

    #[test]
    fn ablations_state_the_change_beside_their_first_line() {
        let results = results();
        let text = page(None, &results).expect("a new page");
        let base = results
            .lines
            .iter()
            .position(|l| l.section == Section::FromPaper)
            .unwrap();
        let change = 100.0 / (3.0 + base as f64);
        assert!(text.contains(&format!(", {change:+.0} %")), "{text}");
    }

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (0.05, "0.050"),
            (1.234, "1.23"),
            (35.16, "35.2"),
            (15_740.0, "15740"),
            (3.02e-8, "3.02e-8"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(three_digits(value), text);
        }
        let summary = results().lines[0].cells[0];
        assert_eq!(left_out(&summary), "10.0");
        let emptied = Summary {
            scored: 0,
            ..summary
        };
        assert_eq!(
            (cell(&emptied, None).as_str(), left_out(&emptied).as_str()),
            ("none left", "100.0")
        );
    }

    #[test]
    fn results_survive_their_json_and_the_table_has_a_row_for_each_cell() {
        let results = results();
        let back: Results = serde_json::from_slice(&results.json()).unwrap();
        assert_eq!(back, results);
        let rows = results.csv().split(|byte| *byte == b'\n').count();
        // A header before, and nothing after the last line's end.
        assert_eq!(rows, 1 + 3 * results.lines.len() + 1);
    }
}
