//! The baselines are worth beating: consistent, and as good as theory has it, on built-in flights.
//!
//! The tuned parameters are those that `host-sim evaluate` fits to generated flights, checked in since a
//! fit takes many seconds a level; to make them anew:
//! `cargo test --release --test baseline_quality -- --ignored`.

mod tolerance;

use std::path::Path;

use bnkf_host_sim::baseline::bound::{mean_distance_m, position_bounds};
use bnkf_host_sim::baseline::correction::Correction;
use bnkf_host_sim::baseline::sigma_points::Spread;
use bnkf_host_sim::baseline::tuning::{FLIGHTS_MAX, Tuning};
use bnkf_host_sim::campaign::fold_kit::TUNING_SEED;
use bnkf_host_sim::contest::track::track;
use bnkf_host_sim::contest::tunings::Tunings;
use bnkf_host_sim::filter::Filter;
use bnkf_host_sim::scenario::Scenario;
use bnkf_host_sim::scenario::radar::{Condition, Radar};
use bnkf_host_sim::scoring::cell::CellMetrics;
use bnkf_model_export::flights::flight::{Flight, Sample};
use bnkf_model_export::flights::generator::{GeneratorSettings, generate, generate_one};
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};

use tolerance::{
    BOUND_ED_RATIO, PARTICLE_ED_RATIO_MAX, TUNED_COVERAGE90, TUNED_ED_M, TUNED_NEES,
    TUNED_NEES_OF_A_FLIGHT,
};

const TUNINGS: &str = include_str!("golden/tuned_built_in.json");

/// Seeds of the flights to score on, and of one that passes overhead; filters are fitted to others.
const SCORED: u64 = 2;
const OVERHEAD: u64 = 1;

fn flights(seed: u64, count: usize) -> Vec<Flight> {
    let settings = GeneratorSettings {
        flights: count,
        seed,
        ..GeneratorSettings::default()
    };
    generate(&settings).expect("flights")
}

fn tunings() -> Tunings {
    serde_json::from_str(TUNINGS).expect("three tunings")
}

/// A filter over every flight under a condition.
fn cell(
    flights: &[Flight],
    condition: Condition,
    make: &dyn Fn(&Tuning) -> Box<dyn Filter>,
) -> CellMetrics {
    let tunings = tunings();
    let tuning = tunings.find(condition.table, condition.noise).expect("it");
    let radar = Radar::paper(condition.table);
    let steps = flights.iter().flat_map(|flight| {
        let readings = radar.readings(flight, condition, 31);
        let steps = track(make(tuning).as_mut(), flight, &readings);
        steps.into_iter().map(|step| step.scored)
    });
    CellMetrics::new(&steps.collect::<Vec<_>>())
}

fn conditions() -> Vec<Condition> {
    Radar::paper(NoiseTable::Radians).conditions()
}

#[test]
fn tuned_kalman_filters_are_consistent_in_every_cell() {
    let flights = flights(SCORED, 60);
    for condition in conditions() {
        let spreads = [Spread::UNIT, Spread::CUBATURE].map(Correction::SigmaPoints);
        for correction in [Correction::Extended, spreads[0], spreads[1]] {
            let cell = cell(&flights, condition, &|tuning| {
                Box::new(tuning.kalman(correction))
            });
            let what = format!("{condition:?} {correction:?}: {cell:?}");
            assert!(TUNED_NEES.contains(&cell.nees_mean), "{what}");
            assert!(TUNED_COVERAGE90.contains(&cell.coverage90), "{what}");
            assert_eq!(cell.diverged, 0, "{what}");
        }
    }
}

#[test]
fn the_tuned_ekf_is_as_good_as_it_should_be() {
    let flights = flights(SCORED, 60);
    for (level, rate, band_m) in TUNED_ED_M {
        let its = |condition: &Condition| {
            (condition.noise as usize, condition.rate.get()) == (level, rate)
        };
        let condition = conditions()
            .into_iter()
            .find(its)
            .expect("a cell of the paper");
        let cell = cell(&flights, condition, &|tuning| {
            Box::new(tuning.kalman(Correction::Extended))
        });
        assert!(
            band_m.contains(&cell.ed_mean_m),
            "{condition:?}: {} m, not in {band_m:?}",
            cell.ed_mean_m
        );
    }
}

