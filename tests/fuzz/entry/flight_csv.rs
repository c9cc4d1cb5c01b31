//! Any bytes as a flight file: CSV and its kin, and the logs that their first bytes name.

use bnkf_model_export::flights::csv::frame::Frame;
use bnkf_model_export::flights::csv::options::ReadOptions;
use bnkf_model_export::flights::csv::time_unit::TimeUnit;
use bnkf_model_export::flights::flight_file::parse;

/// Panics where the reader panics, accepts what is no flight, or says more than a line.
pub fn run(bytes: &[u8]) {
    let said = ReadOptions {
        time_unit: Some(TimeUnit::Ms),
        frame: Some(Frame::Ned),
        columns: None,
        resample: None,
    };
    let geodetic = ReadOptions {
        frame: Some(Frame::Wgs84),
        ..ReadOptions::default()
    };
    for options in [ReadOptions::default(), said, geodetic] {
        match parse(bytes, "f.csv", &options) {
            Ok(file) => {
                let samples = &file.flight.samples;
                assert!(samples.len() >= 3);
                assert_eq!(samples[0].time_s, 0.0);
                for pair in samples.windows(2) {
                    assert!(pair[0].time_s < pair[1].time_s);
                }
                for sample in samples {
                    let values = sample.position_m.iter().chain(&sample.velocity_mps);
                    assert!(values.into_iter().all(|value| value.is_finite()));
                }
                for note in file.notes {
                    assert!(
                        !note.contains(char::is_control) && note.len() < 400,
                        "{note:?}"
                    );
                }
            }
            Err((line, cause)) => {
                let text = cause.to_string();
                assert!(line != Some(0));
                assert!(
                    !text.contains(char::is_control) && text.len() < 2000,
                    "{text:?}"
                );
            }
        }
    }
}
