//! The Cortex-M4F image in QEMU: the same bits as the host, refusals instead of panics, budgets.
//!
//! These tests need a compiler for the target and QEMU. Without them they fail and say so:
//! `tests/setup.sh` installs both.

#[path = "untrained/recursive.rs"]
mod untrained;

use std::path::Path;
use std::time::Duration;

use bnkf::blob::{self, Blob, field};
use bnkf::protocol::{InferenceCode, RefusalCode, Reply, Request, Reset, encode};
use bnkf::{Correction, Inference, Part, Settings};
use bnkf_host_sim::image::build::build_image;
use bnkf_host_sim::image::equality::{Comparison, RecordedStep, compare, record};
use bnkf_host_sim::image::log::LogTable;
use bnkf_host_sim::image::qemu::QemuError;
use bnkf_host_sim::image::session::{ImageSession, SessionError};
use bnkf_host_sim::image::toolchain::{Toolchain, ToolchainChoice};
use bnkf_model_export::flights::generator::{GeneratorSettings, generate};
use bnkf_model_export::import::{layers, model, recipe, weight_file};
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
use bnkf_model_export::radar::sampling::RadarSettings;
use bnkf_model_export::radar::sensors::Sensors;

const BNKF: &[u8] = include_bytes!("golden/tiny_bnkf.bnkf");
const BNKFE: &[u8] = include_bytes!("golden/tiny_bnkfe.bnkf");
/// One answer; QEMU runs some tens of millions of instructions a second even on a busy machine.
const ANSWER_TIME_MAX: Duration = Duration::from_secs(120);

/// Builds the image around `blob`.
fn image(blob: &[u8]) -> tempfile::TempPath {
    let path = tempfile::NamedTempFile::new().unwrap().into_temp_path();
    let toolchain = Toolchain::find(ToolchainChoice::Auto).unwrap_or_else(|e| panic!("{e}"));
    build_image(&toolchain, blob, &Part::ALL, &path).unwrap_or_else(|e| panic!("{e}"));
    path
}

fn boot(image: &Path) -> ImageSession {
    ImageSession::boot(image, ANSWER_TIME_MAX).unwrap_or_else(|e| panic!("{e}"))
}

/// A built-in flight of 150 samples at medium noise, one sample in four not measured.
fn flight() -> Vec<RecordedStep> {
    flight_from(&Sensors::Origin)
}

/// The same from other radars.
fn flight_from(sensors: &Sensors) -> Vec<RecordedStep> {
    let settings = GeneratorSettings {
        flights: 1,
        ..GeneratorSettings::default()
    };
    let flight = generate(&settings).unwrap().remove(0);
    let radar = RadarSettings::paper(
        NoiseLevel::Medium,
        NoiseTable::Radians,
        SamplingRate::THREE_QUARTERS,
        1,
    );
    record(&flight, &radar, sensors)
}

fn run(image: &Path, blob: &[u8], correction: Correction, steps: &[RecordedStep]) -> Comparison {
    let blob = Blob::parse(blob).unwrap();
    let settings = Settings {
        correction,
        ..Settings::of(&blob)
    };
    compare(&mut boot(image), blob, settings, steps).unwrap()
}

fn assert_identical(comparison: &Comparison) {
    if let Some(difference) = &comparison.first_difference {
        panic!(
            "{} of {}: {difference}",
            comparison.identical, comparison.steps
        );
    }
    assert!(comparison.all_identical());
    assert!(comparison.forecasts.asked > 0 && comparison.likelihoods.asked > 0);
}

#[test]
fn every_estimate_of_bnkf_is_identical() {
    let image = image(BNKF);
    let steps = flight();
    let gaps = steps
        .iter()
        .filter(|step| step.measurement.is_none())
        .count();
    assert!(steps.len() >= 150 && gaps > 30, "{} {gaps}", steps.len());
    for correction in [Correction::None, Correction::Converted, Correction::Polar] {
        let comparison = run(&image, BNKF, correction, &steps);
        assert_identical(&comparison);
        assert_eq!(comparison.refused, 0);
        assert_eq!(comparison.ticks_coasted.len(), gaps);
        assert_eq!(comparison.ticks_measured.len(), steps.len() - gaps);
    }
}

#[test]
fn every_estimate_of_bnkfe_is_identical() {
    let image = image(BNKFE);
    assert_identical(&run(&image, BNKFE, Correction::Converted, &flight()));
}

