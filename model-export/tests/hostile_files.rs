//! Files that are no files, as inputs and as outputs: refused at once, by name, and left alone.
#![cfg(unix)]

use std::path::Path;
use std::process::{Command, Output, Stdio};

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_model-export"))
        .current_dir(folder)
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the program starts")
}

/// Whether `program` did it; only root makes devices.
fn made(folder: &Path, program: &str, arguments: &[&str]) -> bool {
    let status = Command::new(program)
        .current_dir(folder)
        .args(arguments)
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|status| status.success())
}

/// The error that `output` consists of.
fn complaint(output: &Output) -> String {
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    said.trim_end().to_owned()
}

#[test]
fn an_output_that_cannot_be_written_is_refused_before_the_first_epoch() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("file"), "mine").unwrap();
    std::fs::create_dir(folder.join("folder")).unwrap();
    std::os::unix::fs::symlink("file", folder.join("link")).unwrap();
    std::os::unix::fs::symlink("file", folder.join("beside.bnkf.json")).unwrap();
    assert!(made(folder, "mkfifo", &["pipe"]));
    let mut cases = vec![
        ("link", "link: cannot write: a symbolic link is there"),
        ("folder", "folder: cannot write: a folder is there"),
        ("pipe", "pipe: cannot write: a pipe is there"),
        (
            "beside.bnkf",
            "beside.bnkf.json: cannot write: a symbolic link is there",
        ),
        (
            "none/m.bnkf",
            "none/m.bnkf: cannot write: its folder does not exist",
        ),
        (
            "file/m.bnkf",
            "file/m.bnkf: cannot write: its folder is a file",
        ),
        ("m.bnkf/", "m.bnkf/: cannot write: it names no file"),
        // Not even root makes files there.
        #[cfg(target_os = "linux")]
        ("/proc/self/m.bnkf", "/proc/self/m.bnkf: cannot write: "),
    ];
    // A copy of /dev/null.
    if made(folder, "mknod", &["null", "c", "1", "3"]) {
        cases.push(("null", "null: cannot write: a character device is there"));
    }
    for (out, expected) in cases {
        // More epochs than anybody waits for.
        let memoryless = [
            "train",
            "--builtin",
            "2",
            "--epochs",
            "1000000",
            "--out",
            out,
        ];
        let recursive = [
            "train",
            "--kind",
            "recursive",
            "--episodes",
            "1000000",
            "--out",
            out,
        ];
        for arguments in [memoryless, recursive] {
            let said = complaint(&run(folder, &arguments));
            assert!(said.starts_with(&format!("error: {expected}")), "{said}");
        }
    }
    assert_eq!(std::fs::read(folder.join("file")).unwrap(), b"mine");
    assert!(folder.join("link").is_symlink());
    let left = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name());
    assert!(
        left.into_iter()
            .all(|name| !name.to_string_lossy().starts_with(".bnkf-"))
    );
}

#[test]
fn an_input_that_is_no_file_or_too_large_is_refused_unread() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    assert!(made(folder, "mkfifo", &["pipe"]));
    let sparse = std::fs::File::create(folder.join("huge")).unwrap();
    sparse.set_len(1 << 40).unwrap();
    for (path, what) in [
        ("/dev/zero", "a character device, not a regular file"),
        ("pipe", "a pipe, not a regular file"),
        (".", "a folder, not a regular file"),
        (
            "huge",
            "more than the 1048576 bytes that such a file has at most",
        ),
    ] {
        for command in ["inspect", "verify", "stress"] {
            let said = complaint(&run(folder, &[command, path]));
            assert_eq!(said, format!("error: {path}: {what}"), "{command}");
        }
    }
    for (path, what) in [
        ("/dev/zero", "a character device, not a regular file"),
        ("pipe", "a pipe, not a regular file"),
        (
            "huge",
            "more than the 268435456 bytes that such a file has at most",
        ),
    ] {
        let said = complaint(&run(
            folder,
            &["train", "--flights", path, "--out", "m.bnkf"],
        ));
        assert_eq!(said, format!("error: {path}: {what}"));
    }
    // What lies beside a blob, and a checkpoint.
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models");
    std::fs::copy(models.join("bnkf.bnkf"), folder.join("m.bnkf")).unwrap();
    assert!(made(folder, "mkfifo", &["m.bnkf.f32"]));
    let said = complaint(&run(folder, &["verify", "m.bnkf"]));
    assert_eq!(said, "error: m.bnkf.f32: a pipe, not a regular file");
    assert!(made(folder, "mkfifo", &["n.bnkf.checkpoint"]));
    let said = complaint(&run(
        folder,
        &["train", "--builtin", "2", "--out", "n.bnkf", "--resume"],
    ));
    assert!(
        said.contains("n.bnkf.checkpoint: cannot write: a pipe is there"),
        "{said}"
    );
}

