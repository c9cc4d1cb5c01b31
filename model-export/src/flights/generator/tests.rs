use super::{GeneratorError, GeneratorSettings, generate, generate_one};
use crate::flights::flight::Flight;
use crate::flights::volume::{Volume, VolumeError};
use statistics::FlightStatistics;
use std::collections::HashSet;

mod statistics;

fn settings(flights: usize, seed: u64) -> GeneratorSettings {
    GeneratorSettings {
        flights,
        seed,
        ..GeneratorSettings::default()
    }
}

fn statistics(settings: &GeneratorSettings) -> FlightStatistics {
    FlightStatistics::of(&generate(settings).unwrap()).unwrap()
}

#[test]
fn flights_look_like_the_papers() {
    let stats = statistics(&settings(400, 7));
    assert_eq!((stats.flights, stats.samples), (400, 400 * 150));
    assert!(stats.range_m.min >= 18.7 && stats.range_m.max <= 46.9);
    assert!(stats.height_m.min >= 4.85 && stats.height_m.max <= 24.7);
    assert!((33.0..37.0).contains(&stats.range_m.mean), "{stats:?}");
    assert!((6.0..9.0).contains(&stats.range_m.sd), "{stats:?}");
    assert!((2.1..2.5).contains(&stats.speed_mps.mean), "{stats:?}");
    assert!((4.0..4.9).contains(&stats.speed_mps.max), "{stats:?}");
    assert!(
        (1.5..3.7).contains(&stats.acceleration_mps2.mean),
        "{stats:?}"
    );
    assert!(
        (5.0..9.0).contains(&stats.acceleration_mps2.max),
        "{stats:?}"
    );
}

#[test]
fn a_flight_depends_on_seed_and_number_only() {
    let many = generate(&settings(40, 3)).unwrap();
    let few = generate(&settings(15, 3)).unwrap();
    assert_eq!(many[..15], few);
    assert_eq!(generate_one(&settings(0, 3), 31).unwrap(), many[31]);
    let other = generate(&settings(15, 4)).unwrap();
    for (one, two) in few.iter().zip(&other) {
        assert_ne!(one.samples, two.samples);
    }
    assert_eq!(generate(&settings(0, 3)), Ok(Vec::new()));
}

#[test]
fn names_are_unique_and_tell_the_kind() {
    let flights = generate(&settings(300, 5)).unwrap();
    let names: HashSet<&str> = flights.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names.len(), 300);
    let kinds: HashSet<&str> = names
        .iter()
        .map(|n| n.rsplit_once('-').unwrap().0)
        .collect();
    let expected = [
        "circle",
        "circle-tilted",
        "circle-oscillating",
        "circle-climbing",
        "lemniscate",
        "lemniscate-tilted",
        "lemniscate-oscillating",
        "lemniscate-climbing",
        "waypoints",
    ];
    assert_eq!(kinds, HashSet::from(expected));
    for (i, flight) in flights.iter().enumerate() {
        assert!(flight.name.ends_with(&format!("-{i:04}")));
        assert_eq!(flight.source, flight.name);
    }
}

/// Largest difference between the velocity of a sample and the central difference around it.
fn velocity_mismatch_mps(flights: &[Flight]) -> f64 {
    let mut worst = 0.0_f64;
    for triple in flights.iter().flat_map(|flight| flight.samples.windows(3)) {
        let span_s = triple[2].time_s - triple[0].time_s;
        for axis in 0..3 {
            let slope = (triple[2].position_m[axis] - triple[0].position_m[axis]) / span_s;
            worst = worst.max((slope - triple[1].velocity_mps[axis]).abs());
        }
    }
    worst
}

#[test]
fn velocities_are_the_derivatives_of_positions() {
    let fine = GeneratorSettings {
        rate_hz: 100.0,
        ..settings(30, 11)
    };
    let flights = generate(&fine).unwrap();
    // Acceleration changes by up to 1 m/s^2 from step to step (gusts); half a step of that.
    let mismatch = velocity_mismatch_mps(&flights);
    assert!(mismatch < 0.005, "{mismatch} m/s");
}

#[test]
fn rates_sample_the_same_flight() {
    let at_hz = |rate_hz| {
        generate(&GeneratorSettings {
            rate_hz,
            ..settings(10, 13)
        })
        .unwrap()
    };
    let (slow, fast) = (at_hz(2.0), at_hz(20.0));
    for (slow, fast) in slow.iter().zip(&fast) {
        assert_eq!((slow.samples.len(), fast.samples.len()), (30, 300));
        for (k, sample) in slow.samples.iter().enumerate() {
            assert!((sample.time_s - fast.samples[10 * k].time_s).abs() < 1e-12);
        }
        let moved = |flight: &Flight, k: usize| {
            (0..3)
                .map(|axis| {
                    let samples = &flight.samples;
                    (samples[k].position_m[axis] - samples[0].position_m[axis]).powi(2)
                })
                .sum::<f64>()
                .sqrt()
        };
        for k in 0..30 {
            assert!((moved(slow, k) - moved(fast, 10 * k)).abs() < 1e-6);
        }
    }
}

