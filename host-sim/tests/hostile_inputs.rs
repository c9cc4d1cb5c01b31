//! What comes from outside and is not what it should be: flight files of other forms, files that are
//! none, outputs that cannot be written, numbers beyond sense.

mod complaint;

use std::path::Path;
use std::process::{Command, Output, Stdio};

use complaint::complaint;

fn host_sim(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_host-sim"));
    let command = command.current_dir(folder).args(arguments);
    command
        .stdin(Stdio::null())
        .output()
        .expect("host-sim starts")
}

/// A flight of ten seconds in the paper's volume as a file, one line for each time and position.
fn write(folder: &Path, name: &str, header: &str, line: impl Fn(f64, [f64; 3]) -> String) {
    let mut text = format!("{header}\n");
    for i in 0..=100 {
        let t = 0.1 * f64::from(i);
        text += &line(
            t,
            [25.0 + 5.0 * t.cos(), 12.0 + 5.0 * t.sin(), 9.0 + 0.1 * t],
        );
        text += "\n";
    }
    std::fs::write(folder.join(name), text).unwrap();
}

/// What an evaluation of one file prints, and what it says beside it.
fn evaluated(folder: &Path, arguments: &[&str]) -> (String, String) {
    let mut all = vec!["evaluate", "--methods", "ekf,recursive", "--flights"];
    all.extend(arguments);
    let output = host_sim(folder, &all);
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    assert!(output.status.success(), "{output:?}");
    (text(&output.stdout), text(&output.stderr))
}

/// One table for every form of the same flight: the same name, so the same noise.
#[test]
fn every_form_of_a_flight_file_gives_the_same_table_and_says_what_was_assumed() {
    let root = tempfile::tempdir().unwrap();
    let folder = |name: &str| {
        let folder = root.path().join(name);
        std::fs::create_dir(&folder).unwrap();
        folder
    };
    let plain = folder("plain");
    write(&plain, "f.csv", "timestamp,tx,ty,tz", |t, [x, y, z]| {
        format!("{t:.1},{x},{y},{z}")
    });
    let (want, said) = evaluated(&plain, &["f.csv"]);
    assert_eq!(said, "");

    let quoted = folder("quoted");
    write(
        &quoted,
        "f.csv",
        "pose,Timestamp,TX,TY,TZ",
        |t, [x, y, z]| format!("\"(1, 0.5, 100.0)\",\"{t:.1}\",\"{x}\",{y},{z}"),
    );
    assert_eq!(
        evaluated(&quoted, &["f.csv"]),
        (want.clone(), String::new())
    );

    let semicolon = folder("semicolon");
    write(&semicolon, "f.csv", "timestamp;tx;ty;tz", |t, [x, y, z]| {
        format!("{t:.1};{x};{y};{z}").replace('.', ",")
    });
    let (table, said) = evaluated(&semicolon, &["f.csv"]);
    assert_eq!(table, want);
    assert_eq!(
        said,
        "note: f.csv: commas within numbers read as decimal signs\n"
    );

    let pyulog = folder("pyulog");
    write(
        &pyulog,
        "f.csv",
        "timestamp,xy_valid,x,y,z",
        |t, [x, y, z]| format!("{:.0},1,{y},{x},{:?}", 1e6 * t, -z),
    );
    let (table, said) = evaluated(&pyulog, &["f.csv"]);
    assert_eq!(table, want);
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(lines.len(), 2, "{said}");
    assert!(lines[0].contains("microseconds") && lines[0].ends_with("--time-unit says otherwise"));
    assert!(
        lines[1].contains("north, east, down") && lines[1].ends_with("--frame enu says otherwise")
    );
    let options = ["f.csv", "--time-unit", "us", "--frame", "ned"];
    assert_eq!(evaluated(&pyulog, &options), (want.clone(), String::new()));

    let named = folder("named");
    write(&named, "f.csv", "stamp,a,b,c", |t, [x, y, z]| {
        format!("{:.0},{x},{y},{z}", 1e3 * t)
    });
    let error = complaint(&host_sim(&named, &["evaluate", "--flights", "f.csv"]));
    assert!(
        error.contains("f.csv:1: column `timestamp` is missing") && error.contains("--columns"),
        "{error}"
    );
    let (table, said) = evaluated(
        &named,
        &["f.csv", "--columns", "stamp,a,b,c", "--frame", "enu"],
    );
    assert_eq!(table, want);
    assert!(said.contains("`stamp` read as milliseconds"), "{said}");
}