/// This flight passes 0.26 m beside the vertical axis. Azimuth jumps there, and filters that took it
/// as it came lost the track: NEES of thousands.
#[test]
fn a_pass_overhead_loses_no_tuned_filter() {
    let settings = GeneratorSettings {
        seed: OVERHEAD,
        ..GeneratorSettings::default()
    };
    let flight = [generate_one(&settings, 37).expect("a flight")];
    let overhead = |s: &Sample| s.position_m[0].hypot(s.position_m[1]) < 0.3;
    assert!(flight[0].samples.iter().any(overhead));
    for condition in conditions() {
        for correction in [
            Correction::Extended,
            Correction::SigmaPoints(Spread::UNIT),
            Correction::SigmaPoints(Spread::CUBATURE),
        ] {
            let cell = cell(&flight, condition, &|tuning| {
                Box::new(tuning.kalman(correction))
            });
            let what = format!("{condition:?} {correction:?}: {cell:?}");
            assert!(cell.nees_mean < TUNED_NEES_OF_A_FLIGHT, "{what}");
        }
    }
}

/// Particles take over where curvature hurts and are one Kalman filter where it does not.
#[test]
fn the_particle_filter_is_sound_at_every_level_and_no_worse_than_the_ekf() {
    let flights = flights(SCORED, 30);
    let full = |condition: &Condition| condition.rate == SamplingRate::FULL;
    for condition in conditions().into_iter().filter(full) {
        let ekf = cell(&flights, condition, &|tuning| {
            Box::new(tuning.kalman(Correction::Extended))
        });
        let particles = cell(&flights, condition, &|tuning| {
            Box::new(tuning.rao_blackwell(8))
        });
        let what = format!("{condition:?}: {particles:?}, EKF {ekf:?}");
        assert!(TUNED_NEES.contains(&particles.nees_mean), "{what}");
        assert!(
            particles.ed_mean_m < PARTICLE_ED_RATIO_MAX * ekf.ed_mean_m,
            "{what}"
        );
        assert_eq!(particles.diverged, 0, "{what}");
    }
}

/// The bound of the fitted motion model stands near what its filters reach. It is the floor over
/// flights that the model itself would make: on calmer ones a filter may end a little below it, and
/// a bound far away on either side would be no statement.
#[test]
fn the_bound_stands_near_the_filters() {
    let flights = flights(SCORED, 60);
    let tunings = tunings();
    let medium = |condition: &Condition| condition.noise == NoiseLevel::Medium;
    for condition in conditions().into_iter().filter(medium) {
        let tuning = tunings.find(condition.table, condition.noise).expect("it");
        let radar = Radar::paper(condition.table);
        let mut floor_m = Vec::new();
        for flight in &flights {
            let readings = radar.readings(flight, condition, 31);
            let bounds = position_bounds(&tuning.singer, &tuning.prior, flight, &readings);
            floor_m.extend(bounds.expect("bounds").iter().skip(1).map(mean_distance_m));
        }
        let floor_m = floor_m.iter().sum::<f64>() / floor_m.len() as f64;
        let ekf = cell(&flights, condition, &|tuning| {
            Box::new(tuning.kalman(Correction::Extended))
        });
        let part = floor_m / ekf.ed_mean_m;
        assert!(
            BOUND_ED_RATIO.contains(&part),
            "{condition:?}: {part} of {ekf:?}"
        );
    }
}

#[test]
#[ignore = "writes tests/golden/tuned_built_in.json; takes half a minute"]
fn make_tuned_built_in() {
    let table = NoiseTable::Radians;
    let scenario = Scenario::find(Path::new("paper")).expect("built in");
    let flights = generate(&scenario.generator(FLIGHTS_MAX, TUNING_SEED)).expect("flights");
    let flights: Vec<&Flight> = flights.iter().collect();
    let tunings = Tunings::fit(&flights, &scenario.radar, &[table], TUNING_SEED).expect("a fit");
    let text = serde_json::to_string_pretty(&tunings).expect("JSON");
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/golden/tuned_built_in.json"
    );
    std::fs::write(path, text + "\n").expect("a written file");
}
