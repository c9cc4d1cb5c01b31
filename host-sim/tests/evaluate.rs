//! `host-sim evaluate` from the outside: what it writes, and what it says when it cannot.

mod complaint;

use std::path::Path;
use std::process::{Command, Output};

use complaint::complaint;

fn host_sim(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_host-sim"));
    command.args(arguments).output().expect("host-sim starts")
}

/// Two flights of six seconds in the paper's volume, as files.
fn write_flights(folder: &Path) {
    for name in ["a", "b"] {
        let turn = if name == "a" { 0.0 } else { 1.0 };
        let row = |i: i32| {
            let t = f64::from(i) * 0.1;
            let (x, y) = (25.0 + 5.0 * (t + turn).cos(), 12.0 + 5.0 * (t + turn).sin());
            format!("{t:.1},{x},{y},{}", 9.0 + 0.1 * t)
        };
        let rows: Vec<_> = (0..60).map(row).collect();
        let text = format!("timestamp,tx,ty,tz\n{}\n", rows.join("\n"));
        std::fs::write(folder.join(format!("{name}.csv")), text).unwrap();
    }
}

#[test]
fn the_table_and_the_json_hold_every_method_noise_and_rate() {
    let folder = tempfile::tempdir().unwrap();
    write_flights(folder.path());
    let (flights, json) = (
        folder.path().to_str().unwrap(),
        folder.path().join("out.json"),
    );
    let arguments = [
        "evaluate",
        "--flights",
        flights,
        "--passes",
        "4",
        "--json",
        json.to_str().unwrap(),
    ];
    let output = host_sim(&arguments);
    assert!(output.status.success(), "{output:?}");
    let table = String::from_utf8(output.stdout).unwrap();
    assert_eq!(table.matches("118 steps").count(), 9, "{table}");
    for by in ["noise, speed in m/s", "noise, acceleration in m/s"] {
        assert_eq!(table.matches(by).count(), 3, "{table}");
    }

    let text = std::fs::read_to_string(&json).unwrap();
    let results: serde_json::Value = serde_json::from_str(&text).unwrap();
    let cells = results["cells"].as_array().unwrap();
    assert_eq!(cells.len(), 54);
    for method in ["EKF", "UKF", "BNN", "BNKF", "BNKFe", "recursive"] {
        assert_eq!(
            cells.iter().filter(|cell| cell["method"] == method).count(),
            9,
            "{method}"
        );
    }
    for cell in cells {
        assert_eq!(cell["steps"], 118);
        assert!(cell["ed_mean_m"].as_f64().unwrap() > 0.0);
        // 5 m/s in a circle of 5 m.
        let bins = cell["bins"].as_array().unwrap();
        assert_eq!(bins.len(), 13);
        assert_eq!(
            (&bins[2]["by"], &bins[2]["steps"]),
            (&"speed".into(), &118.into())
        );
        assert_eq!(bins[2]["nees_mean"], cell["nees_mean"]);
    }
    let provenance = &results["provenance"];
    assert_eq!(
        (&provenance["flights"], &provenance["segments"]),
        (&2.into(), &2.into())
    );
    assert_eq!(
        provenance["models"].as_array().unwrap()[0]["sha256"]
            .as_str()
            .unwrap()
            .len(),
        64
    );

    // The same command again, on one thread: the same bytes.
    let again = Command::new(env!("CARGO_BIN_EXE_host-sim"))
        .args(arguments)
        .env("RAYON_NUM_THREADS", "1")
        .output()
        .unwrap();
    assert!(again.status.success());
    assert_eq!(std::fs::read_to_string(&json).unwrap(), text);
}