#[test]
fn flights_that_no_model_expects_raise_a_warning_that_helps() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "utm.csv", "timestamp,tx,ty,tz", |t, [x, y, z]| {
        format!("{t:.1},{},{},{}", x + 691_000.0, y + 5_334_000.0, z + 520.0)
    });
    let (_, said) = evaluated(folder, &["utm.csv", "--json", "r.json"]);
    assert_eq!(said.lines().count(), 1, "{said}");
    for part in [
        "warning: nothing lies in the models' volume",
        "--place",
        "--radar X,Y,Z",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let json = std::fs::read_to_string(folder.join("r.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["provenance"]["remarks"][0], said.trim_end());
    for help in [&["--place"][..], &["--radar", "691000,5334000,520"]] {
        let arguments = [&["utm.csv"], help].concat();
        assert_eq!(evaluated(folder, &arguments).1, "");
    }
    write(folder, "fast.csv", "timestamp,tx,ty,tz", |t, [x, _, z]| {
        format!("{t:.1},{x},{},{z}", 170.0 * (t - 5.0))
    });
    let (_, said) = evaluated(folder, &["fast.csv", "--segment-s", "0"]);
    assert!(
        said.contains("101 samples are faster than 150 m/s, fast.csv up to 170 m/s"),
        "{said}"
    );
    // A model for kilometres expects kilometres.
    let far = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../models/recursive-counter-uas.bnkf"
    );
    write(folder, "far.csv", "timestamp,tx,ty,tz", |t, [x, y, z]| {
        format!("{t:.1},{},{y},{}", x + 1200.0, z + 90.0)
    });
    assert_eq!(evaluated(folder, &["far.csv", "--model", far]).1, "");
}

#[cfg(unix)]
#[test]
fn inputs_that_are_no_files_are_refused_unread() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let pipe = Command::new("mkfifo").arg(folder.join("pipe")).status();
    assert!(pipe.unwrap().success());
    write(folder, "f.csv", "timestamp,tx,ty,tz", |t, [x, y, z]| {
        format!("{t:.1},{x},{y},{z}")
    });
    for (path, kind) in [("/dev/zero", "a character device"), ("pipe", "a pipe")] {
        let entry = format!("a={path}");
        for arguments in [
            &["evaluate", "--flights", path][..],
            &["evaluate", "--flights", "f.csv", "--model", path],
            &["evaluate", "--quick", "--scenario", path],
            &["evaluate", "--quick", "--model", path],
            &["image", "--model", path],
            &["image", "--image", path],
            &["image", "--flight", path],
            &["doubt", "--entry", &entry],
            &["replicate", "--quick", "--flights", path],
        ] {
            let error = complaint(&host_sim(folder, arguments));
            let expected = format!("error: {path}: {kind}, not a regular file");
            assert!(error.starts_with(&expected), "{arguments:?}: {error}");
        }
    }
}

