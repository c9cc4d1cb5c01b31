//! Sensors that are elsewhere, take turns or move: nothing depends on where the frame's origin is, a
//! second radar helps, and one on a vehicle is as good as one that stands.

use bnkf::blob::Blob;
use bnkf::call::Call;
use bnkf::{Estimate, Measurement, Mode, Sensed, Sensor, Settings, StepError, Tracker};
use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::generator::{GeneratorSettings, generate};
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
use bnkf_model_export::radar::sampling::{RadarSettings, sample_radars, time_us};
use bnkf_model_export::radar::sensors::Sensors;

const RECURSIVE: &[u8] = include_bytes!("../models/recursive.bnkf");
const BNKF: &[u8] = include_bytes!("../models/bnkf.bnkf");

fn tracker(bytes: &[u8]) -> Tracker<'_> {
    let blob = Blob::parse(bytes).expect("shipped blob");
    let mut settings = Settings::of(&blob);
    settings.inference = settings.inference.at_most(4);
    Tracker::new(blob, settings).expect("settings of the blob")
}

/// What a tracker is asked over a flight.
fn calls(flight: &Flight, level: NoiseLevel, sensors: &Sensors) -> Vec<Call> {
    let radar = RadarSettings::paper(level, NoiseTable::Radians, SamplingRate::THREE_QUARTERS, 1);
    let readings = sample_radars(flight, &radar, |turn, time_s| sensors.pose(turn, time_s));
    let samples = flight.samples.iter().zip(&readings);
    samples
        .map(|(sample, reading)| {
            let measurement = reading.as_ref().map(Measurement::from);
            Call::new(time_us(flight, sample.time_s), measurement)
        })
        .collect()
}

fn flights(flights: usize, seed: u64) -> Vec<Flight> {
    generate(&GeneratorSettings {
        flights,
        seed,
        ..GeneratorSettings::default()
    })
    .expect("built-in flights")
}

fn answers(calls: &[Call]) -> Vec<Estimate> {
    let mut tracker = tracker(RECURSIVE);
    calls
        .iter()
        .map(|call| call.answer(&mut tracker).expect("an estimate"))
        .collect()
}

/// A kilometre away, east, south and up: a radar that stands gives the same covariances and velocities to
/// the bit, and positions to the rounding of a coordinate beyond 1,024 m (half of 2^-13 m); of one that
/// drives, whose own coordinates are rounded, positions to a millimetre.
#[test]
fn where_the_worlds_origin_is_changes_nothing() {
    let away = [1000.0_f32, -700.0, 300.0];
    let sites = Sensors::ByTurns(vec![[-20.0, 0.0, 0.0], [20.0, 0.0, 5.0]]);
    let circle = Sensors::Circling {
        radius_m: 20.0,
        speed_mps: 15.0,
    };
    for (sensors, position_m, identical) in [
        (&Sensors::Origin, 6.5e-5, true),
        (&sites, 6.5e-5, true),
        (&circle, 1e-3, false),
    ] {
        for flight in &flights(4, 5) {
            for level in NoiseLevel::ALL {
                let here = calls(flight, level, sensors);
                let there: Vec<Call> = here
                    .iter()
                    .map(|call| match *call {
                        Call::Step(mut measurement) => {
                            for (x, by) in measurement.sensor.position_m.iter_mut().zip(away) {
                                *x += by;
                            }
                            Call::Step(measurement)
                        }
                        coast => coast,
                    })
                    .collect();
                for (a, b) in answers(&here).iter().zip(answers(&there)) {
                    for axis in 0..3 {
                        let apart = f64::from(b.position_m[axis])
                            - f64::from(a.position_m[axis])
                            - f64::from(away[axis]);
                        assert!(apart.abs() <= position_m, "{sensors:?} {apart}");
                    }
                    if identical {
                        assert_eq!(a.motion, b.motion);
                        assert_eq!((a.nis, a.mode, a.outside), (b.nis, b.mode, b.outside));
                    }
                }
            }
        }
    }
}

