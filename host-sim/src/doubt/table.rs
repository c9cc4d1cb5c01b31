//! The study as Markdown and as CSV.

use super::Row;
use crate::csv_text::{self, number};

/// A Markdown table for each world.
pub fn markdown(rows: &[Row]) -> String {
    let mut text = String::new();
    let mut world = "";
    for row in rows {
        if row.world != world {
            world = &row.world;
            text += &format!(
                "\n### {world}\n\n\
                 | noise | entry | distance, m | NEES | coverage 90 % | against the first | surprise against the first, nats | jerk doubt, m/s^3 | share of noise |\n\
                 |---|---|---|---|---|---|---|---|---|\n"
            );
        }
        let d = &row.doubt;
        let (coverage, surprise) = (&d.coverage90_gain, &d.surprise_gain);
        text += &format!(
            "| {} | {} | {:.3} | {:.2} | {:.1} | {:+.1} ({:+.1} .. {:+.1}) | {:+.3} ({:+.3} .. {:+.3}) | {:.2} | {:.1} % |\n",
            row.noise,
            row.entry.replace('|', "\\|"),
            d.distance_m,
            d.nees,
            100.0 * d.coverage90,
            100.0 * coverage.difference,
            100.0 * coverage.interval.low,
            100.0 * coverage.interval.high,
            surprise.difference,
            surprise.interval.low,
            surprise.interval.high,
            d.jerk_sigma_mps3,
            100.0 * d.noise_share,
        );
    }
    text
}

/// Every number, a line for each row.
pub fn csv(rows: &[Row]) -> Vec<u8> {
    let header = [
        "world",
        "noise",
        "entry",
        "ed_m",
        "nees",
        "coverage90",
        "coverage90_low",
        "coverage90_high",
        "surprise_nats",
        "jerk_sigma_mps3",
        "noise_share",
        "coverage90_gain",
        "coverage90_gain_low",
        "coverage90_gain_high",
        "surprise_gain_nats",
        "surprise_gain_low",
        "surprise_gain_high",
        "flights",
    ];
    let row = |row: &Row| {
        let d = &row.doubt;
        let (coverage, surprise) = (&d.coverage90_gain, &d.surprise_gain);
        let numbers = [
            d.distance_m,
            d.nees,
            d.coverage90,
            d.coverage90_interval.low,
            d.coverage90_interval.high,
            d.surprise,
            d.jerk_sigma_mps3,
            d.noise_share,
            coverage.difference,
            coverage.interval.low,
            coverage.interval.high,
            surprise.difference,
            surprise.interval.low,
            surprise.interval.high,
        ];
        let mut fields = vec![row.world.clone(), row.noise.to_string(), row.entry.clone()];
        fields.extend(numbers.map(number));
        fields.push(surprise.clusters.to_string());
        fields
    };
    csv_text::csv(&header, rows.iter().map(row))
}
