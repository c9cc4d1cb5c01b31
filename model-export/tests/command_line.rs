//! The program as its users run it: train, interrupt, resume, inspect, verify, and what it says of
//! wrong inputs.

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// A run of a second or two.
const SMALL: [&str; 11] = [
    "train",
    "--builtin",
    "4",
    "--hidden",
    "8,8",
    "--epochs",
    "30",
    "--grid-epochs",
    "10",
    "--batch",
    "64",
];

fn model_export(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_model-export"));
    command
        .current_dir(folder)
        .args(arguments)
        .stdin(Stdio::null());
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    model_export(folder, arguments)
        .output()
        .expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn small(out: &str, more: &[&'static str]) -> Vec<String> {
    let out = ["--out", out];
    let words = SMALL.iter().chain(&out).chain(more);
    words.map(|word| (*word).to_owned()).collect()
}

fn train(folder: &Path, out: &str, more: &[&'static str]) -> Output {
    let arguments = small(out, more);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    run(folder, &arguments)
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_continues_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let whole = train(folder, "whole.bnkf", &["--threads", "2"]);
    assert!(whole.status.success(), "{}", text(&whole.stderr));

    let arguments = small("part.bnkf", &["--threads", "1"]);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let mut child = model_export(folder, &arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let stderr = BufReader::new(child.stderr.take().unwrap());
    let mut lines = stderr.lines().map(|line| line.unwrap());
    assert!(lines.any(|line| line.starts_with("epoch 1/40: ")));
    let pid = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-INT", &pid])
            .status()
            .unwrap()
            .success()
    );
    let rest: Vec<String> = lines.collect();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{rest:?}");
    assert!(
        rest.iter()
            .any(|line| line.contains("continue with --resume")),
        "{rest:?}"
    );
    assert!(folder.join("part.bnkf.checkpoint").exists());
    assert!(!folder.join("part.bnkf").exists());

    let anew = train(folder, "part.bnkf", &[]);
    assert_eq!(anew.status.code(), Some(1));
    assert!(text(&anew.stderr).contains("an interrupted run lies here"));
    let other = train(folder, "part.bnkf", &["--resume", "--seed", "2"]);
    assert_eq!(other.status.code(), Some(1));
    assert!(
        text(&other.stderr).contains("seed = 1, this run has 2"),
        "{}",
        text(&other.stderr)
    );

    let checkpoint = folder.join("part.bnkf.checkpoint");
    let interrupted = std::fs::read(&checkpoint).unwrap();
    let resumed = train(folder, "part.bnkf", &["--resume"]);
    assert!(resumed.status.success(), "{}", text(&resumed.stderr));
    for ending in ["", ".f32"] {
        let read = |name: &str| std::fs::read(folder.join(format!("{name}.bnkf{ending}"))).unwrap();
        assert!(read("whole") == read("part"), "{ending}");
    }
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let whole = read("whole.bnkf.json").replace("whole.bnkf --threads 2", "part.bnkf");
    assert_eq!(whole, read("part.bnkf.json"));
    assert!(!checkpoint.exists());

    // Whoever reads the output goes away: the run is finished all the same.
    std::fs::write(&checkpoint, interrupted).unwrap();
    let arguments = small("part.bnkf", &["--resume"]);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let mut unheard = model_export(folder, &arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    drop(unheard.stdout.take());
    unheard.wait().unwrap();
    assert!(!checkpoint.exists());
}

#[test]
fn a_trained_model_can_be_inspected_and_verified() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (out, more) in [("one.bnkf", None), ("three.bnkf", Some("--ensemble"))] {
        let more: Vec<&'static str> = more.into_iter().collect();
        let trained = train(folder, out, &more);
        assert!(trained.status.success(), "{}", text(&trained.stderr));
        assert!(text(&trained.stdout).contains("SHA-256"));
        let inspected = run(folder, &["inspect", out]);
        assert!(inspected.status.success());
        assert!(text(&inspected.stdout).contains("polar-13 (13 inputs)"));
        let verified = run(folder, &["verify", out, "--rows", "20", "--passes", "400"]);
        assert!(verified.status.success(), "{}", text(&verified.stderr));
        assert!(text(&verified.stdout).contains("sigma ratio"));
    }

    // Weights that belong to another blob, and a blob with one bit changed.
    std::fs::copy(folder.join("three.bnkf.f32"), folder.join("one.bnkf.f32")).unwrap();
    let swapped = run(folder, &["verify", "one.bnkf"]);
    assert_eq!(swapped.status.code(), Some(1));
    assert_eq!(
        text(&swapped.stderr),
        "error: one.bnkf.f32: belongs to another blob\n"
    );
    let mut bytes = std::fs::read(folder.join("one.bnkf")).unwrap();
    bytes[500] ^= 1;
    std::fs::write(folder.join("one.bnkf"), bytes).unwrap();
    for command in ["inspect", "verify"] {
        let damaged = run(folder, &[command, "one.bnkf"]);
        assert_eq!(damaged.status.code(), Some(1));
        assert!(text(&damaged.stderr).starts_with("error: one.bnkf: "));
    }
}

#[test]
fn rounding_without_grid_epochs_is_found_too_coarse() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let arguments = "train --builtin 4 --hidden 8,8 --epochs 30 --batch 64 --grid-epochs 0 --initial-sigma 0.001 --out m.bnkf";
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let trained = run(folder, &arguments);
    assert!(trained.status.success(), "{}", text(&trained.stderr));
    let verified = run(
        folder,
        &["verify", "m.bnkf", "--rows", "20", "--passes", "400"],
    );
    assert_eq!(
        verified.status.code(),
        Some(1),
        "{}",
        text(&verified.stdout)
    );
    assert!(text(&verified.stderr).contains("rounding moves the estimates further than 5 %"));
}

#[test]
fn wrong_inputs_are_named_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::create_dir(folder.join("flights")).unwrap();
    let bad = "timestamp,tx,ty,tz\n0,1,2,3\n0.1,oops,2,3\n0.2,1,2,3\n";
    std::fs::write(folder.join("flights/bad.csv"), bad).unwrap();
    std::fs::create_dir(folder.join("empty")).unwrap();
    std::fs::write(folder.join("no.bnkf"), "not a blob").unwrap();
    std::fs::write(folder.join("torn.bnkf.checkpoint"), "BNKFrun1 torn").unwrap();
    let cases: [(&[&str], &str); 16] = [
        (
            &["train", "--flights", "flights", "--out", "m.bnkf"],
            "bad.csv:3: ",
        ),
        (
            &["train", "--flights", "empty", "--out", "m.bnkf"],
            "empty: no .csv, .txt, .tum, .ulg or .bin file",
        ),
        (
            &["train", "--flights", "none", "--out", "m.bnkf"],
            "none: cannot read",
        ),
        (
            &["train", "--builtin", "1", "--out", "m.bnkf"],
            "at least two are needed",
        ),
        (
            &["train", "--out", "m.bnkf"],
            "--flights PATH or --builtin N",
        ),
        (
            &["train", "--builtin", "3", "--out", "none/m.bnkf"],
            "its folder does not exist",
        ),
        (
            &[
                "train",
                "--builtin",
                "3",
                "--out",
                "m.bnkf",
                "--hidden",
                "70",
            ],
            "width 70",
        ),
        (
            &[
                "train",
                "--builtin",
                "3",
                "--out",
                "m.bnkf",
                "--prior-sigma",
                "0",
            ],
            "--prior-sigma 0",
        ),
        (
            &[
                "train",
                "--builtin",
                "3",
                "--out",
                "m.bnkf",
                "--rate",
                "NaN",
            ],
            "--rate NaN",
        ),
        (
            &["train", "--builtin", "3", "--out", "m.bnkf", "--resume"],
            "m.bnkf.checkpoint: cannot read",
        ),
        (
            &["train", "--builtin", "3", "--out", "torn.bnkf", "--resume"],
            "is damaged",
        ),
        (
            &[
                "train",
                "--kind",
                "recursive",
                "--out",
                "m.bnkf",
                "--grid-epochs",
                "3",
            ],
            "--grid-epochs does not apply to --kind recursive",
        ),
        (
            &[
                "train",
                "--kind",
                "recursive",
                "--out",
                "m.bnkf",
                "--grid-rate",
                "0.5",
            ],
            "--grid-rate does not apply to --kind recursive",
        ),
        (
            &[
                "train",
                "--builtin",
                "3",
                "--out",
                "m.bnkf",
                "--episodes",
                "3",
            ],
            "--episodes does not apply to --kind memoryless",
        ),
        (&["inspect", "no.bnkf"], "no.bnkf: blob is truncated"),
        (&["verify", "none.bnkf"], "none.bnkf: cannot read"),
    ];
    for (arguments, part) in cases {
        let output = run(folder, arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
        let error: Vec<&str> = said
            .lines()
            .filter(|line| line.starts_with("error: "))
            .collect();
        assert!(
            error.len() == 1 && error[0].contains(part),
            "{arguments:?}: {said}"
        );
        assert!(said.ends_with(&format!("{}\n", error[0])), "{said}");
        assert!(!folder.join("m.bnkf").exists());
    }
}

/// An option that would do nothing is refused, and named.
#[test]
fn no_command_writes_over_what_it_reads() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let models = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../models"));
    for (name, copy) in [
        ("recursive.bnkf", "m"),
        ("recursive.bnkf.f32", "m.f32"),
        ("bnkf.bnkf", "mm"),
        ("../docs/sample-flights/README.md", "net.pt"),
        ("../docs/sample-flights/README.md", "net.toml"),
    ] {
        std::fs::copy(models.join(name), folder.join(copy)).unwrap();
    }
    let rows = (0..200).map(|i| format!("{}.0,{i},2,3\n", i));
    let flight = format!("timestamp,tx,ty,tz\n{}", rows.collect::<String>());
    std::fs::write(folder.join("f.csv"), flight).unwrap();
    let names = ["m", "m.f32", "mm", "net.pt", "net.toml", "f.csv"];
    let files = || names.map(|name| std::fs::read(folder.join(name)).unwrap());
    let before = files();
    for (arguments, lost) in [
        ("moments mm --json mm", "mm"),
        (
            "import --weights net.pt --recipe net.toml --out net.pt",
            "net.pt",
        ),
        (
            "import --weights net.pt --recipe net.toml --out net.toml",
            "net.toml",
        ),
        ("tune m --flights f.csv --out m", "m"),
        ("tune m --flights f.csv --out m.f32", "m.f32"),
        ("tune m --flights f.csv --out f.csv", "f.csv"),
        ("train --kind recursive --from m --out m", "m"),
        ("train --flights f.csv --out f.csv", "f.csv"),
    ] {
        let words: Vec<&str> = arguments.split(' ').collect();
        let output = run(folder, &words);
        let said = text(&output.stderr);
        let expected = format!("{lost}: cannot write: it is an input of this command, {lost}\n");
        assert!(!output.status.success(), "{arguments}");
        assert!(said.ends_with(&expected), "{arguments}: {said}");
    }
    assert!(files() == before);
}

#[test]
fn options_without_a_meaning_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let models = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/");
    let [bnkf, recursive] = ["bnkf.bnkf", "recursive.bnkf"].map(|name| format!("{models}{name}"));
    let refused = |arguments: &str, code: i32| {
        let arguments: Vec<&str> = arguments.split(' ').collect();
        let output = run(folder.path(), &arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        said
    };
    for option in ["--noise-table printed", "--rows 5", "--passes 50"] {
        let said = refused(&format!("verify {recursive} {option}"), 1);
        let (name, _) = option.split_once(' ').unwrap();
        let expected = format!("error: {name} does not apply to a recursive blob\n");
        assert_eq!(said, expected);
    }
    for option in [
        "--scenario counter-uas",
        "--tracker-passes 2",
        "--speed 2",
        "--size 2",
    ] {
        let said = refused(&format!("verify {bnkf} {option}"), 1);
        let (name, _) = option.split_once(' ').unwrap();
        let expected = format!("error: {name} does not apply to a memoryless blob\n");
        assert_eq!(said, expected);
    }
    for option in ["--flights 3", "--passes 2", "--moments"] {
        let said = refused(&format!("stress {recursive} --hostile 1 {option}"), 2);
        assert!(said.contains("cannot be used with"), "{said}");
    }
    for option in ["--segment-s 5", "--place", "--resample 5"] {
        let said = refused(&format!("train --out m.bnkf --builtin 2 {option}"), 2);
        assert!(said.contains("cannot be used with"), "{said}");
        // Nor without flights of one's own.
        let said = refused(&format!("verify {bnkf} {option}"), 2);
        assert!(said.contains("--flights <PATH>"), "{said}");
    }
}

#[test]
fn a_model_is_tuned_on_own_flights() {
    let folder = tempfile::tempdir().unwrap();
    let models = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/");
    let flights = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/sample-flights");
    let model = format!("{models}recursive.bnkf");
    let tune = |model: &str, more: &[&str]| {
        let arguments = ["tune", model, "--out", "mine.bnkf", "--episodes", "1"];
        model_export(folder.path(), &[&arguments, more].concat())
            .output()
            .unwrap()
    };
    let done = tune(&model, &["--flights", flights]);
    assert!(done.status.success(), "{done:?}");
    let mine = std::fs::read(folder.path().join("mine.bnkf")).unwrap();
    assert_ne!(mine, std::fs::read(&model).unwrap());
    let provenance = std::fs::read_to_string(folder.path().join("mine.bnkf.json")).unwrap();
    assert!(provenance.contains("\"rehearsal\": 0.5"), "{provenance}");
    assert!(!folder.path().join("mine.bnkf.checkpoint").exists());
    // What cannot be tuned is named.
    let refused = |model: &str, more: &[&str]| {
        let output = tune(model, more);
        assert!(!output.status.success());
        String::from_utf8(output.stderr).unwrap()
    };
    let memoryless = format!("{models}bnkf.bnkf");
    let said = refused(&memoryless, &["--flights", flights]);
    assert!(said.contains("bnkf.bnkf: only a recursive model"), "{said}");
    std::fs::copy(&model, folder.path().join("alone.bnkf")).unwrap();
    let said = refused("alone.bnkf", &["--flights", flights]);
    assert!(said.contains("alone.bnkf.f32"), "{said}");
    let said = refused(&model, &[]);
    assert!(said.contains("name the flights"), "{said}");
    // A flight that is left out, too.
    let rows: String = (0..30)
        .map(|i| format!("{},{i},20,10\n", 0.1 * f64::from(i)))
        .collect();
    let short = format!("timestamp,tx,ty,tz\n{rows}");
    std::fs::write(folder.path().join("short.csv"), short).unwrap();
    let said = refused(&model, &["--flights", "short.csv"]);
    let expected = "warning: left out: short.csv: 2.90 s, and 4.5 s is the least to learn from\n";
    assert!(said.contains(expected), "{said}");
}

#[test]
fn a_training_goes_on_from_a_blob() {
    let folder = tempfile::tempdir().unwrap();
    let models = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/");
    let on = |from: &str, more: &[&str]| {
        let arguments = ["train", "--kind", "recursive", "--from", from];
        let arguments = [
            &arguments,
            ["--out", "on.bnkf", "--builtin", "4"].as_slice(),
            more,
        ]
        .concat();
        model_export(folder.path(), &arguments).output().unwrap()
    };
    let model = format!("{models}recursive.bnkf");
    let done = on(&model, &["--episodes", "1"]);
    assert!(done.status.success(), "{done:?}");
    let made = std::fs::read(folder.path().join("on.bnkf")).unwrap();
    assert_ne!(made, std::fs::read(&model).unwrap());
    let provenance = std::fs::read_to_string(folder.path().join("on.bnkf.json")).unwrap();
    let shipped = std::fs::read_to_string(format!("{model}.json")).unwrap();
    let field = |text: &str, name: &str| {
        let line = text
            .lines()
            .find(|line| line.contains(&format!("\"{name}\":")));
        let value = line.and_then(|line| line.split('"').nth(3));
        value.map(str::to_owned)
    };
    assert_eq!(field(&provenance, "from"), field(&shipped, "blob_sha256"));
    // What it cannot go on from, and what would say nothing, is refused.
    for (from, option, expected) in [
        ("bnkf.bnkf", "--episodes=1", "only a recursive model"),
        ("recursive.bnkf", "--scenario=paper", "cannot be used with"),
        (
            "recursive.bnkf",
            "--sampling=nothing",
            "cannot be used with",
        ),
        ("none.bnkf", "--episodes=1", "none.bnkf"),
    ] {
        let refused = on(&format!("{models}{from}"), &[option]);
        let said = text(&refused.stderr);
        assert!(
            !refused.status.success() && said.contains(expected),
            "{said}"
        );
    }
}
