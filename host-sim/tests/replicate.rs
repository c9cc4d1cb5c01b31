//! `host-sim replicate` from the outside.

use std::path::Path;
use std::process::{Command, Output};

use bnkf_host_sim::replication::results::Results;

fn replicate(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_host-sim"));
    command.current_dir(folder).arg("replicate").args(arguments);
    command.output().expect("host-sim starts")
}

/// The one line that a failing command says.
fn complaint(output: &Output) -> String {
    assert!(!output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    let errors: Vec<_> = text
        .lines()
        .filter(|line| line.starts_with("error: "))
        .collect();
    assert_eq!(errors.len(), 1, "{text}");
    errors[0].to_owned()
}

const TINY: [&str; 6] = ["--builtin", "6", "--epochs", "1", "--passes", "8"];

#[test]
fn every_line_is_made_the_same_way_twice_and_prose_stays() {
    let folder = tempfile::tempdir().unwrap();
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
    assert_eq!(results.provenance.flights, 6);
    for line in &results.lines {
        for cell in &line.cells {
            let all = cell.scored + cell.dropped + cell.unusable;
            // Two of six flights are tested at rates 1, 0.75 and 0.5; one kept reading is no pair.
            let bounds = if line.section.name().contains("paper") {
                894..=894
            } else {
                600..=894
            };
            let whole = line.label != "gaps not scored";
            assert!(!whole || bounds.contains(&all), "{}: {all}", line.label);
            assert!(cell.error_m.is_finite() && cell.distance >= 0.0);
        }
    }
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
