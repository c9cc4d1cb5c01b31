//! A cross-validation of seconds: six short flights in two folds.

use std::path::Path;
use std::process::{Command, Stdio};

/// The command, run inside `folder`: its results name no other place.
pub fn evaluation(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_host-sim"));
    command
        .current_dir(folder)
        .args([
            "evaluate", "--quick", "--folds", "2", "--epochs", "1", "--passes", "3",
        ])
        .args([
            "--tuning-flights",
            "4",
            "--methods",
            "ekf,bnkf,imm10",
            "--scenario",
            "tiny.toml",
            "--out",
            "out",
        ])
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command
}

/// A folder with its scenario.
pub fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let paper = include_str!("../../scenarios/paper.toml");
    let tiny = paper
        .replace("quick_count = 30", "quick_count = 6")
        .replace("duration_s = 15.0", "duration_s = 4.0");
    std::fs::write(folder.path().join("tiny.toml"), tiny).unwrap();
    folder
}