#[test]
fn what_cannot_be_read_is_named_with_file_and_line() {
    let folder = tempfile::tempdir().unwrap();
    let flight = folder.path().join("bad.csv");
    let path = folder.path().to_str().unwrap();
    std::fs::write(&flight, "timestamp,tx,ty,tz\n0.0,1,2,3\n0.1,1,two,3\n").unwrap();
    let error = complaint(&host_sim(&["evaluate", "--flights", path]));
    assert!(error.contains("bad.csv:3: "), "{error}");
    let error = complaint(&host_sim(&["evaluate", "--flights", "/nowhere/flights"]));
    assert!(error.contains("/nowhere/flights: cannot read"), "{error}");

    write_flights(folder.path());
    std::fs::remove_file(&flight).unwrap();
    let model = folder.path().join("m.bnkf");
    std::fs::write(&model, b"BNKF is not enough").unwrap();
    let error = complaint(&host_sim(&[
        "evaluate",
        "--flights",
        path,
        "--model",
        model.to_str().unwrap(),
    ]));
    assert!(error.contains("m.bnkf: "), "{error}");
    let memoryless = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/bnkf.bnkf");
    let error = complaint(&host_sim(&["evaluate", "--quick", "--model", memoryless]));
    assert!(error.contains("recursive blobs"), "{error}");
    let error = complaint(&host_sim(&[
        "evaluate",
        "--flights",
        path,
        "--methods",
        "ekf,ekf",
    ]));
    assert!(error.contains("EKF is named twice"), "{error}");
    let source: [&[&str]; 2] = [&["--flights", path], &["--quick"]];
    for source in source {
        let recursive = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/recursive.bnkf");
        let mut arguments = vec!["evaluate", "--methods", "ekf", "--model", recursive];
        arguments.extend(source);
        let error = complaint(&host_sim(&arguments));
        assert!(error.contains("none of --methods runs on it"), "{error}");
        let mut arguments = vec!["evaluate", "--methods", "recursive"];
        arguments.extend(["--model", recursive, "--model", recursive]);
        arguments.extend(source);
        let error = complaint(&host_sim(&arguments));
        assert!(error.contains("a second --model"), "{error}");
    }
    let error = complaint(&host_sim(&[
        "evaluate",
        "--flights",
        path,
        "--methods",
        "imm5",
    ]));
    assert!(
        error.contains("IMM5") && error.contains("--folds"),
        "{error}"
    );
    let error = complaint(&host_sim(&[
        "evaluate",
        "--flights",
        path,
        "--json",
        "/nowhere/out.json",
    ]));
    assert!(
        error.contains("/nowhere/out.json: cannot write: its folder does not exist"),
        "{error}"
    );
    let error = complaint(&host_sim(&["evaluate", "--flights", path, "--folds", "5"]));
    assert!(error.contains("there are 2 recordings"), "{error}");
    let error = complaint(&host_sim(&["evaluate", "--quick", "--seed", "20260517"]));
    assert!(error.contains("choose another"), "{error}");
    let scenario = folder.path().join("s.toml");
    std::fs::write(&scenario, "name = \"s\"\nsumary = \"typo\"\n").unwrap();
    let error = complaint(&host_sim(&[
        "evaluate",
        "--quick",
        "--scenario",
        scenario.to_str().unwrap(),
    ]));
    assert!(
        error.contains("s.toml:2: unknown field `sumary`"),
        "{error}"
    );
}

/// Half an hour at this speed is no longer than the longest course, at twice the speed it is; five flights of a second
/// have no three samples at 2 Hz; and a speed within its bounds is not, doubled, halved or three times as fast.
#[test]
fn flights_that_another_world_cannot_have_are_refused_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = folder.path().join("s.toml");
    let paper = include_str!("../scenarios/paper.toml");
    let out = folder.path().join("out");
    let (speed, duration) = ("speed_scale = 1.0", "duration_s = 15.0");
    let line = |key: &str| {
        paper
            .lines()
            .position(|line| line.starts_with(key))
            .unwrap()
            + 1
    };
    for (changes, key, own, world) in [
        (
            vec![(speed, "speed_scale = 51.0")],
            speed,
            "`speed_scale` = 51",
            "double speed",
        ),
        (
            vec![(speed, "speed_scale = 0.01")],
            speed,
            "`speed_scale` = 0.01",
            "half speed",
        ),
        (
            vec![(speed, "kind = \"agile\"\nspeed_scale = 34.0")],
            speed,
            "`speed_scale` = 34",
            "as trained",
        ),
        (
            vec![
                (speed, "speed_scale = 3.0"),
                (duration, "duration_s = 1800.0"),
            ],
            speed,
            "`speed_scale` = 3",
            "double speed",
        ),
        (
            vec![(duration, "duration_s = 1.0")],
            duration,
            "`duration_s` = 1",
            "2 Hz",
        ),
    ] {
        let mut text = paper.replace("quick_count = ", "quick_count = 5 # ");
        for (old, new) in &changes {
            assert!(text.contains(old), "{old}");
            text = text.replace(old, new);
        }
        std::fs::write(&scenario, text).unwrap();
        let error = refused(&scenario, &out);
        let line = line(key) + usize::from(changes[0].1.contains('\n'));
        let expected = format!("s.toml:{line}: {own} is too much for the variation \"{world}\"");
        assert!(error.contains(&expected), "{error}");
        assert!(!out.exists());
    }
}

/// What a scenario's evaluation says that cannot be begun.
fn refused(scenario: &Path, out: &Path) -> String {
    complaint(&host_sim(&[
        "evaluate",
        "--quick",
        "--methods",
        "ekf",
        "--scenario",
        scenario.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
    ]))
}

