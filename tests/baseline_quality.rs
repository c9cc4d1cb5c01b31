//! The baselines are worth beating: consistent and ordered as theory has it on built-in flights.
//!
//! The tuned parameters are checked in, since a fit takes seconds a level; to make them anew:
//! `cargo test --release --test baseline_quality -- --ignored`.

use bnkf_host_sim::baseline::bound::{mean_distance_m, position_bounds};
use bnkf_host_sim::baseline::correction::Correction;
use bnkf_host_sim::baseline::prior::PopulationPrior;
use bnkf_host_sim::baseline::sigma_points::Spread;
use bnkf_host_sim::baseline::tuning::Tuning;
use bnkf_host_sim::cell::CellMetrics;
use bnkf_host_sim::filter::Filter;
use bnkf_host_sim::track::track;
use bnkf_model_export::flight::Flight;
use bnkf_model_export::gaps::SamplingRate;
use bnkf_model_export::generator::{GeneratorSettings, generate};
use bnkf_model_export::noise::{NoiseLevel, NoiseTable};
use bnkf_model_export::radar_sampling::{RadarSettings, sample_radar};
use bnkf_model_export::reading::Reading;

const TUNINGS: &str = include_str!("golden/tuned_built_in.json");

/// NEES of a tuned filter in every built-in cell (3 is consistent). The motion model is fitted,
/// not true, and sixty flights leave an uncertainty of 0.15.
const NEES: std::ops::RangeInclusive<f64> = 2.5..=3.6;

fn flights(seed: u64, count: usize) -> Vec<Flight> {
    let settings = GeneratorSettings { flights: count, seed, ..GeneratorSettings::default() };
    generate(&settings).expect("flights")
}

fn tunings() -> [Tuning; 3] {
    serde_json::from_str(TUNINGS).expect("three tunings")
}

fn readings(flight: &Flight, level: NoiseLevel, rate: SamplingRate) -> Vec<Option<Reading>> {
    sample_radar(flight, &RadarSettings::paper(level, NoiseTable::Radians, rate, 31))
}

fn cell<F: Filter>(
    flights: &[Flight],
    level: NoiseLevel,
    rate: SamplingRate,
    make: impl Fn() -> F,
) -> CellMetrics {
    let steps = flights.iter().flat_map(|flight| {
        track(&mut make(), flight, &readings(flight, level, rate)).into_iter().map(|s| s.scored)
    });
    CellMetrics::new(&steps.collect::<Vec<_>>())
}

#[test]
fn tuned_kalman_filters_are_consistent_in_every_cell() {
    let flights = flights(2, 60);
    for (level, tuning) in NoiseLevel::ALL.into_iter().zip(tunings()) {
        for rate in SamplingRate::ALL {
            let unscented = Correction::SigmaPoints(Spread::UNIT);
            for correction in [Correction::Extended, unscented] {
                let cell = cell(&flights, level, rate, || tuning.kalman(correction));
                let what = format!("{level} {} {correction:?}: {cell:?}", rate.get());
                assert!(NEES.contains(&cell.nees_mean), "{what}");
                assert!((0.86..0.94).contains(&cell.coverage90), "{what}");
                assert_eq!(cell.diverged, 0, "{what}");
            }
        }
    }
}

#[test]
fn at_high_noise_the_particle_filter_lies_between_the_bound_and_the_ekf() {
    let flights = flights(2, 60);
    let (level, rate) = (NoiseLevel::High, SamplingRate::FULL);
    let tuning = tunings()[2];
    let ekf = cell(&flights, level, rate, || tuning.kalman(Correction::Extended));
    let particles = cell(&flights, level, rate, || tuning.rao_blackwell(8));
    assert!(NEES.contains(&particles.nees_mean), "{particles:?}");
    assert!(particles.ed_mean_m < ekf.ed_mean_m, "{particles:?} {ekf:?}");
    assert_eq!(particles.diverged, 0);

    let mut floor_m = Vec::new();
    for flight in &flights {
        let readings = readings(flight, level, rate);
        let bounds = position_bounds(&tuning.singer, &tuning.prior, flight, &readings);
        floor_m.extend(bounds.expect("bounds").iter().skip(1).map(mean_distance_m));
    }
    let floor_m = floor_m.iter().sum::<f64>() / floor_m.len() as f64;
    assert!(floor_m < particles.ed_mean_m, "{floor_m} {particles:?}");
    // A floor far below is no statement.
    assert!(floor_m > 0.6 * particles.ed_mean_m, "{floor_m} {particles:?}");
}

/// The particles never come down to a handful: not at high noise, where they matter, and not at
/// low noise, where the readings are sharp.
#[test]
fn the_particle_filter_does_not_degenerate() {
    use bnkf_host_sim::filter::Start;

    for (level, tuning) in NoiseLevel::ALL.into_iter().zip(tunings()) {
        for flight in &flights(2, 8) {
            let readings = readings(flight, level, SamplingRate::HALF);
            let mut filter = tuning.rao_blackwell(8);
            let start = Start {
                reading: readings[0].as_ref().expect("a first reading"),
                true_position_m: flight.samples[0].position_m.into(),
                true_velocity_mps: flight.samples[0].velocity_mps.into(),
            };
            filter.start(&start).expect("a started filter");
            for reading in readings[1..].iter().flatten() {
                filter.step(reading.time_us, Some(reading)).expect("an estimate");
                let effective = filter.effective_particles();
                assert!(effective > 9.9, "{level} {}: {effective}", flight.name);
            }
        }
    }
}

#[test]
#[ignore = "writes tests/golden/tuned_built_in.json; takes minutes"]
fn make_tuned_built_in() {
    let flights = flights(1, 200);
    let flights: Vec<&Flight> = flights.iter().collect();
    let prior = PopulationPrior::fit(flights.iter().copied()).expect("a prior");
    let fit = |level: NoiseLevel| {
        let noise = level.sigmas(NoiseTable::Radians);
        Tuning::fit(prior, &flights, noise, &SamplingRate::ALL, 5).expect("a fit")
    };
    let text = serde_json::to_string_pretty(&NoiseLevel::ALL.map(fit)).expect("JSON");
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/tuned_built_in.json");
    std::fs::write(path, text + "\n").expect("a written file");
}
