//! The Python wheel is built, installed and tested in an environment of its own, and says to the last bit what
//! `host-sim track` says of the same readings.

use std::path::Path;
use std::process::Command;

use bnkf::Settings;
use bnkf_host_sim::contest::default_models;
use bnkf_host_sim::csv_text::csv;
use bnkf_host_sim::exchange::plots::{self, StatedSigmas};
use bnkf_host_sim::exchange::readings::{self, Sighting};
use bnkf_host_sim::exchange::tracked;
use bnkf_host_sim::scenario::radar::Condition;
use bnkf_model_export::flights::generator::{GeneratorSettings, generate};
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
use bnkf_model_export::radar::sampling::{RadarSettings, sample_radar};

/// Writes readings of flights under every condition, of a radar that stands elsewhere, moves, or has no
/// Doppler in turn: the table's every column.
fn write_readings(path: &Path) {
    let flights = generate(&GeneratorSettings {
        flights: 4,
        seed: 5,
        ..GeneratorSettings::default()
    })
    .expect("built-in flights");
    let table = NoiseTable::Radians;
    let mut rows = Vec::new();
    for noise in NoiseLevel::ALL {
        for rate in SamplingRate::ALL {
            for (place, flight) in flights.iter().enumerate() {
                let radar = RadarSettings::paper(noise, table, rate, 1);
                let mut readings = sample_radar(flight, &radar);
                for reading in readings.iter_mut().flatten() {
                    match place {
                        1 => {
                            reading.range_rate_mps = f64::NAN;
                            reading.sigma_range_rate_mps = f64::NAN;
                        }
                        2 => reading.sensor.position_m = [120.5, -40.25, 1.8],
                        3 => reading.sensor.velocity_mps = [0.3, 1.5, -0.1],
                        _ => {}
                    }
                }
                let condition = Condition { table, noise, rate };
                rows.extend(readings::csv_rows(&Sighting {
                    flight,
                    condition,
                    readings,
                }));
            }
        }
    }
    std::fs::write(path, csv(&readings::header(), rows.into_iter())).expect("readings.csv");
}

/// Writes what `host-sim track` says of them.
fn write_estimates(readings: &Path, path: &Path) {
    let model = default_models::recursive().expect("the shipped model");
    let settings = Settings::of(&model.blob());
    let mut rows = Vec::new();
    for target in plots::read(readings, StatedSigmas::default())
        .expect("plots")
        .targets
    {
        let answers = tracked::run(&model, settings, &target).expect("settings of the model");
        rows.extend(answers.iter().map(|answer| answer.row(&target.name)));
    }
    std::fs::write(path, csv(&tracked::HEADER, rows.into_iter())).expect("estimates.csv");
}

#[test]
fn the_wheel_says_what_the_crate_says() {
    let folder = tempfile::tempdir().expect("a folder");
    let readings = folder.path().join("readings.csv");
    write_readings(&readings);
    write_estimates(&readings, &folder.path().join("estimates.csv"));
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/firmware/python/test.sh");
    let mut command = Command::new("bash");
    command.arg(script).arg(folder.path());
    let status = command.status().expect("bash");
    assert!(status.success(), "{script}: {status}");
}