#[test]
fn every_estimate_of_the_recursive_tracker_is_identical() {
    let bytes = untrained::recursive_blob(42);
    let image = image(&bytes);
    let blob = Blob::parse(&bytes).unwrap();
    let passes = Inference::of_passes(16).unwrap();
    for inference in [Inference::Mean, passes, passes.frozen(), Inference::Moments] {
        let settings = Settings {
            inference,
            ..Settings::of(&blob)
        };
        let comparison = compare(&mut boot(&image), blob, settings, &flight()).unwrap();
        assert_identical(&comparison);
        assert_eq!(comparison.refused, 0);
    }
}

/// Kernels for the widest layers, and those for any; one output and three.
#[test]
fn every_estimate_with_moments_is_identical() {
    for bytes in [BNKF, BNKFE, include_bytes!("../models/bnkf.bnkf")] {
        let blob = Blob::parse(bytes).unwrap();
        let settings = Settings {
            inference: Inference::Moments,
            ..Settings::of(&blob)
        };
        let comparison = compare(&mut boot(&image(bytes)), blob, settings, &flight()).unwrap();
        assert_identical(&comparison);
        assert_eq!(comparison.refused, 0);
    }
}

/// What PyTorch trained and `model-export import` read, with ReLU; and with tanh, whose moments are other code.
#[test]
fn every_estimate_of_imported_networks_is_identical() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/torch_networks");
    for name in ["relu", "tanh"] {
        let read = |end: &str| std::fs::read(folder.join(format!("{name}.{end}"))).unwrap();
        let recipe = recipe::parse(&String::from_utf8(read("toml")).unwrap()).unwrap();
        let file = weight_file::parse(&read("pt")).unwrap();
        let networks = layers::networks(&file, recipe.convention, None, 13).unwrap();
        let bytes = model::blob(&recipe, &networks).unwrap();
        let image = image(&bytes);
        let blob = Blob::parse(&bytes).unwrap();
        let passes = Inference::of_passes(16).unwrap();
        for inference in [Inference::Mean, passes, passes.frozen(), Inference::Moments] {
            let settings = Settings {
                inference,
                ..Settings::of(&blob)
            };
            let comparison = compare(&mut boot(&image), blob, settings, &flight()).unwrap();
            assert_identical(&comparison);
            assert_eq!(comparison.refused, 0, "{name}");
        }
    }
}

#[test]
fn sensors_that_move_and_take_turns_are_identical() {
    let bytes = untrained::recursive_blob(42);
    let image = image(&bytes);
    let blob = Blob::parse(&bytes).unwrap();
    let moving = Sensors::Circling {
        radius_m: 20.0,
        speed_mps: 15.0,
    };
    let two = Sensors::ByTurns(vec![[-20.0, 0.0, 0.0], [20.0, 0.0, 1000.0]]);
    for sensors in [moving, two] {
        let steps = flight_from(&sensors);
        let comparison = compare(&mut boot(&image), blob, Settings::of(&blob), &steps).unwrap();
        assert_identical(&comparison);
        assert_eq!(comparison.refused, 0);
    }
    // A memoryless blob refuses them, on both sides.
    let image = self::image(BNKF);
    let steps = flight_from(&Sensors::ByTurns(vec![[0.0; 3], [1.0, 0.0, 0.0]]));
    let comparison = run(&image, BNKF, Correction::Converted, &steps);
    assert_identical(&comparison);
    assert!(comparison.refused > 40, "{}", comparison.refused);
}

#[test]
fn the_counter_repeats_and_grows_with_the_passes() {
    let image = image(BNKF);
    let steps = &flight()[..5];
    let blob = Blob::parse(BNKF).unwrap();
    let ticks = |passes| {
        let settings = Settings {
            inference: Inference::of_passes(passes).unwrap(),
            ..Settings::of(&blob)
        };
        compare(&mut boot(&image), blob, settings, steps)
            .unwrap()
            .ticks_measured
    };
    let (few, many) = (ticks(10), ticks(100));
    assert_eq!(few, ticks(10), "instruction counts must not vary");
    for (few, many) in few.iter().zip(&many) {
        assert!((few * 3..few * 10).contains(many), "{few} {many}");
    }
}

