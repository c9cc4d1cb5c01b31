//! A cross-validation that is killed again and again ends with the same bytes.

mod tiny_campaign;

use std::path::Path;
use std::process::Stdio;
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

#[test]
fn pieces_of_another_run_are_refused() {
    let folder = folder();
    let mut child = evaluation(folder.path()).spawn().unwrap();
    let plan = folder.path().join("out/work/plan.json");
    let start = Instant::now();
    while !plan.exists() && start.elapsed() < Duration::from_secs(30) {
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(plan.exists());
    let output = evaluation(folder.path())
        .args(["--seed", "9"])
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success());
    assert!(
        text.contains("out/work: holds the pieces of another run"),
        "{text}"
    );
}
