//! What the replica's radar reports of a flight.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::errors::Errors;
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::NoiseLevel;
use bnkf_model_export::radar::reading::Reading;
use bnkf_model_export::radar::sampling::{RadarSettings, sample_radar};

use super::departure::Departure;
use super::recipe::Recipe;

/// The readings of `flight`, one entry per sample, `None` in gaps; the first is always there.
pub fn observe(
    flight: &Flight,
    recipe: &Recipe,
    level: NoiseLevel,
    rate: SamplingRate,
    seed: u64,
) -> Vec<Option<Reading>> {
    let settings = RadarSettings {
        errors: if recipe.departs(Departure::Binned) {
            Errors::Quantised
        } else {
            Errors::Gaussian
        },
        ..RadarSettings::paper(level, recipe.noise_table(), rate, seed)
    };
    sample_radar(flight, &settings)
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::generator::{GeneratorSettings, generate};
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::NoiseLevel;

    use super::observe;
    use crate::replication::departure::Departure;
    use crate::replication::recipe::Recipe;

    #[test]
    fn binning_moves_range_and_range_rate_by_half_a_sigma_at_most_and_nothing_else() {
        let settings = GeneratorSettings {
            flights: 1,
            ..GeneratorSettings::default()
        };
        let flight = &generate(&settings).unwrap()[0];
        let draw =
            |recipe: Recipe| observe(flight, &recipe, NoiseLevel::Medium, SamplingRate::HALF, 5);
        let plain = draw(Recipe::PAPER);
        let binned = draw(Recipe::PAPER.with(Departure::Binned));
        let mut moved = 0;
        for (plain, binned) in plain.iter().zip(&binned) {
            let (Some(plain), Some(binned)) = (plain, binned) else {
                assert!(plain.is_none() && binned.is_none());
                continue;
            };
            assert!((plain.range_m - binned.range_m).abs() <= 5.0);
            assert!((binned.range_m / 10.0 - 0.5).fract().abs() < 1e-12);
            assert!((plain.range_rate_mps - binned.range_rate_mps).abs() <= 0.05 + 1e-12);
            assert_eq!(plain.azimuth_rad, binned.azimuth_rad);
            moved += usize::from(plain.range_m != binned.range_m);
        }
        assert!(moved > 50, "{moved}");
    }
}
