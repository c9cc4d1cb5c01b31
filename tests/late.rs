//! Measurements that come late: the same bits as in order, at a bounded cost.

use bnkf::blob::Blob;
use bnkf::call::Call;
use bnkf::late::{CALLS_MAX, LATE_MAX_US};
use bnkf::{Inference, LateTracker, Measurement, Sensor, Settings, StepError, Tracker};
use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::generator::{GeneratorSettings, generate};
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
use bnkf_model_export::radar::sampling::{RadarSettings, sample_radar, time_us};
use bnkf_model_export::random_source::RandomSource;

const RECURSIVE: &[u8] = include_bytes!("../models/recursive.bnkf");
const BNKF: &[u8] = include_bytes!("golden/tiny_bnkf.bnkf");

fn tracker(bytes: &[u8], passes: u16) -> Tracker<'_> {
    let blob = Blob::parse(bytes).expect("shipped blob");
    let settings = Settings {
        inference: Inference::of_passes(passes).expect("in range"),
        ..Settings::of(&blob)
    };
    Tracker::new(blob, settings).expect("settings of the blob")
}

fn flights(flights: usize) -> Vec<Flight> {
    generate(&GeneratorSettings {
        flights,
        seed: 77,
        ..GeneratorSettings::default()
    })
    .expect("built-in flights")
}

/// What a radar measures of a flight, `None` in gaps, with the samples' times.
fn measured(
    flight: &Flight,
    level: NoiseLevel,
    rate: SamplingRate,
) -> Vec<(u64, Option<Measurement>)> {
    let radar = RadarSettings::paper(level, NoiseTable::Radians, rate, 1);
    let readings = sample_radar(flight, &radar);
    let samples = flight.samples.iter().zip(&readings);
    samples
        .map(|(sample, reading)| {
            let measurement = reading.as_ref().map(Measurement::from);
            (time_us(flight, sample.time_s), measurement)
        })
        .collect()
}

/// Any delay up to half a second for any measurement, outliers, gaps that are coasted or not, two sensors
/// at one time, one pass or several, either kind of blob: once all have come, every number is that of a
/// tracker that met them in the order of their times.
#[test]
fn whatever_the_order_the_end_is_the_same() {
    let flights = flights(12);
    let mut late_ones = 0;
    for (index, flight) in flights.iter().enumerate() {
        let mut random = RandomSource::new(9, &[index as u64]);
        let (bytes, passes) = [(RECURSIVE, 1), (RECURSIVE, 3), (BNKF, 2)][index % 3];
        let coasts = random.chance(0.5);
        let rate = SamplingRate::ALL[random.below(3)];
        let mut calls = Vec::new();
        for (time_us, measurement) in measured(flight, NoiseLevel::ALL[index % 2], rate) {
            match measurement {
                Some(mut measurement) => {
                    if let Some(range) = measurement.range.as_mut()
                        && bytes == RECURSIVE
                        && random.chance(0.1)
                    {
                        range.value += 500.0;
                    }
                    calls.push(Call::Step(measurement));
                    if bytes == RECURSIVE && random.chance(0.2) {
                        measurement.sensor = Sensor::at([0.5, 0.0, 0.0]);
                        calls.push(Call::Step(measurement));
                    }
                }
                None if coasts => calls.push(Call::Coast(time_us)),
                None => {}
            }
        }
        // By arrival.
        let mut arriving: Vec<(u64, Call)> = calls
            .iter()
            .enumerate()
            .map(|(at, call)| match call {
                Call::Step(m) if at > 0 && random.chance(0.5) => {
                    (m.time_us + random.below(LATE_MAX_US as usize) as u64, *call)
                }
                Call::Step(m) => (m.time_us, *call),
                Call::Coast(time_us) => (*time_us, *call),
            })
            .collect();
        arriving.sort_by_key(|(at_us, _)| *at_us);
        // What is of one time counts as it came.
        let mut ordered = arriving.clone();
        ordered.sort_by_key(|(_, call)| match call {
            Call::Step(m) => m.time_us,
            Call::Coast(time_us) => *time_us,
        });
        let mut in_order = tracker(bytes, passes);
        for (_, call) in &ordered {
            call.answer(&mut in_order).expect("an estimate");
        }
        let mut late = LateTracker::new(tracker(bytes, passes));
        let mut newest_us = 0;
        for (_, call) in &arriving {
            let (time_us, answer) = match call {
                Call::Step(m) => (m.time_us, late.step(m)),
                Call::Coast(time_us) => (*time_us, late.coast(*time_us)),
            };
            late_ones += usize::from(time_us < newest_us);
            newest_us = newest_us.max(time_us);
            assert_eq!(answer.expect("an estimate").time_us, newest_us);
        }
        for ahead_us in [100_000, 900_000] {
            let at_us = newest_us + ahead_us;
            assert_eq!(late.coast(at_us), in_order.coast(at_us), "flight {index}");
        }
    }
    assert!(late_ones > 400, "{late_ones}");
}