#[test]
fn absurd_numbers_of_flights_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let huge = usize::MAX.to_string();
    for (arguments, part) in [
        (
            vec!["train", "--builtin", &huge, "--out", "m.bnkf"],
            "not 1 to 100000 flights",
        ),
        (
            vec!["train", "--builtin", "0", "--out", "m.bnkf"],
            "not 1 to 100000 flights",
        ),
        (
            vec!["stress", "m.bnkf", "--flights", "0"],
            "0 is not in 1..=1000000",
        ),
        (
            vec!["stress", "m.bnkf", "--flights", "4000000000"],
            "is not in 1..=1000000",
        ),
        (
            vec![
                "train",
                "--builtin",
                "2",
                "--grid-epochs",
                "4294967295",
                "--out",
                "m.bnkf",
            ],
            "--grid-epochs 4294967295",
        ),
        (
            vec![
                "train",
                "--builtin",
                "2",
                "--time-unit",
                "ms",
                "--out",
                "m.bnkf",
            ],
            "cannot be used with",
        ),
        (
            vec![
                "train",
                "--flights",
                ".",
                "--columns",
                "t,x,y",
                "--out",
                "m.bnkf",
            ],
            "3 names, four are needed",
        ),
    ] {
        let output = run(folder.path(), &arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            !output.status.success() && said.contains(part),
            "{arguments:?}: {said}"
        );
    }
}

/// The seal of a file is no secret: one network too many is found without it.
#[test]
fn unrounded_weights_with_an_extra_network_are_not_verified() {
    use bnkf_model_export::blob::unrounded;
    let folder = tempfile::tempdir().unwrap();
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models");
    for name in ["bnkf.bnkf", "recursive.bnkf"] {
        let blob = std::fs::read(models.join(name)).unwrap();
        let weights = std::fs::read(models.join(format!("{name}.f32"))).unwrap();
        let mut networks = unrounded::parse(&weights, &blob).unwrap();
        networks.push(networks[0].clone());
        std::fs::write(folder.path().join(name), &blob).unwrap();
        let resealed = unrounded::to_bytes(&blob, &networks);
        std::fs::write(folder.path().join(format!("{name}.f32")), resealed).unwrap();
        let said = complaint(&run(folder.path(), &["verify", name]));
        assert!(
            said.starts_with(&format!("error: {name}.f32: holds networks ")),
            "{said}"
        );
    }
}

/// Three samples have no spread for a blob's population.
#[test]
fn flights_that_give_no_model_are_found_before_the_first_epoch() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let three = "timestamp,tx,ty,tz\n0,25,12,9\n0.1,25.1,12,9\n0.2,25.2,12,9\n";
    std::fs::write(folder.join("three.csv"), three).unwrap();
    let arguments = "train --kind recursive --flights three.csv --episodes 1000000 --out m.bnkf";
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let output = run(folder, &arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("too few or too alike for a model"), "{said}");
    assert!(!said.contains("episode 1/"), "{said}");
}
