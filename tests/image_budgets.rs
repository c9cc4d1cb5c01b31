//! Holds the image to `image_budgets.toml`: memory and instructions for the paper's network
//! and for the recursive model.

use std::time::Duration;

use bnkf::blob::{Activation, Blob, FeatureLayout, Kind};
use bnkf::protocol::RefusalCode;
use bnkf::{Inference, Part, Settings};
use bnkf_host_sim::image::build::build_image;
use bnkf_host_sim::image::equality::{Spread, compare, record};
use bnkf_host_sim::image::session::{ImageSession, SessionError};
use bnkf_host_sim::image::stack::deepest;
use bnkf_host_sim::image::toolchain::{Toolchain, ToolchainChoice};
use bnkf_model_export::blob::quantise::quantise;
use bnkf_model_export::blob::writer::{BlobContents, Normalisation, write_blob};
use bnkf_model_export::flights::generator::{GeneratorSettings, generate};
use bnkf_model_export::posterior::architecture::Architecture;
use bnkf_model_export::posterior::gaussian_weights::GaussianWeights;
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
use bnkf_model_export::radar::sampling::RadarSettings;
use bnkf_model_export::radar::sensors::Sensors;
use bnkf_model_export::random_source::RandomSource;
use tempfile::TempPath;

/// What is measured, in the order of the run's figures.
const FIGURES: [&str; 9] = [
    "code_bytes",
    "blob_bytes",
    "ram_static_bytes",
    "stack_bytes",
    "stack_bound_bytes",
    "instructions_step",
    "instructions_coast",
    "instructions_forecasts",
    "instructions_likelihood",
];

/// Untrained weights: what a step costs hardly depends on their values.
fn paper_sized_blob() -> Vec<u8> {
    let architecture = Architecture::new(vec![12, 64, 64, 64, 64, 64, 3]).unwrap();
    let mut random = RandomSource::new(1, &[]);
    let weights = GaussianWeights::random(&architecture, 0.01, &mut random);
    let unit = Normalisation {
        mean: 0.0,
        scale: 10.0,
    };
    write_blob(&BlobContents {
        kind: Kind::Memoryless,
        features: FeatureLayout::Polar12,
        activation: Activation::Gelu,
        passes: 100,
        parameters: vec![2.0, 4.0],
        inputs: vec![unit; 12],
        outputs: vec![unit; 3],
        networks: vec![quantise(&weights)],
    })
    .unwrap()
}

/// The image of `parts` around `bytes` over one flight, with each of `runs`: how the tracker asks and the
/// table of limits. The image.
fn assert_within_budgets(bytes: &[u8], parts: &[Part], runs: &[(Inference, &str)]) -> TempPath {
    let image = tempfile::NamedTempFile::new().unwrap();
    let toolchain = Toolchain::find(ToolchainChoice::Auto).unwrap_or_else(|e| panic!("{e}"));
    build_image(&toolchain, bytes, parts, image.path()).unwrap_or_else(|e| panic!("{e}"));

    let flight = generate(&GeneratorSettings {
        flights: 1,
        ..GeneratorSettings::default()
    })
    .unwrap()
    .remove(0);
    let (noise, table) = (NoiseLevel::Medium, NoiseTable::Radians);
    let radar = RadarSettings::paper(noise, table, SamplingRate::THREE_QUARTERS, 1);
    let steps = record(&flight, &radar, &Sensors::Origin);
    let blob = Blob::parse(bytes).unwrap();
    let stack_bound = deepest(&std::fs::read(image.path()).unwrap()).unwrap();
    let limits: toml::Table = include_str!("image_budgets.toml").parse().unwrap();
    for &(inference, name) in runs {
        let settings = Settings {
            inference,
            ..Settings::of(&blob)
        };
        let mut session = ImageSession::boot(image.path(), Duration::from_secs(120)).unwrap();
        let comparison = compare(&mut session, blob, settings, &steps).unwrap();
        assert!(comparison.all_identical());
        let budget = session.budget().unwrap();
        assert!(
            budget.stack_bytes_max <= stack_bound,
            "{name}: the bound is none"
        );
        let ticks = |ticks| Spread::of(ticks).unwrap().max;

        let figures = [
            budget.flash_bytes - session.ready().blob_bytes,
            session.ready().blob_bytes,
            budget.ram_static_bytes,
            budget.stack_bytes_max,
            stack_bound,
            ticks(&comparison.ticks_measured),
            ticks(&comparison.ticks_coasted),
            ticks(&comparison.forecasts.ticks),
            ticks(&comparison.likelihoods.ticks),
        ];
        let figures: Vec<_> = FIGURES.into_iter().zip(figures).collect();
        let breaches = breaches(limits[name].as_table().unwrap(), &figures);
        assert_eq!(breaches, [""; 0], "{name}; all: {figures:?}");
    }
    image.into_temp_path()
}

/// What is over its limit; there is one limit for every figure.
fn breaches(limits: &toml::Table, figures: &[(&'static str, u32)]) -> Vec<&'static str> {
    assert_eq!(limits.len(), figures.len(), "one limit for every figure");
    let over = figures
        .iter()
        .filter(|(name, figure)| i64::from(*figure) > limits[*name].as_integer().unwrap());
    over.map(|(name, _)| *name).collect()
}

#[test]
fn a_figure_over_its_limit_is_a_breach() {
    let limits: toml::Table = include_str!("image_budgets.toml").parse().unwrap();
    for (name, limits) in &limits {
        let limits = limits.as_table().unwrap();
        let limit = |name| u32::try_from(limits[name].as_integer().unwrap()).unwrap();
        let full = FIGURES.map(|name| (name, limit(name)));
        assert_eq!(breaches(limits, &full), [""; 0], "{name}");
        for over in 0..full.len() {
            let mut figures = full;
            figures[over].1 += 1;
            assert_eq!(breaches(limits, &figures), [figures[over].0], "{name}");
        }
    }
}

#[test]
fn what_is_not_needed_can_be_left_out() {
    let model = include_bytes!("../models/recursive.bnkf");
    let image = assert_within_budgets(model, &[], &[(Inference::Mean, "recursive_lean")]);
    for inference in [passes(16), Inference::Moments] {
        let mut session = ImageSession::boot(&image, Duration::from_secs(120)).unwrap();
        let blob = Blob::parse(model).unwrap();
        let settings = Settings {
            inference,
            ..Settings::of(&blob)
        };
        let refusal = session.reset(settings.into()).unwrap_err();
        let settings = SessionError::Refused(RefusalCode::Settings);
        assert_eq!(refusal.to_string(), settings.to_string());
    }
}

fn passes(passes: u16) -> Inference {
    Inference::of_passes(passes).unwrap()
}

#[test]
fn the_papers_network_stays_within_its_budgets() {
    let runs = [
        (passes(100), "memoryless"),
        (passes(100).frozen(), "memoryless_frozen"),
        (Inference::Moments, "memoryless_moments"),
    ];
    assert_within_budgets(&paper_sized_blob(), &Part::ALL, &runs);
}

#[test]
fn the_recursive_model_stays_within_its_budgets() {
    let model = include_bytes!("../models/recursive.bnkf");
    let runs = [
        (Inference::Mean, "recursive"),
        (passes(16), "recursive_16_passes"),
        (passes(16).frozen(), "recursive_16_passes_frozen"),
        (Inference::Moments, "recursive_moments"),
    ];
    assert_within_budgets(model, &Part::ALL, &runs);
}