#[cfg(unix)]
#[test]
fn outputs_that_cannot_be_written_are_refused_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "f.csv", "timestamp,tx,ty,tz", |t, [x, y, z]| {
        format!("{t:.1},{x},{y},{z}")
    });
    std::fs::write(folder.join("file"), "mine").unwrap();
    let link =
        |name: &str| std::os::unix::fs::symlink(folder.join("file"), folder.join(name)).unwrap();
    for name in ["links", "links/work", "somebody", "somebody/work"] {
        std::fs::create_dir(folder.join(name)).unwrap();
    }
    for name in [
        "results.json",
        "trajectory.svg",
        "doubt.md",
        "replication.md",
    ] {
        link(&format!("links/{name}"));
    }
    link("link.json");
    std::fs::write(folder.join("somebody/work/thesis.tex"), "years").unwrap();
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/recursive.bnkf");
    let entry = format!("a={model}");
    // Work that nobody waits for, where it is the output that stops it.
    let evaluate = ["evaluate", "--folds", "5", "--epochs", "1000000", "--out"];
    let doubt = ["doubt", "--count", "2000", "--entry", &entry, "--out"];
    let replicate = ["replicate", "--epochs", "100000", "--out"];
    for command in [&["--out"][..], &evaluate, &doubt, &replicate] {
        for (out, part) in [
            (
                "links",
                "a symbolic link is there, and only a regular file is replaced",
            ),
            ("file", "file: cannot make the folder: "),
            ("file/below", "file/below: cannot make the folder: "),
            ("/proc/self/out", "/proc/self/out: cannot make the folder: "),
        ] {
            let error = complaint(&host_sim(folder, &[command, &[out]].concat()));
            assert!(error.contains(part), "{command:?} {out}: {error}");
        }
    }
    for (arguments, part) in [
        (
            &["evaluate", "--flights", "f.csv", "--json", "link.json"][..],
            "link.json: cannot write: a symbolic link is there",
        ),
        (
            &["evaluate", "--flights", "f.csv", "--json", "links"],
            "links: cannot write: a folder is there",
        ),
        (
            &[
                "replicate",
                "--epochs",
                "100000",
                "--out",
                "new",
                "--page",
                "link.json",
            ],
            "link.json: cannot write: a symbolic link is there",
        ),
        (
            &["evaluate", "--quick", "--out", "somebody"],
            "somebody/work: holds thesis.tex, which is of no evaluation",
        ),
    ] {
        let error = complaint(&host_sim(folder, arguments));
        assert!(error.contains(part), "{arguments:?}: {error}");
    }
    assert_eq!(std::fs::read(folder.join("file")).unwrap(), b"mine");
    assert!(folder.join("links/results.json").is_symlink());
    assert!(folder.join("somebody/work/thesis.tex").exists());
}

#[test]
fn no_command_writes_over_what_it_reads() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for name in ["r", "s", "t", "u"] {
        std::fs::create_dir(folder.join(name)).unwrap();
    }
    // Flights, and at the same time the names of results.
    let flights = [
        "f.csv",
        "r/readings.csv",
        "s/replication.csv",
        "t/cells.csv",
        "u/estimates.csv",
    ];
    for name in flights {
        write(folder, name, "timestamp,tx,ty,tz", |t, [x, y, z]| {
            format!("{t:.1},{x},{y},{z}")
        });
    }
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/recursive.bnkf");
    for copy in ["m.bnkf", "u/doubt.csv"] {
        std::fs::copy(model, folder.join(copy)).unwrap();
    }
    std::fs::hard_link(folder.join("f.csv"), folder.join("g.csv")).unwrap();
    let files = || {
        let names = flights.iter().chain(&["m.bnkf", "u/doubt.csv"]);
        names
            .map(|name| std::fs::read(folder.join(name)).unwrap())
            .collect::<Vec<_>>()
    };
    let before = files();
    // Work that nobody waits for, where it is the output that stops it.
    for (arguments, output, input) in [
        (
            "evaluate --methods ekf --flights f.csv --json f.csv",
            "f.csv",
            "f.csv",
        ),
        (
            "evaluate --methods ekf --flights f.csv --json ./f.csv",
            "./f.csv",
            "f.csv",
        ),
        (
            "evaluate --methods ekf --flights f.csv --json g.csv",
            "g.csv",
            "f.csv",
        ),
        (
            "evaluate --flights f.csv --model m.bnkf --json m.bnkf",
            "m.bnkf",
            "m.bnkf",
        ),
        (
            "evaluate --folds 5 --flights t --out t",
            "t/cells.csv",
            "t/cells.csv",
        ),
        (
            "track --readings u/estimates.csv --out u",
            "u/estimates.csv",
            "u/estimates.csv",
        ),
        (
            "readings --flights r --out r",
            "r/readings.csv",
            "r/readings.csv",
        ),
        (
            "score --quick --estimates A=t/cells.csv --out t",
            "t/cells.csv",
            "t/cells.csv",
        ),
        (
            "replicate --epochs 100000 --flights s --out s",
            "s/replication.csv",
            "s/replication.csv",
        ),
        (
            "replicate --epochs 100000 --flights f.csv --out new --page f.csv",
            "f.csv",
            "f.csv",
        ),
        (
            "doubt --count 2000 --entry a=u/doubt.csv --out u",
            "u/doubt.csv",
            "u/doubt.csv",
        ),
    ] {
        let words: Vec<&str> = arguments.split(' ').collect();
        let error = complaint(&host_sim(folder, &words));
        let expected =
            format!("error: {output}: cannot write: it is an input of this command, {input}");
        assert_eq!(error, expected, "{arguments}");
    }
    assert!(files() == before);
}