#[test]
fn scales_stretch_lengths_and_speeds() {
    let base = statistics(&settings(100, 17));
    let fast = statistics(&GeneratorSettings {
        speed_scale: 2.0,
        ..settings(100, 17)
    });
    assert!((1.8..2.2).contains(&(fast.speed_mps.mean / base.speed_mps.mean)));
    assert!((3.0..5.0).contains(&(fast.acceleration_mps2.mean / base.acceleration_mps2.mean)));
    let far = Volume {
        range_m_min: 300.0,
        range_m_max: 3000.0,
        range_m_mean: 1500.0,
        range_m_sd: 600.0,
        height_m_min: 20.0,
        height_m_max: 400.0,
    };
    let large = statistics(&GeneratorSettings {
        speed_scale: 6.0,
        size_scale: 12.0,
        duration_s: 60.0,
        volume: far,
        ..settings(60, 17)
    });
    assert_eq!(large.samples, 60 * 600);
    assert!((5.0..7.0).contains(&(large.speed_mps.mean / base.speed_mps.mean)));
    assert!((2.0..4.0).contains(&(large.acceleration_mps2.mean / base.acceleration_mps2.mean)));
    assert!(large.range_m.min >= 300.0 && large.range_m.max <= 3000.0);
    assert!(large.height_m.min >= 20.0 && large.height_m.max <= 400.0);
}

#[test]
fn timing_jitter_moves_samples_along_the_flight() {
    let truth = generate(&settings(20, 19)).unwrap();
    let jittered = generate(&GeneratorSettings {
        timing_jitter_s: 0.004,
        ..settings(20, 19)
    })
    .unwrap();
    let mismatch = velocity_mismatch_mps(&jittered) - velocity_mismatch_mps(&truth);
    // 4 ms at up to 4.8 m/s over a span of 0.2 s: 0.1 to 0.4 m/s at the worst sample.
    assert!((0.05..0.5).contains(&mismatch), "{mismatch} m/s");
    for (one, two) in truth.iter().zip(&jittered) {
        assert_eq!(one.name, two.name);
        let times = one.samples.iter().zip(&two.samples);
        assert!(times.into_iter().all(|(a, b)| a.time_s == b.time_s));
    }
}

#[test]
fn settings_that_make_no_sense_are_named() {
    let refused = |change: fn(&mut GeneratorSettings)| {
        let mut bad = settings(1, 1);
        change(&mut bad);
        generate(&bad).map(|flights| flights.len()).unwrap_err()
    };
    let field = |error| match error {
        GeneratorError::OutOfRange { field, .. } => field,
        other => panic!("{other}"),
    };
    assert_eq!(field(refused(|s| s.duration_s = 0.0)), "duration_s");
    assert_eq!(field(refused(|s| s.rate_hz = f64::NAN)), "rate_hz");
    assert_eq!(field(refused(|s| s.speed_scale = -1.0)), "speed_scale");
    assert_eq!(field(refused(|s| s.size_scale = 1e9)), "size_scale");
    assert_eq!(
        field(refused(|s| s.timing_jitter_s = 0.05)),
        "timing_jitter_s"
    );
    assert_eq!(
        field(refused(|s| s.duration_s = 0.2)),
        "duration_s * rate_hz"
    );
    assert_eq!(
        field(refused(|s| (s.duration_s, s.speed_scale) = (1e4, 10.0))),
        "duration_s * speed_scale / size_scale"
    );
    assert_eq!(
        refused(|s| s.volume.height_m_max = 1.0),
        GeneratorError::Volume(VolumeError::Empty("height_m_min", "height_m_max"))
    );
    let no_fit = generate(&GeneratorSettings {
        volume: Volume {
            range_m_max: 19.0,
            ..Volume::PAPER
        },
        ..settings(1, 1)
    });
    assert!(matches!(
        no_fit,
        Err(GeneratorError::NoFit { index: 0, .. })
    ));
}

#[test]
fn a_seed_keeps_its_flights() {
    // Recorded on x86-64; `libm` and IEEE arithmetic make it the same everywhere.
    let flights = generate(&settings(3, 1)).unwrap();
    let hash = crate::flights::data_hash::of_flights(&flights);
    assert_eq!(&hash[..16], "6ee99950e274bcdd");
}
