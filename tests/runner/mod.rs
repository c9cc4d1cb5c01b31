//! Programs for microcontrollers in QEMU, run as `.cargo/config.toml` says.

use std::path::Path;
use std::process::{Command, Stdio};

/// What a program says that must succeed; nothing, if there is no QEMU for its core.
pub fn says(target: &str, program: &Path) -> Option<String> {
    let config: toml::Table = include_str!("../../.cargo/config.toml").parse().unwrap();
    let runner = config["target"][target]["runner"].as_array().unwrap();
    let runner = runner.iter().map(|word| word.as_str().unwrap());
    // A core that hangs must not hang the test.
    let answer = Command::new("timeout")
        .arg("300")
        .args(runner)
        .arg(program)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    // What `timeout` says when there is no such program.
    if answer.status.code() == Some(127) {
        eprintln!("{target}: built, not run here: no QEMU");
        return None;
    }
    let said = String::from_utf8_lossy(&answer.stdout);
    let errors = String::from_utf8_lossy(&answer.stderr);
    assert!(answer.status.success(), "{target}: {said} {errors}");
    Some(said.trim().into())
}
