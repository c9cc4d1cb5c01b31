//! A cross-validation that is killed again and again ends with the same bytes.

mod tiny_campaign;

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use tiny_campaign::{evaluation, folder};

/// Files that must not depend on how often the run was killed. The page and `runtime.json` hold
/// times, which never repeat.
const RESULTS: [&str; 14] = [
    "results.json",
    "steps.parquet",
    "cells.csv",
    "phases.csv",
    "bins.csv",
    "reliability.csv",
    "comparisons.csv",
    "forecasts.csv",
    "forecast_comparisons.csv",
    "tunings.csv",
    "variations.csv",
    "bounds.csv",
    "metrics-radians.svg",
    "acceleration-radians.svg",
];

/// Parts of the undisturbed run's time after which the disturbed one is killed.
const KILLED_AT: [f64; 5] = [0.11, 0.43, 0.29, 0.37, 0.07];

#[test]
fn killed_five_times_it_ends_with_the_same_bytes() {
    let (calm, killed) = (folder(), folder());
    let start = Instant::now();
    assert!(evaluation(calm.path()).status().unwrap().success());
    let whole = start.elapsed();

    let mut kills = 0;
    for part in KILLED_AT {
        let mut child = evaluation(killed.path()).spawn().unwrap();
        std::thread::sleep(whole.mul_f64(part).max(Duration::from_millis(50)));
        // A run that was quicker than expected has ended by itself.
        if child.try_wait().unwrap().is_none() {
            child.kill().unwrap();
            kills += 1;
        }
        child.wait().unwrap();
    }
    assert!(kills >= 3, "only {kills} of the runs could be killed");
    assert!(evaluation(killed.path()).status().unwrap().success());
    for name in RESULTS {
        let read = |folder: &Path| std::fs::read(folder.join("out").join(name)).unwrap();
        assert!(read(calm.path()) == read(killed.path()), "{name} differs");
    }
    assert!(
        !killed.path().join("out/work").exists(),
        "the pieces are removed at the end"
    );
}

/// Begins a run and kills it when its folder says what it is.
fn begin(mut command: Command, plan: &Path) {
    let mut child = command.spawn().unwrap();
    let start = Instant::now();
    while !plan.exists() && start.elapsed() < Duration::from_secs(30) {
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(plan.exists());
}

/// What a run says that must fail.
fn refused(mut command: Command) -> String {
    let output = command.stderr(Stdio::piped()).output().unwrap();
    assert!(!output.status.success());
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn pieces_of_another_run_are_refused() {
    let folder = folder();
    let plan = folder.path().join("out/work/plan.json");
    begin(evaluation(folder.path()), &plan);
    let with = |more: &[&str]| {
        let mut command = evaluation(folder.path());
        command.args(more);
        refused(command)
    };
    let text = with(&["--seed", "9"]);
    let expected = "out/work: holds the pieces of another run: ";
    assert!(text.contains(expected), "{text}");
    assert!(text.contains("seed = 1, now 9"), "{text}");
    let text = with(&["--steps"]);
    let steps = format!("{expected}steps = false, now true; remove it");
    assert!(text.contains(&steps), "{text}");
}

#[test]
fn the_same_flights_by_another_path_are_the_same_run() {
    let folder = folder();
    let flights = folder.path().join("d2");
    std::fs::create_dir(&flights).unwrap();
    for number in 0..2 {
        let rows = (0..60).map(|i| format!("{0}.{1},{number}.{i:02},20,{0}\n", i / 10, i % 10));
        let text = format!("timestamp,tx,ty,tz\n{}", rows.collect::<String>());
        std::fs::write(flights.join(format!("{number}.csv")), text).unwrap();
    }
    let of = |path: &str, more: &[&str]| {
        let mut command = evaluation(folder.path());
        command.args(["--flights", path]).args(more);
        command
    };
    let plan = folder.path().join("out/work/plan.json");
    begin(of("d2", &[]), &plan);
    // Opens the folder and finds out that nothing is finished.
    let text = refused(of("./d2", &["--merge"]));
    assert!(text.contains("of its pieces are missing"), "{text}");
    let text = refused(of("d2", &["--merge", "--segment-s", "3"]));
    assert!(
        text.contains("another run: ") && text.contains("segments_sha256 = "),
        "{text}"
    );
    let path = flights.join("0.csv");
    let other = std::fs::read_to_string(&path)
        .unwrap()
        .replace(",20,", ",21,");
    std::fs::write(path, other).unwrap();
    let text = refused(of("d2", &["--merge"]));
    assert!(text.contains("another run: data_sha256 = "), "{text}");
}
