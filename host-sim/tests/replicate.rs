//! `host-sim replicate` from the outside.

mod complaint;

use std::path::Path;
use std::process::{Command, Output};

use bnkf_host_sim::replication::results::Results;
use complaint::complaint;

fn replicate(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_host-sim"));
    command.current_dir(folder).arg("replicate").args(arguments);
    command.output().expect("host-sim starts")
}

const TINY: [&str; 8] = [
    "--flights",
    "flights",
    "--segment-s",
    "2",
    "--epochs",
    "1",
    "--passes",
    "8",
];

/// Five recordings of four seconds: ten segments of 20 samples.
fn write_flights(folder: &Path) {
    std::fs::create_dir(folder).unwrap();
    for recording in 0..5 {
        let row = |i: i32| {
            let angle = f64::from(i) * 0.05 + f64::from(recording);
            let (x, y) = (25.0 + 5.0 * angle.cos(), 12.0 + 5.0 * angle.sin());
            format!(
                "{:.1},{x},{y},{}",
                f64::from(i) * 0.1,
                9.0 + 0.01 * f64::from(i)
            )
        };
        let rows: Vec<_> = (0..40).map(row).collect();
        let text = format!("timestamp,tx,ty,tz\n{}\n", rows.join("\n"));
        std::fs::write(folder.join(format!("{recording}.csv")), text).unwrap();
    }
}

#[test]
fn every_line_is_made_the_same_way_twice_and_prose_stays() {
    let folder = tempfile::tempdir().unwrap();
    write_flights(&folder.path().join("flights"));
    let output = replicate(folder.path(), &TINY);
    assert!(output.status.success(), "{output:?}");
    let out = folder.path().join("out/replication");
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let (json, csv, page) = (
        read("replication.json"),
        read("replication.csv"),
        read("replication.md"),
    );
    let results: Results = serde_json::from_str(&json).unwrap();
    assert_eq!(results.provenance.flights, 10);
    assert_eq!(results.provenance.recordings, 5);
    for line in &results.lines {
        for cell in &line.cells {
            let all = cell.scored + cell.dropped + cell.unusable;
            // Two of ten segments are tested at three rates; the first sample is never scored, nor
            // with a network the second where it is a gap.
            let paper = line.section.name().contains("paper") && line.label != "gaps not scored";
            let ahead = line.label.contains("earlier reading");
            if paper && !ahead {
                assert!((112..=114).contains(&all), "{}: {all}", line.label);
            } else {
                assert!((70..=2 * 20 * 3).contains(&all), "{}: {all}", line.label);
            }
            assert!(cell.error_m.is_finite() && cell.distance >= 0.0);
        }
    }
    let by_segment = results
        .lines
        .iter()
        .filter(|l| l.label == "folds by segment");
    assert_eq!(by_segment.count(), 1);
    let changed = page.replace("# The paper", "A reader's own words.\n\n# The paper");
    std::fs::write(out.join("replication.md"), &changed).unwrap();
    assert!(replicate(folder.path(), &TINY).status.success());
    assert_eq!(read("replication.json"), json);
    assert_eq!(read("replication.csv"), csv);
    assert_eq!(read("replication.md"), changed);
}

#[test]
fn what_cannot_be_done_is_said_in_one_line_before_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let said = |arguments: &[&str]| complaint(&replicate(folder.path(), arguments));
    let few = said(&["--builtin", "4"]);
    assert!(
        few.contains("5 folds") && few.contains("4 recordings"),
        "{few}"
    );
    let missing = said(&["--flights", "no-such-folder"]);
    assert!(missing.contains("no-such-folder"), "{missing}");
    let both = said(&["--flights", "x", "--builtin", "9"]);
    assert!(both.contains("cannot be used with"), "{both}");
    assert!(said(&["--passes", "1"]).contains("--passes"));
    assert!(said(&["--epochs", "0"]).contains("--epochs"));
    std::fs::write(folder.path().join("file"), "").unwrap();
    assert!(said(&["--out", "file/below"]).contains("file/below"));
    let broken = folder.path().join("broken");
    std::fs::create_dir(&broken).unwrap();
    std::fs::write(broken.join("a.csv"), "timestamp,tx,ty,tz\n0,1,2\n").unwrap();
    let line = said(&["--flights", "broken"]);
    assert!(line.contains("a.csv") && line.contains('2'), "{line}");
    // The page is a folder: found before anything is trained.
    std::fs::create_dir(folder.path().join("page.md")).unwrap();
    assert!(said(&["--page", "page.md"]).contains("page.md"));
}
