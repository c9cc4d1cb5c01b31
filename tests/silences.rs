//! What the tracker says of a target that nobody has seen for seconds: built-in flights, which turn, and targets that
//! go straight on, as no training flight does for long.

use bnkf::Settings;
use bnkf::blob::Blob;
use bnkf_host_sim::contest::track::track;
use bnkf_host_sim::contest::tracker_filter::TrackerFilter;
use bnkf_host_sim::scenario::radar::{Condition, Radar};
use bnkf_host_sim::scoring::cell::CellMetrics;
use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::generator::{GeneratorSettings, generate};
use bnkf_model_export::radar::noise::NoiseTable;

mod tolerance;

use tolerance::{SILENCE_NEES_MAX, SILENCE_NEES_MIN};

const MODEL: &[u8] = include_bytes!("../models/recursive.bnkf");
const FLIGHTS: usize = 40;
/// Samples, a tenth of a second each, after which nothing is measured.
const SEEN: usize = 100;
/// Samples after the last measurement that are scored: one, two and five seconds.
const UNSEEN: [usize; 3] = [10, 20, 49];

/// Flights of 15 s at one velocity, halfway between measurements and silence 25 m from the radar.
fn straight(speed_mps: f64) -> Vec<Flight> {
    let flight = |index: usize| {
        let (sin_az, cos_az) = (2.4 * index as f64).sin_cos();
        let (sin_course, cos_course) = (1.7 * index as f64).sin_cos();
        let rows: Vec<[f64; 4]> = (0..150)
            .map(|sample| {
                let time_s = 0.1 * f64::from(sample);
                let gone_m = speed_mps * (time_s - 7.5);
                let (east, north) = (25.0 * cos_az, 25.0 * sin_az);
                [
                    time_s,
                    east + gone_m * cos_course,
                    north + gone_m * sin_course,
                    12.0,
                ]
            })
            .collect();
        Flight::from_track("straight", "straight", &rows).expect("a flight")
    };
    (0..FLIGHTS).map(flight).collect()
}

fn builtin() -> Vec<Flight> {
    let settings = GeneratorSettings {
        flights: FLIGHTS,
        seed: 405,
        ..GeneratorSettings::default()
    };
    generate(&settings).expect("flights")
}

/// Scores of all flights so long after the last measurement.
fn cells(flights: &[Flight], condition: Condition) -> [CellMetrics; UNSEEN.len()] {
    let blob = Blob::parse(MODEL).expect("shipped blob");
    let radar = Radar::paper(NoiseTable::Radians);
    let mut scored = UNSEEN.map(|_| Vec::new());
    for (index, flight) in flights.iter().enumerate() {
        let mut readings = radar.readings(flight, condition, 900 + index as u64);
        readings[SEEN..].fill(None);
        let mut tracker = TrackerFilter::new(blob, Settings::of(&blob)).expect("settings");
        let steps = track(&mut tracker, flight, &readings);
        for (scored, unseen) in scored.iter_mut().zip(UNSEEN) {
            // The first sample only starts the track.
            scored.push(steps[SEEN + unseen - 2].scored);
        }
    }
    scored.map(|scored| CellMetrics::new(&scored))
}

#[test]
fn a_long_silence_is_told_as_it_is() {
    println!(
        "flights, noise: ED [m] / NEES / coverage one, two and five seconds after the last measurement"
    );
    let mut kinds = vec![("built-in".to_owned(), builtin())];
    for speed in [1.0, 3.0, 6.0, 10.0] {
        kinds.push((format!("straight, {speed} m/s"), straight(speed)));
    }
    let mut failures = Vec::new();
    for (name, flights) in &kinds {
        let conditions = Radar::paper(NoiseTable::Radians).conditions();
        for condition in conditions.into_iter().filter(|c| c.rate.get() == 1.0) {
            let cells = cells(flights, condition);
            let each = cells.iter().map(|cell| {
                format!(
                    " {:6.2} / {:4.1} / {:3.0} %",
                    cell.ed_mean_m,
                    cell.nees_mean,
                    100.0 * cell.coverage90
                )
            });
            let line = format!(
                "{name:16} {:6}:{}",
                condition.noise.to_string(),
                each.collect::<Vec<_>>().join(",")
            );
            println!("{line}");
            let home = name == "built-in";
            let most = SILENCE_NEES_MAX[usize::from(!home)][condition.noise as usize];
            let within = |cell: &CellMetrics| {
                cell.diverged == 0
                    && cell.nees_mean <= most
                    && (!home || cell.nees_mean >= SILENCE_NEES_MIN)
            };
            if !cells.iter().all(within) {
                failures.push(line);
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
