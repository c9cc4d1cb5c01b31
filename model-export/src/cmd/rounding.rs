//! What rounding a memoryless model costs, in tables for people.

use super::flight_source::NamedFlights;
use crate::blob::quantise::{LayerError, layer_errors, quantise};
use crate::memoryless::example::ExampleSettings;
use crate::memoryless::verification::{
    Comparison, SHIFT_MAX, SIGMA_ERROR_MAX, Summary, compare, measured_rows,
};
use crate::posterior::gaussian_weights::GaussianWeights;
use crate::radar::noise::{NoiseLevel, NoiseTable};
use bnkf::blob::Blob;

/// Flights when none are named; no shipped model was trained on their seed.
pub const BUILTIN_FLIGHTS: usize = 20;
/// Their seed.
pub const BUILTIN_SEED: u64 = 424_242;

/// How a blob is compared with its unrounded weights.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// How the angle figures of the noise levels are read.
    pub noise_table: NoiseTable,
    /// Measurements per noise level.
    pub rows: u16,
    /// Passes for each predictive standard deviation.
    pub passes: u16,
    /// Moments of the blob in place of its passes.
    pub moments: bool,
    /// Seed of the radar's noise.
    pub seed: u64,
}

/// How far rounding moves the estimates.
#[derive(Clone, Debug)]
pub struct Rounding {
    /// For each noise level.
    pub table: String,
    /// Whether that stays within the limits of `verify`.
    pub is_accepted: bool,
}

impl Rounding {
    /// Of the measurements of `named` flights.
    #[must_use]
    pub fn of(
        blob: &Blob<'_>,
        networks: &[GaussianWeights],
        named: &NamedFlights,
        way: &Way,
    ) -> Self {
        let mut all = Vec::new();
        let mut text = format!(
            "\n{:<8}{:>8}{:>12}{:>12}{:>14}{:>18}\n",
            "noise", "values", "shift mean", "shift p95", "sigma ratio", "ratio p5 .. p95"
        );
        let settings = ExampleSettings {
            layout: blob.features(),
            table: way.noise_table,
            // Only the loss depends on it.
            range_spread_m: 1.0,
        };
        for level in NoiseLevel::ALL {
            let count = usize::from(way.rows);
            let rows = measured_rows(blob, &named.flights, level, &settings, count, way.seed);
            let pairs = blob.networks().zip(networks);
            let found: Vec<Comparison> = pairs
                .flat_map(|(view, weights)| compare(view, weights, &rows, way.passes, way.moments))
                .collect();
            text += &summary_line(&level.to_string(), &found);
            all.extend(found);
        }
        text += &summary_line("all", &all);
        text += &format!(
            "\nshift: |estimate of the blob - estimate of the unrounded weights| at the mean weights, in predictive\n\
             sigmas; accepted up to {SHIFT_MAX} on average, and a mean sigma ratio within {SIGMA_ERROR_MAX} of 1 ({}, {} passes{})\n",
            named.source,
            way.passes,
            if way.moments {
                ", the blob's sigma from moments"
            } else {
                ""
            }
        );
        Self {
            table: text,
            is_accepted: Summary::of(&all).is_some_and(|summary| summary.accepted()),
        }
    }
}

/// What rounding did to every layer of `networks`.
#[must_use]
pub fn layer_table(networks: &[GaussianWeights]) -> String {
    let errors = networks
        .iter()
        .flat_map(|weights| layer_errors(weights, &quantise(weights)));
    let errors: Vec<LayerError> = errors.collect();
    let mut text = format!(
        "{:>9}{:>16}{:>16}{:>17}{:>16}{:>10}\n",
        "layer", "mean rms/rms", "mean max/step", "mean rms/sigma", "ln sigma max", "vanished"
    );
    for error in errors {
        let shape = format!("{}x{}", error.outputs, error.inputs);
        let in_sigmas = error.mean_rms_sigmas;
        text += &format!(
            "{shape:>9}{:>16.5}{:>16.3}{:>17}{:>16.4}{:>10}\n",
            error.mean_rms_relative,
            error.mean_max_steps,
            in_sigmas.map_or_else(|| "-".to_owned(), |sigmas| format!("{sigmas:.4}")),
            error.ln_sigma_max,
            error.vanished
        );
    }
    text
}

fn summary_line(name: &str, comparisons: &[Comparison]) -> String {
    match Summary::of(comparisons) {
        None => format!("{name:<8}{:>8}\n", 0),
        Some(s) => format!(
            "{name:<8}{:>8}{:>12.4}{:>12.4}{:>14.4}{:>9.3} .. {:.3}\n",
            s.count,
            s.shift_mean,
            s.shift_p95,
            s.sigma_ratio_mean,
            s.sigma_ratio_p5,
            s.sigma_ratio_p95
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::posterior::architecture::Architecture;
    use crate::random_source::RandomSource;

    #[test]
    fn a_layer_without_variances_has_no_figure_in_sigmas() {
        let architecture = Architecture::new(vec![13, 9, 3]).unwrap();
        let mut random = RandomSource::new(4, &[]);
        let mut weights = GaussianWeights::random(&architecture, 0.02, &mut random);
        let last = weights.architecture.layers()[1].start;
        weights.log_sigmas[last..].fill(f32::NEG_INFINITY);
        let table = layer_table(&[weights]);
        let in_sigmas = |line: &str| line.split_whitespace().nth(3).map(str::to_owned);
        let column: Vec<_> = table.lines().skip(1).filter_map(in_sigmas).collect();
        assert!(
            column[0].parse::<f64>().is_ok_and(f64::is_finite),
            "{table}"
        );
        assert_eq!(column[1], "-", "{table}");
    }
}