#[test]
fn refusals_are_the_same_and_leave_the_track_alone() {
    let image = image(BNKF);
    let mut steps = flight()[..8].to_vec();
    let measured = |at: usize| steps[at].measurement.unwrap();
    let (mut not_finite, mut no_sigma) = (measured(0), measured(0));
    let sensed = |value, sigma| Some(bnkf::Sensed { value, sigma });
    not_finite.range = sensed(f32::NAN, 1.0);
    no_sigma.azimuth = sensed(0.1, 0.0);
    let late = measured(1);
    for (at, measurement) in [(3, not_finite), (4, no_sigma), (5, late)] {
        let time_us = measurement.time_us;
        let measurement = Some(measurement);
        steps.insert(
            at,
            RecordedStep {
                time_us,
                measurement,
            },
        );
    }
    // Nothing to coast from.
    steps.insert(
        0,
        RecordedStep {
            time_us: 0,
            measurement: None,
        },
    );
    let comparison = run(&image, BNKF, Correction::Converted, &steps);
    assert_identical(&comparison);
    assert_eq!(comparison.refused, 4);

    let blob = Blob::parse(BNKF).unwrap();
    let mut session = boot(&image);
    assert_eq!(session.step(0, None).unwrap(), Err(RefusalCode::NotReset));
    let no_passes = Reset {
        inference: InferenceCode::Passes(0),
        ..Settings::of(&blob).into()
    };
    match session.reset(no_passes) {
        Err(SessionError::Refused(RefusalCode::Settings)) => {}
        other => panic!("{other:?}"),
    }
}

#[test]
fn hostile_bytes_are_refused_and_the_next_request_works() {
    let image = image(BNKF);
    let mut session = boot(&image);
    let noise: Vec<u8> = (1..=255).cycle().take(2000).chain([0]).collect();
    let mut flipped = encode(&Request::Hello).unwrap();
    flipped[1] ^= 4;
    for bytes in [&noise[..], &flipped, &[1, 1, 1, 0]] {
        let refused = Reply::Refused(RefusalCode::Frame);
        assert_eq!(session.ask_raw(bytes).unwrap(), refused);
    }
    let hello = encode(&Request::Hello).unwrap();
    let ready = Reply::Ready(session.ready());
    assert_eq!(session.ask_raw(&hello).unwrap(), ready);

    let elf = std::fs::read(&image).unwrap();
    let log = LogTable::of_image(&elf)
        .unwrap()
        .decode(&session.log().unwrap())
        .unwrap();
    let checksum = Blob::parse(BNKF).unwrap().checksum();
    assert_eq!(
        log[0].to_string(),
        format!("INFO  ready: blob {checksum:08x}, {} bytes", BNKF.len())
    );
    let refused = log
        .iter()
        .filter(|line| line.text.starts_with("frame refused"));
    assert_eq!(refused.count(), 3);
}

#[test]
fn a_changed_weight_is_seen() {
    let image = image(BNKF);
    let mut elf = std::fs::read(&image).unwrap();
    let at = elf
        .windows(BNKF.len())
        .position(|bytes| bytes == BNKF)
        .unwrap();
    // The last layer's first weight mean: its offset stands in the last entry of the table.
    let view = Blob::parse(BNKF).unwrap();
    let network = view.networks().next().unwrap();
    let means = network.layer(network.layers() - 1).means;
    let weight = means.as_ptr().addr() - BNKF.as_ptr().addr();
    elf[at + weight] ^= 0x40;
    std::fs::write(&image, &elf).unwrap();
    match ImageSession::boot(&image, ANSWER_TIME_MAX) {
        Err(SessionError::Refused(RefusalCode::Blob)) => {}
        other => panic!("a wrong checksum was accepted: {other:?}"),
    }

    let changed = &mut elf[at..at + BNKF.len()];
    let checksum = blob::checksum(changed).to_le_bytes();
    changed[field::CRC].copy_from_slice(&checksum);
    std::fs::write(&image, &elf).unwrap();
    let comparison = run(&image, BNKF, Correction::Converted, &flight());
    assert!(
        comparison.identical < comparison.steps / 10,
        "{comparison:?}"
    );
    assert!(comparison.first_difference.is_some());
}

#[test]
fn a_file_that_is_no_image_is_an_error() {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), b"no image").unwrap();
    match ImageSession::boot(file.path(), Duration::from_secs(5)) {
        Err(SessionError::Qemu(QemuError::Ended { .. } | QemuError::Silent { .. })) => {}
        other => panic!("{other:?}"),
    }
}
