//! What fuzzing found worth keeping, replayed without a fuzzer: `tests/fuzz/corpus/<target>/`.

use std::path::Path;

#[path = "fuzz/entry/blob_steps.rs"]
mod blob_steps;
#[path = "fuzz/entry/flight_csv.rs"]
mod flight_csv;
#[path = "fuzz/entry/frame_reader.rs"]
mod frame_reader;
#[path = "fuzz/entry/scenario_toml.rs"]
mod scenario_toml;
#[path = "fuzz/entry/torch_weights.rs"]
mod torch_weights;

/// Most files of a corpus and most bytes of each: what is checked in stays small.
const FILES_MAX: usize = 64;
const BYTES_MAX: usize = 9216;

fn replay(target: &str, run: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fuzz/corpus")
        .join(target);
    let entries = std::fs::read_dir(&folder).unwrap();
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(
        (10..=FILES_MAX).contains(&files.len()),
        "{} files",
        files.len()
    );
    for file in files {
        let bytes = std::fs::read(&file).unwrap();
        assert!(bytes.len() <= BYTES_MAX, "{}", file.display());
        // Says which file it was.
        std::panic::catch_unwind(|| run(&bytes))
            .unwrap_or_else(|_| panic!("{} fails, see above", file.display()));
    }
}

#[test]
fn flight_csv_corpus() {
    replay("flight_csv", flight_csv::run);
}

#[test]
fn scenario_toml_corpus() {
    replay("scenario_toml", scenario_toml::run);
}

#[test]
fn blob_steps_corpus() {
    replay("blob_steps", blob_steps::run);
}

#[test]
fn frame_reader_corpus() {
    replay("frame_reader", frame_reader::run);
}

#[test]
fn torch_weights_corpus() {
    replay("torch_weights", torch_weights::run);
}