/// Mean distance to the truth, metres, of every step after the first.
fn mean_distance_m(flights: &[Flight], level: NoiseLevel, sensors: &Sensors) -> f64 {
    let mut sum = 0.0;
    let mut steps = 0;
    for flight in flights {
        let estimates = answers(&calls(flight, level, sensors));
        for (sample, estimate) in flight.samples.iter().zip(&estimates).skip(1) {
            let squared = (0..3).map(|axis| {
                (f64::from(estimate.position_m[axis]) - sample.position_m[axis]).powi(2)
            });
            sum += squared.sum::<f64>().sqrt();
            steps += 1;
        }
    }
    sum / f64::from(steps)
}

fn site(x: f64, y: f64) -> Sensors {
    Sensors::ByTurns(vec![[x, y, 0.0]])
}

/// Two radars that measure by turns are better than either with all the readings, at every noise.
#[test]
fn two_radars_are_better_than_one() {
    let flights = flights(40, 4242);
    for level in NoiseLevel::ALL {
        let both = Sensors::ByTurns(vec![[-20.0, 0.0, 0.0], [20.0, 0.0, 0.0]]);
        let both = mean_distance_m(&flights, level, &both);
        for x in [-20.0, 20.0] {
            let alone = mean_distance_m(&flights, level, &site(x, 0.0));
            assert!(both < alone, "{level} noise: {both} m, alone {alone} m");
        }
    }
}

/// A radar on a vehicle at 15 m/s is within 5 % of one that stands, as a mean of eight places on its way.
#[test]
fn a_radar_on_a_vehicle_is_as_good_as_one_that_stands() {
    let flights = flights(40, 4242);
    for level in NoiseLevel::ALL {
        let driving = Sensors::Circling {
            radius_m: 20.0,
            speed_mps: 15.0,
        };
        let driving = mean_distance_m(&flights, level, &driving);
        let standing = (0..8)
            .map(|eighth| {
                let (sine, cosine) = (f64::from(eighth) * core::f64::consts::FRAC_PI_4).sin_cos();
                mean_distance_m(&flights, level, &site(20.0 * cosine, 20.0 * sine))
            })
            .sum::<f64>()
            / 8.0;
        assert!(
            driving < 1.05 * standing,
            "{level} noise: {driving} m, standing {standing} m"
        );
    }
}

fn sensed(value: f32, sigma: f32) -> Option<Sensed> {
    Some(Sensed { value, sigma })
}

/// What a sensor sees of a target that hovers at (30, 13, 13) m.
fn seen(time_us: u64, sensor: Sensor) -> Measurement {
    let relative = core::array::from_fn(|axis| [30.0, 13.0, 13.0][axis] - sensor.position_m[axis]);
    let own = sensor.velocity_mps.map(|v| 0.0 - v);
    let [elevation, azimuth, range, range_rate] = bnkf::radar::predict(relative, own).measurement;
    Measurement {
        time_us,
        range: sensed(range, 0.1),
        elevation: sensed(elevation, 0.005),
        azimuth: sensed(azimuth, 0.005),
        range_rate: sensed(range_rate, 0.05),
        sensor,
    }
}

/// The same numbers of another radar are another measurement; two radars may measure at one time.
#[test]
fn two_sensors_may_measure_at_one_time() {
    let mut tracker = tracker(RECURSIVE);
    let sensors = [Sensor::ORIGIN, Sensor::at([40.0, 0.0, 0.0])];
    let mut last = None;
    for i in 0..20 {
        for sensor in sensors {
            let measurement = seen(i * 100_000, sensor);
            let estimate = tracker.step(&measurement).expect("a step");
            let expected = if last.is_none() {
                Mode::Started
            } else {
                Mode::Tracking
            };
            assert_eq!(estimate.mode, expected);
            assert_eq!(tracker.step(&measurement), Err(StepError::Repeated));
            last = Some(estimate);
        }
    }
    let estimate = last.expect("an estimate");
    for (x, truth) in estimate.position_m.into_iter().zip([30.0, 13.0, 13.0]) {
        assert!((x - truth).abs() < 0.1, "{estimate:?}");
    }
    let same_numbers = Measurement {
        sensor: Sensor::at([40.0, 0.0, 0.5]),
        ..seen(1_900_000, sensors[1])
    };
    assert!(tracker.step(&same_numbers).is_ok());
}