/// A limit on the size of files stands for a full disk: the write fails half-way.
#[test]
fn a_full_disk_leaves_the_old_file_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    write_flights(folder.path());
    let json = folder.path().join("out.json");
    std::fs::write(&json, "old").unwrap();
    let script = format!(
        "trap '' XFSZ; ulimit -f 1; exec {} evaluate --flights {} --methods ekf --json {}",
        env!("CARGO_BIN_EXE_host-sim"),
        folder.path().display(),
        json.display()
    );
    let output = Command::new("sh").args(["-c", &script]).output().unwrap();
    let error = complaint(&output);
    assert!(error.contains("out.json: cannot write"), "{error}");
    assert_eq!(std::fs::read_to_string(&json).unwrap(), "old");
    let left = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 3, "no temporary file stays");
}

/// The same in a cross-validation: the full disk is found before the work, and with space again the
/// run ends.
#[test]
fn a_full_disk_is_found_before_a_cross_validation() {
    let folder = tempfile::tempdir().unwrap();
    let flights = folder.path().join("flights");
    std::fs::create_dir(&flights).unwrap();
    write_flights(&flights);
    let out = folder.path().join("out");
    let command = |limit: &str| {
        let script = format!(
            "{limit} exec {} evaluate --quick --folds 2 --methods ekf --flights {} --out {}",
            env!("CARGO_BIN_EXE_host-sim"),
            flights.display(),
            out.display()
        );
        Command::new("sh").args(["-c", &script]).output().unwrap()
    };
    let error = complaint(&command("trap '' XFSZ; ulimit -f 1;"));
    assert!(error.contains("cannot write"), "{error}");
    let names = |folder: &Path| -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.collect()
    };
    assert_eq!(names(&out), [""; 0], "no work, no result");
    assert!(command("").status.success());
    assert!(names(&out).contains(&"report.html".to_owned()));
}

/// Three fits of each tuned method, of which the cell shows the nearest.
fn every_cell_shows_the_best_fit(out: &Path, results: &serde_json::Value) {
    let fits = results["tunings"].as_array().unwrap();
    let cells = results["cells"].as_array().unwrap();
    assert_eq!((fits.len(), cells.len()), (3 * 2 * 9, 2 * 9));
    for cell in cells {
        let of_cell = |fit: &&serde_json::Value| {
            ["method", "noise", "rate"]
                .iter()
                .all(|key| fit[key] == cell[key])
        };
        let own: Vec<_> = fits.iter().filter(of_cell).collect();
        let tuned_on: Vec<_> = own.iter().map(|fit| &fit["tuned_on"]).collect();
        assert_eq!(tuned_on, ["generated", "recordings", "both"]);
        let ed_m = |fit: &serde_json::Value| fit["ed_mean_m"].as_f64().unwrap();
        let least = own
            .iter()
            .map(|fit| ed_m(fit))
            .fold(f64::INFINITY, f64::min);
        assert_eq!(ed_m(cell), least);
        let chosen: Vec<_> = own.iter().filter(|fit| fit["chosen"] == true).collect();
        assert_eq!(chosen.len(), 1);
        assert_eq!(chosen[0]["tuned_on"], cell["tuned_on"]);
    }
    let csv = std::fs::read_to_string(out.join("tunings.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + fits.len());
}

/// Three runs of two flights are three times the steps, and two flights to the intervals.
#[test]
fn runs_measure_every_flight_again() {
    let folder = tempfile::tempdir().unwrap();
    write_flights(folder.path());
    let flights = folder.path().to_str().unwrap();
    let out = folder.path().join("out");
    let mut arguments = vec!["evaluate", "--flights", flights, "--runs", "3"];
    let output = host_sim(&arguments);
    assert!(!output.status.success());
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("--folds"), "{text}");

    arguments.extend(["--folds", "2", "--place", "--noise-table", "radians"]);
    arguments.extend(["--methods", "converted,fused"]);
    arguments.extend(["--tuning-flights", "2", "--out"]);
    arguments.push(out.to_str().unwrap());
    let output = host_sim(&arguments);
    assert!(output.status.success(), "{output:?}");
    let table = String::from_utf8(output.stdout).unwrap();
    assert_eq!(table.matches("354 steps").count(), 9, "{table}");
    let text = std::fs::read_to_string(out.join("results.json")).unwrap();
    let results: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(results["provenance"]["flights"], 2);
    assert_eq!(results["provenance"]["runs"], 3);
    for comparison in results["comparisons"].as_array().unwrap() {
        assert_eq!(comparison["clusters"], 2, "{comparison}");
    }
    every_cell_shows_the_best_fit(&out, &results);
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("the best of the three, which favours the filters"));
    assert!(page.contains("2 flights from 2 recordings, each 3 times"));
}
