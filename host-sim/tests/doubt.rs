//! `host-sim doubt` from the outside.

mod complaint;

use std::path::Path;
use std::process::{Command, Output};

use complaint::complaint;

const RECURSIVE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/recursive.bnkf");
const MEMORYLESS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/bnkf.bnkf");

fn doubt(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_host-sim"));
    command.current_dir(folder).arg("doubt").args(arguments);
    command.output().expect("host-sim starts")
}

#[test]
fn every_entry_has_a_row_in_every_world() {
    let folder = tempfile::tempdir().unwrap();
    let mean = format!("means, as shipped={RECURSIVE}");
    let sampled = format!("4 passes={RECURSIVE}@4");
    let arguments = [
        "--entry",
        &mean,
        "--entry",
        &sampled,
        "--count",
        "2",
        "--out",
        "out",
        // The largest seed there is.
        "--seed",
        "18446744073709551615",
    ];
    let output = doubt(folder.path(), &arguments);
    assert!(output.status.success(), "{output:?}");
    let text = std::fs::read_to_string(folder.path().join("out/doubt.csv")).unwrap();
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let rows: Vec<csv::StringRecord> = reader.records().collect::<Result<_, _>>().unwrap();
    // Five worlds, three noise levels, two entries.
    assert_eq!(rows.len(), 30);
    for pair in rows.chunks(2) {
        assert_eq!(
            (&pair[0][2], &pair[1][2]),
            ("means, as shipped", "4 passes")
        );
        let share = |row: &csv::StringRecord| row[10].parse::<f64>().unwrap();
        assert_eq!(share(&pair[0]), 0.0);
        assert!(share(&pair[1]) > 0.0);
        assert_eq!(&pair[0][17], "2");
    }
    let page = std::fs::read_to_string(folder.path().join("out/doubt.md")).unwrap();
    assert_eq!(page.matches("| means, as shipped |").count(), 15);
    assert!(page.starts_with("    host-sim doubt --entry"), "{page}");
}

#[test]
fn what_cannot_be_used_is_named_before_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let memoryless = format!("x={MEMORYLESS}");
    let error = complaint(&doubt(folder.path(), &["--entry", &memoryless]));
    assert!(error.contains("--entry x: not a recursive blob"), "{error}");
    let error = complaint(&doubt(folder.path(), &["--entry", "x=missing.bnkf"]));
    assert!(error.contains("missing.bnkf: cannot read"), "{error}");
    std::fs::write(folder.path().join("file"), "").unwrap();
    let recursive = format!("x={RECURSIVE}");
    let arguments = ["--entry", &recursive, "--out", "file/out"];
    let error = complaint(&doubt(folder.path(), &arguments));
    assert!(error.contains("file/out: "), "{error}");
    let output = doubt(folder.path(), &["--entry", "nonsense"]);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        !output.status.success() && text.contains("NAME=BLOB"),
        "{text}"
    );
}