/// Through a gap a track goes on as its last sensor sees it, and the next one finds it.
#[test]
fn a_coast_between_two_sensors_keeps_the_place() {
    let mut tracker = tracker(RECURSIVE);
    let far = Sensor {
        position_m: [1030.0, -2000.0, 50.0],
        velocity_mps: [0.0, 30.0, 0.0],
    };
    let near = Sensor {
        position_m: [10.0, -10.0, 1.0],
        velocity_mps: [12.0, 9.0, 0.0],
    };
    for i in 0..30 {
        tracker.step(&seen(i * 100_000, near)).expect("a step");
    }
    let coasted = tracker.coast(3_400_000).expect("an estimate");
    for (x, truth) in coasted.position_m.into_iter().zip([30.0, 13.0, 13.0]) {
        assert!((x - truth).abs() < 0.3, "{coasted:?}");
    }
    // Two kilometres away nothing of the population holds, and nothing jumps.
    let found = tracker.step(&seen(3_500_000, far)).expect("a step");
    assert_eq!((found.mode, found.outside), (Mode::Tracking, true));
    for (x, truth) in found.position_m.into_iter().zip([30.0, 13.0, 13.0]) {
        assert!((x - truth).abs() < 0.3, "{found:?}");
    }
}

/// What the paper's networks know they know of one radar at rest in the origin.
#[test]
fn a_memoryless_model_refuses_other_sensors() {
    let mut tracker = tracker(BNKF);
    let mut alone = self::tracker(BNKF);
    for i in 0..10 {
        let measurement = seen(i * 100_000, Sensor::ORIGIN);
        let moving = Sensor {
            velocity_mps: [0.0, 0.1, 0.0],
            ..Sensor::ORIGIN
        };
        for sensor in [Sensor::at([40.0, 0.0, 0.0]), moving] {
            let refused = tracker.step(&seen(i * 100_000, sensor));
            assert_eq!(refused, Err(StepError::Sensor));
        }
        // A refusal leaves the track as it was.
        assert_eq!(tracker.step(&measurement), alone.step(&measurement));
    }
}

/// Takes out what a measurement is to lack.
type Mask = fn(&mut Measurement);

/// Twenty whole measurements of a target at rest, then ten that lack what `mask` takes out: how far the last
/// estimate is from it, m.
fn astray_m(direction: [f32; 2], mask: Mask) -> f32 {
    let [elevation, azimuth] = direction;
    let mut tracker = tracker(RECURSIVE);
    let mut last = None;
    for i in 0..30 {
        let mut measurement = Measurement {
            time_us: 100_000 * i,
            range: sensed(33.0, 0.1),
            elevation: sensed(elevation, 0.005),
            azimuth: sensed(azimuth, 0.005),
            range_rate: sensed(0.0, 0.05),
            sensor: Sensor::ORIGIN,
        };
        if i >= 20 {
            mask(&mut measurement);
        }
        last = Some(tracker.step(&measurement).expect("an estimate"));
    }
    let truth = bnkf::radar::position(33.0, elevation, azimuth);
    let position_m = last.expect("an estimate").position_m;
    (0..3)
        .map(|axis| (position_m[axis] - truth[axis]).powi(2))
        .sum::<f32>()
        .sqrt()
}

/// Whatever a radar does not measure, at any elevation: where the target is round it makes no difference.
#[test]
fn the_tracker_does_not_know_north() {
    let masks: [(&str, Mask); 5] = [
        ("all", |_| ()),
        ("no azimuth", |m| m.azimuth = None),
        ("no elevation", |m| m.elevation = None),
        ("elevation", |m| {
            (m.range, m.azimuth, m.range_rate) = (None, None, None)
        }),
        ("range", |m| {
            (m.elevation, m.azimuth, m.range_rate) = (None, None, None)
        }),
    ];
    for elevation in [-1.3, 0.4, 1.1, 1.3, 1.5] {
        for (name, mask) in masks {
            let beside = astray_m([elevation, 0.5], mask);
            assert!(beside < 0.2, "{name} at {elevation}: {beside} m");
            for azimuth in [1.7, 2.8, -2.2] {
                let round = astray_m([elevation, azimuth], mask);
                assert!(
                    (round - beside).abs() < 0.01,
                    "{name} at {elevation}, {azimuth}: {round} m, {beside} m elsewhere"
                );
            }
        }
    }
}
