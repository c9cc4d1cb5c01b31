//! Targets that start in directions that no training flight has are tracked: from nearly straight
//! below the radar to nearly straight above, beside the paper's own filter, which starts from the truth.

mod tolerance;

use bnkf::Settings;
use bnkf::blob::Blob;
use bnkf_host_sim::baseline::kalman::Kalman;
use bnkf_host_sim::contest::track::track;
use bnkf_host_sim::contest::tracker_filter::TrackerFilter;
use bnkf_host_sim::filter::Filter;
use bnkf_host_sim::scenario::radar::{Condition, Radar};
use bnkf_host_sim::scoring::cell::CellMetrics;
use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::generator::{GeneratorSettings, generate};
use bnkf_model_export::radar::noise::NoiseTable;

use tolerance::{ELEVATION_ED_RATIO, ELEVATION_NEES_MAX};

const MODEL: &[u8] = include_bytes!("../models/recursive.bnkf");
/// Where the flights start, m and degrees.
const RANGE_M: f64 = 33.0;
const ELEVATIONS_DEG: [f64; 7] = [-80.0, -45.0, -17.0, 0.0, 45.0, 80.0, 89.0];
const FLIGHTS: usize = 24;

/// Built-in flights moved so that each starts at this elevation.
fn flights(elevation_deg: f64) -> Vec<Flight> {
    let settings = GeneratorSettings {
        flights: FLIGHTS,
        seed: 404,
        ..GeneratorSettings::default()
    };
    let mut flights = generate(&settings).expect("flights");
    for (index, flight) in flights.iter_mut().enumerate() {
        let (sin_el, cos_el) = elevation_deg.to_radians().sin_cos();
        let (sin_az, cos_az) = (2.4 * index as f64).sin_cos();
        let start = [cos_el * cos_az, cos_el * sin_az, sin_el].map(|x| RANGE_M * x);
        let first = flight.samples[0].position_m;
        for sample in &mut flight.samples {
            for axis in 0..3 {
                sample.position_m[axis] += start[axis] - first[axis];
            }
        }
    }
    flights
}

fn cell(flights: &[Flight], condition: Condition, filter: &mut dyn Filter) -> CellMetrics {
    let radar = Radar::paper(NoiseTable::Radians);
    let steps = flights.iter().flat_map(|flight| {
        let readings = radar.readings(flight, condition, 77);
        let steps = track(filter, flight, &readings);
        steps
            .into_iter()
            .map(|step| step.scored)
            .collect::<Vec<_>>()
    });
    CellMetrics::new(&steps.collect::<Vec<_>>())
}

#[test]
fn targets_from_straight_below_to_straight_above_are_tracked() {
    let blob = Blob::parse(MODEL).expect("shipped blob");
    println!(
        "elevation noise  rate: ED [m] / NEES / coverage / not tracked; paper's EKF: ED, ratio"
    );
    let mut failures = Vec::new();
    for elevation in ELEVATIONS_DEG {
        let flights = flights(elevation);
        for condition in Radar::paper(NoiseTable::Radians).conditions() {
            let mut tracker = TrackerFilter::new(blob, Settings::of(&blob)).expect("settings");
            let ours = cell(&flights, condition, &mut tracker);
            let paper = cell(&flights, condition, &mut Kalman::paper_ekf());
            let ratio = ours.ed_mean_m / paper.ed_mean_m;
            let line = format!(
                "{elevation:5.0} deg  {:6} {:4}: {:.3} / {:.2} / {:.1} % / {}; {:.3}, {ratio:.2}",
                condition.noise.to_string(),
                condition.rate.get(),
                ours.ed_mean_m,
                ours.nees_mean,
                100.0 * ours.coverage90,
                ours.diverged,
                paper.ed_mean_m,
            );
            println!("{line}");
            let level = condition.noise as usize;
            let (ratio_max, nees_max) = (ELEVATION_ED_RATIO[level], ELEVATION_NEES_MAX[level]);
            if ratio > ratio_max || ours.nees_mean > nees_max || ours.diverged > 0 {
                failures.push(line);
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
