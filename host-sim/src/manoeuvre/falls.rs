//! Falls: the motor is cut, again and again, and the drone catches itself.

use bnkf_model_export::flights::flight::{Flight, Sample};
use bnkf_model_export::random_source::RandomSource;
use bnkf_model_export::seed::name_id;

/// Acceleration of a fall, m/s^2.
const FALL_MPS2: f64 = -9.8;
/// Acceleration that catches it, m/s^2.
const CATCH_MPS2: f64 = 9.0;
/// Longest step of the integration, seconds.
const STEP_S: f64 = 0.01;
/// It falls from above the first of these heights; at the second the motor comes on again at the latest. Metres.
const ROOM_M: f64 = 6.0;
const LOWEST_M: f64 = 5.0;

#[derive(Clone, Copy, Debug)]
enum Phase {
    Climb { next_s: f64 },
    Fall { until_s: f64 },
    Catch,
}

/// `flight`, but every 3 to 5 s its motor is cut: a free fall of 0.5 to 0.9 s, then it catches itself
/// with 9 m/s^2 upwards and climbs back.
pub fn falls(flight: &Flight, seed: u64) -> Flight {
    let mut random = RandomSource::new(seed, &[name_id("falls"), name_id(&flight.name)]);
    let mut time_s = flight.samples[0].time_s;
    let mut phase = Phase::Climb {
        next_s: time_s + random.uniform(2.0, 4.0),
    };
    // Below the flight, m, and how fast that changes, m/s.
    let (mut off_m, mut off_mps) = (0.0_f64, 0.0_f64);
    let fallen = |sample: &Sample| {
        while time_s < sample.time_s - 1e-9 {
            let height_m = sample.position_m[2] + off_m;
            phase = match phase {
                Phase::Climb { next_s } if time_s >= next_s && height_m > ROOM_M => Phase::Fall {
                    until_s: time_s + random.uniform(0.5, 0.9),
                },
                Phase::Fall { until_s } if time_s >= until_s || height_m < LOWEST_M => Phase::Catch,
                Phase::Catch if off_mps >= 0.0 => Phase::Climb {
                    next_s: time_s + random.uniform(3.0, 5.0),
                },
                same => same,
            };
            let acceleration_mps2 = match phase {
                Phase::Fall { .. } => FALL_MPS2,
                Phase::Catch => CATCH_MPS2,
                Phase::Climb { .. } => -1.5 * off_m - 2.5 * off_mps,
            };
            let step_s = (sample.time_s - time_s).min(STEP_S);
            off_m += step_s * (off_mps + 0.5 * step_s * acceleration_mps2);
            off_mps += step_s * acceleration_mps2;
            time_s += step_s;
        }
        let mut fallen = *sample;
        fallen.position_m[2] += off_m;
        fallen.velocity_mps[2] += off_mps;
        fallen
    };
    Flight {
        name: format!("falls-{}", flight.name),
        source: flight.source.clone(),
        samples: flight.samples.iter().map(fallen).collect(),
    }
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Flight;

    use super::falls;

    #[test]
    fn a_hovering_drone_falls_freely_and_comes_back() {
        let rows: Vec<_> = (0..600)
            .map(|i| [0.1 * f64::from(i), 30.0, 0.0, 15.0])
            .collect();
        let hover = Flight::from_track("hover", "hover", &rows).unwrap();
        let falling = falls(&hover, 1);
        assert_eq!(falling, falls(&hover, 1));
        let vertical = || falling.samples.iter().map(|s| s.velocity_mps[2]);
        let fastest = vertical().fold(0.0, f64::min);
        // 0.5 to 0.9 s of free fall.
        assert!((-9.0..-4.8).contains(&fastest), "{fastest}");
        let falls_begun = falling
            .samples
            .windows(2)
            .filter(|pair| pair[0].velocity_mps[2] > -4.0 && pair[1].velocity_mps[2] <= -4.0)
            .count();
        assert!((9..=20).contains(&falls_begun), "{falls_begun}");
        let free = falling
            .motion()
            .iter()
            .filter(|m| (m.acceleration_mps2 - 9.8).abs() < 0.01)
            .count();
        assert!(free >= 3 * falls_begun, "{free}");
        for sample in &falling.samples {
            assert!((2.0..17.0).contains(&sample.position_m[2]), "{sample:?}");
            assert_eq!(sample.position_m[0], 30.0);
        }
    }

    #[test]
    fn without_room_it_does_not_fall() {
        let rows: Vec<_> = (0..100)
            .map(|i| [0.1 * f64::from(i), 30.0, 0.0, 5.5])
            .collect();
        let low = Flight::from_track("low", "low", &rows).unwrap();
        assert_eq!(falls(&low, 1).samples, low.samples);
    }
}
