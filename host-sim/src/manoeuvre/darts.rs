//! Darts: straight dashes that turn within a sample.

use bnkf_model_export::flights::flight::{Flight, Sample};
use bnkf_model_export::random_source::RandomSource;
use bnkf_model_export::seed::name_id;

/// A flight from the same place that rests over a place or dashes in a straight line for half a second to two,
/// and changes its velocity within a sample: accelerations that the training never shows.
pub fn darts(flight: &Flight, seed: u64) -> Flight {
    let mut random = RandomSource::new(seed, &[name_id("darts"), name_id(&flight.name)]);
    let centre = flight.samples[0].position_m;
    let mut position_m = centre;
    let mut velocity_mps = [0.0; 3];
    let mut until_s = 0.0;
    let mut samples: Vec<Sample> = Vec::with_capacity(flight.samples.len());
    for sample in &flight.samples {
        if let Some(last) = samples.last() {
            let dt_s = sample.time_s - last.time_s;
            position_m = core::array::from_fn(|i| position_m[i] + dt_s * velocity_mps[i]);
        }
        if sample.time_s >= until_s {
            until_s = sample.time_s + random.uniform(0.5, 2.0);
            let speed = if random.chance(0.25) {
                0.0
            } else {
                random.uniform(2.0, 8.0)
            };
            // Back towards where it began when it has gone far.
            let away = [position_m[0] - centre[0], position_m[1] - centre[1]];
            let angle = if away[0].hypot(away[1]) > 6.0 {
                (-away[1]).atan2(-away[0]) + random.uniform(-0.7, 0.7)
            } else {
                random.uniform(0.0, core::f64::consts::TAU)
            };
            let climb = (centre[2] - position_m[2]).clamp(-1.0, 1.0) + random.uniform(-0.5, 0.5);
            velocity_mps = [speed * angle.cos(), speed * angle.sin(), climb];
        }
        samples.push(Sample {
            position_m,
            velocity_mps,
            ..*sample
        });
    }
    Flight {
        name: format!("darts-{}", flight.name),
        source: flight.source.clone(),
        samples,
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::{Flight, Sample};
    use bnkf_model_export::flights::generator::{GeneratorSettings, generate};

    use super::darts;

    #[test]
    fn darts_are_straight_and_turn_at_once() {
        let settings = GeneratorSettings {
            flights: 2,
            ..GeneratorSettings::default()
        };
        let cruising = generate(&settings).unwrap();
        let darting: Vec<Flight> = cruising.iter().map(|flight| darts(flight, 1)).collect();
        let jump = |flights: &[Flight]| {
            let pairs = flights.iter().flat_map(|flight| flight.samples.windows(2));
            let jump = |pair: &[Sample]| {
                let between = |i| pair[1].velocity_mps[i] - pair[0].velocity_mps[i];
                f64::hypot(between(0), between(1))
            };
            pairs.map(jump).fold(0.0, f64::max)
        };
        assert!(jump(&cruising) < 1.5, "{}", jump(&cruising));
        assert!(jump(&darting) > 3.0, "{}", jump(&darting));
        for flight in &darting {
            for pair in flight.samples.windows(2) {
                for i in 0..3 {
                    let step = pair[1].position_m[i] - pair[0].position_m[i];
                    let dt_s = pair[1].time_s - pair[0].time_s;
                    assert!((step - dt_s * pair[0].velocity_mps[i]).abs() < 1e-9);
                }
            }
        }
    }
}