/// At ten measurements a second, half of them 0.3 s late, a late one runs at most thirteen steps: a million
/// instructions with the shipped model at one pass. Never more than [`CALLS_MAX`].
#[test]
fn a_late_measurement_costs_a_second_of_steps_at_most() {
    let mut most = 0;
    for flight in &flights(4) {
        let mut late = LateTracker::new(tracker(RECURSIVE, 1));
        let steps = measured(flight, NoiseLevel::Medium, SamplingRate::FULL);
        for (k, (time_us, measurement)) in steps.iter().enumerate() {
            if k > 3 && k % 2 == 1 {
                late.step(steps[k - 3].1.as_ref().expect("no gaps"))
                    .expect("late");
                most = most.max(late.calls_rerun());
            }
            match measurement {
                Some(measurement) if k % 2 == 1 || k == 0 => late.step(measurement),
                _ => late.coast(*time_us),
            }
            .expect("an estimate");
        }
    }
    assert!((6..=13).contains(&most), "{most}");
    const { assert!(CALLS_MAX == 40) };
}

/// Mean distance (m) of estimates to the truth of their times, when every reading up to the time has come,
/// which is in order (see above), and at the time itself, when half of the last three have not.
fn distances_m(flights: &[Flight], level: NoiseLevel) -> [f64; 2] {
    const LATE_SAMPLES: usize = 3;
    let mut sums = [0.0; 2];
    let mut count = 0.0;
    for (index, flight) in flights.iter().enumerate() {
        let steps = measured(flight, level, SamplingRate::FULL);
        let mut random = RandomSource::new(4, &[index as u64]);
        let is_late: Vec<bool> = (0..steps.len())
            .map(|k| k > 0 && random.chance(0.5))
            .collect();
        let mut in_order = tracker(RECURSIVE, 1);
        let mut late = LateTracker::new(tracker(RECURSIVE, 1));
        for (k, (time_us, measurement)) in steps.iter().enumerate() {
            let miss = |estimate: &bnkf::Estimate, sample: usize| {
                (0..3)
                    .map(|axis| {
                        let truth = flight.samples[sample].position_m[axis];
                        (f64::from(estimate.position_m[axis]) - truth).powi(2)
                    })
                    .sum::<f64>()
                    .sqrt()
            };
            let measurement = measurement.as_ref().expect("no gaps");
            let ordered = in_order.step(measurement).expect("a step");
            if k >= LATE_SAMPLES && is_late[k - LATE_SAMPLES] {
                let came = steps[k - LATE_SAMPLES].1.as_ref().expect("no gaps");
                late.step(came).expect("late");
            }
            let now = if is_late[k] {
                late.coast(*time_us)
            } else {
                late.step(measurement)
            };
            let now = now.expect("an estimate");
            if k > 0 {
                sums[0] += miss(&ordered, k);
                sums[1] += miss(&now, k);
                count += 1.0;
            }
        }
    }
    sums.map(|sum| sum / count)
}

/// Half of the readings 0.3 s late, ten a second: once all have come nothing is lost; at the time itself a
/// prediction stands in for what is missing.
#[test]
fn half_of_them_late_costs_little_at_the_time_itself() {
    let flights = flights(40);
    for (level, most) in NoiseLevel::ALL.into_iter().zip([1.15, 1.06, 1.04]) {
        let [in_order, at_once] = distances_m(&flights, level);
        let part = at_once / in_order;
        assert!(
            part < most,
            "{level}: {at_once} m, in order {in_order} m, {part}"
        );
        assert!(
            part > 1.0,
            "{level}: {at_once} m, in order {in_order} m, {part}"
        );
    }
}

/// Older ones are refused as a tracker refuses them.
#[test]
fn what_is_more_than_half_a_second_late_is_refused() {
    let flight = &flights(1)[0];
    let steps = measured(flight, NoiseLevel::Low, SamplingRate::FULL);
    let mut late = LateTracker::new(tracker(RECURSIVE, 1));
    for (k, (_, measurement)) in steps.iter().enumerate() {
        if k % 10 != 3 {
            late.step(measurement.as_ref().expect("no gaps"))
                .expect("a step");
        }
        if k % 10 == 9 {
            let too_late = late.step(steps[k - 6].1.as_ref().expect("no gaps"));
            assert!(
                matches!(too_late, Err(StepError::TimeWentBack { .. })),
                "{too_late:?}"
            );
        }
    }
}