#[test]
fn absurd_numbers_are_refused_with_their_range() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "f.csv", "timestamp,tx,ty,tz", |t, [x, y, z]| {
        format!("{t:.1},{x},{y},{z}")
    });
    let huge = usize::MAX.to_string();
    for (arguments, part) in [
        (
            &["evaluate", "--flights", "f.csv", "--segment-s", "nan"][..],
            "segment duration NaN s",
        ),
        (
            &["evaluate", "--flights", "f.csv", "--segment-s=-1"],
            "segment duration -1 s",
        ),
        (
            &["evaluate", "--flights", "f.csv", "--radar", "0,0,1e300"],
            "beyond +-10000000 m",
        ),
        (
            &["evaluate", "--flights", "f.csv", "--passes", "0"],
            "passes",
        ),
        // What no method asks for is no number either.
        (
            &[
                "evaluate",
                "--flights",
                "f.csv",
                "--methods",
                "ekf",
                "--passes",
                "0",
            ],
            "0 is not in 1..=10000",
        ),
        (
            &["evaluate", "--flights", "f.csv", "--segment-s", "0.2"],
            "segment duration 0.2 s: fewer than the 3 samples of a flight in f.csv",
        ),
        (
            &["evaluate", "--quick", "--runs", "0"],
            "0 is not in 1..=1000",
        ),
        (
            &["evaluate", "--quick", "--runs", "4000000000"],
            "is not in 1..=1000",
        ),
        (&["evaluate", "--folds", &huge, "--out", "a"], "recordings"),
        (&["evaluate", "--folds", "0", "--out", "b"], "fold"),
        (
            &["evaluate", "--quick", "--epochs", "0", "--out", "c"],
            "0 is not in 1..=1000000",
        ),
        (
            &[
                "evaluate",
                "--quick",
                "--epochs",
                "4294967295",
                "--out",
                "d",
            ],
            "epochs",
        ),
        (
            &["replicate", "--builtin", &huge],
            "not 1 to 100000 flights",
        ),
        (&["evaluate", "--quick", "--time-unit", "ms"], "--flights"),
        (&["evaluate", "--quick", "--place"], "--flights"),
        (&["evaluate", "--quick", "--segment-s", "8"], "--flights"),
        (&["image", "--frame", "ned"], "--flight"),
        (&["image", "--passes", "0"], "passes"),
    ] {
        let output = host_sim(folder, arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            !output.status.success() && said.contains(part),
            "{arguments:?}: {said}"
        );
        assert!(!said.contains("panicked"), "{said}");
    }
    assert!(!folder.join("c").exists() && !folder.join("d").exists());
}

/// A reader that went away (`| head`) costs no file.
#[cfg(unix)]
#[test]
fn a_closed_standard_output_costs_no_results() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for name in ["a.csv", "b.csv"] {
        write(folder, name, "timestamp,tx,ty,tz", |t, [x, y, z]| {
            format!("{t:.1},{x},{y},{z}")
        });
    }
    for (arguments, result) in [
        (
            &[
                "evaluate",
                "--methods",
                "ekf",
                "--flights",
                ".",
                "--json",
                "r.json",
            ][..],
            "r.json",
        ),
        (
            &[
                "evaluate",
                "--quick",
                "--folds",
                "2",
                "--methods",
                "ekf",
                "--flights",
                ".",
                "--out",
                "out",
            ],
            "out/report.html",
        ),
    ] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = Command::new(env!("CARGO_BIN_EXE_host-sim"))
            .current_dir(folder)
            .args(arguments)
            .stdout(writer)
            .output()
            .unwrap();
        assert!(complaint(&output).contains("standard output"), "{output:?}");
        assert!(folder.join(result).is_file(), "{result}");
    }
}
