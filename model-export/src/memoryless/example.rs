//! Training examples in physical units: what the tracker's network sees, and the truth.

use crate::flights::flight::Flight;
use crate::radar::gaps::{SamplingRate, period};
use crate::radar::noise::{NoiseLevel, NoiseSigmas, NoiseTable};
use crate::radar::polar::Polar;
use crate::radar::sampling::{RadarSettings, sample_radar};
use crate::random_source::RandomSource;
use crate::seed;
use bnkf::Measurement;
use bnkf::blob::FeatureLayout;
use bnkf::memoryless::{FEATURES_MAX, PREVIOUS_AGE_MAX_US, Plot, features};

/// Noise level and sampling rate of one pass over a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    /// Noise level.
    pub level: NoiseLevel,
    /// Sampling rate.
    pub rate: SamplingRate,
}

impl Condition {
    /// Three noise levels at three sampling rates.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let rates = |level| SamplingRate::ALL.map(|rate| Self { level, rate });
        NoiseLevel::ALL.into_iter().flat_map(rates).collect()
    }
}

/// How flights become examples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExampleSettings {
    /// Features of the network.
    pub layout: FeatureLayout,
    /// Unit of the noise levels' angle figures.
    pub table: NoiseTable,
    /// Standard deviation of the range over the training flights, metres.
    pub range_spread_m: f64,
}

/// Features of two measurements, not yet normalised, and the position at the second one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Example {
    /// Features; the layout's number of them count.
    pub features: [f32; FEATURES_MAX],
    /// True position, metres.
    pub position_m: [f64; 3],
    /// See [`attainable_variance_m2`].
    pub attainable_variance_m2: f64,
}

/// Every measurement of one pass over `flight` with the one before it. Noise and the place of the
/// gaps depend on `seed`, the flight's name and the condition alone.
#[must_use]
pub fn examples(
    flight: &Flight,
    condition: Condition,
    settings: &ExampleSettings,
    seed: u64,
) -> Vec<Example> {
    let phase_ids = [
        seed::name_id("gap phase"),
        seed::name_id(&flight.name),
        condition.rate.get().to_bits(),
    ];
    let gap_phase = RandomSource::new(seed, &phase_ids).below(period(flight.samples.len()));
    let radar = RadarSettings {
        gap_phase,
        ..RadarSettings::paper(condition.level, settings.table, condition.rate, seed)
    };
    let mut previous: Option<Plot> = None;
    let mut found = Vec::new();
    for (sample, reading) in flight.samples.iter().zip(sample_radar(flight, &radar)) {
        let Some(reading) = reading else { continue };
        // A reading has all four channels.
        let Ok(current) = Plot::of(&Measurement::from(&reading).canonical()) else {
            continue;
        };
        let before = previous
            .filter(|p| current.time_us - p.time_us <= PREVIOUS_AGE_MAX_US)
            .unwrap_or(current);
        let age_s = (current.time_us - before.time_us) as f32 * 1e-6;
        let exact = Polar::of(sample.position_m, sample.velocity_mps);
        found.push(Example {
            features: features(settings.layout, &before, &current, age_s),
            position_m: sample.position_m,
            attainable_variance_m2: attainable_variance_m2(
                exact.range_m,
                &radar.noise,
                settings.range_spread_m,
            ),
        });
        previous = Some(current);
    }
    found
}

/// Variance per axis, m^2, of a position at `range_m` that is measured once with `noise` and known
/// beforehand to within `spread_m` in every direction: roughly what a memoryless estimate can reach.
#[must_use]
pub fn attainable_variance_m2(range_m: f64, noise: &NoiseSigmas, spread_m: f64) -> f64 {
    let fused = |sigma_m: f64| 1.0 / (sigma_m.powi(-2) + spread_m.powi(-2));
    (fused(noise.range_m)
        + fused(range_m * noise.elevation_rad)
        + fused(range_m * noise.azimuth_rad))
        / 3.0
}

#[cfg(test)]
mod tests {
    use super::{Condition, ExampleSettings, attainable_variance_m2, examples};
    use crate::flights::flight::Flight;
    use crate::radar::gaps::SamplingRate;
    use crate::radar::noise::{NoiseLevel, NoiseTable};
    use bnkf::blob::FeatureLayout;

    const SETTINGS: ExampleSettings = ExampleSettings {
        layout: FeatureLayout::Polar13,
        table: NoiseTable::Radians,
        range_spread_m: 8.7,
    };

    fn flight() -> Flight {
        let rows: Vec<[f64; 4]> = (0..100)
            .map(|i| [f64::from(i) * 0.1, 30.0, f64::from(i) * 0.2, 10.0])
            .collect();
        Flight::from_track("f", "f", &rows).unwrap()
    }

    #[test]
    fn each_example_holds_the_measurement_before_and_its_own_truth() {
        let condition = Condition {
            level: NoiseLevel::Low,
            rate: SamplingRate::HALF,
        };
        let found = examples(&flight(), condition, &SETTINGS, 3);
        // Of every ten samples five are measured; the first always is.
        assert!((50..=51).contains(&found.len()), "{}", found.len());
        assert_eq!(found[0].features[..4], found[0].features[4..8]);
        assert_eq!(found[0].features[12], 0.0);
        for pair in found.windows(2) {
            assert_eq!(pair[1].features[0], pair[0].features[4]);
            let [dt_s, step_s] = [
                pair[1].features[12],
                (pair[1].position_m[1] - pair[0].position_m[1]) as f32 / 2.0,
            ];
            assert!((dt_s - step_s).abs() < 1e-5);
        }
        assert!(
            found
                .windows(2)
                .any(|pair| (pair[1].features[12] - 0.6).abs() < 1e-6)
        );
        let range_m = found[9]
            .position_m
            .iter()
            .map(|c| c * c)
            .sum::<f64>()
            .sqrt();
        assert!((f64::from(found[9].features[4]) - range_m).abs() < 5.0);
    }

    #[test]
    fn seeds_move_noise_and_gaps() {
        let condition = Condition {
            level: NoiseLevel::High,
            rate: SamplingRate::HALF,
        };
        let draw = |seed| examples(&flight(), condition, &SETTINGS, seed);
        assert_eq!(draw(1), draw(1));
        let starts = |seed: u64| {
            draw(seed)
                .iter()
                .map(|e| e.position_m[1])
                .collect::<Vec<_>>()
        };
        assert!((2..20).any(|seed| starts(seed) != starts(1)));
        assert_ne!(draw(1)[0].features, draw(2)[0].features);
    }

    #[test]
    fn attainable_variance_runs_from_the_noise_to_the_spread() {
        let sigmas = |level: NoiseLevel| level.sigmas(NoiseTable::Radians);
        let low = attainable_variance_m2(35.0, &sigmas(NoiseLevel::Low), 8.7);
        assert!(
            (low - (0.987 + 2.0 * 0.035_f64.powi(2)) / 3.0).abs() < 1e-3,
            "{low}"
        );
        let high = attainable_variance_m2(35.0, &sigmas(NoiseLevel::High), 8.7);
        assert!((high - (75.1 + 2.0 * 10.54) / 3.0).abs() < 0.1, "{high}");
    }
}
