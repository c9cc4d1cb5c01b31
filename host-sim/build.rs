//! Tells the program which tree it was built from, for the provenance of results.

use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the answers depend on.
const SOURCES: [&str; 11] = [
    "src",
    "scenarios",
    "build.rs",
    "../firmware/src",
    "../model-export/src",
    "../models",
    "Cargo.toml",
    "../firmware/Cargo.toml",
    "../model-export/Cargo.toml",
    "../Cargo.toml",
    "../Cargo.lock",
];

fn main() {
    for path in SOURCES {
        println!("cargo:rerun-if-changed={path}");
    }
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]) {
        println!("cargo:rerun-if-changed={log}");
    }
    let tree = match (
        git(&["rev-parse", "--short=12", "HEAD"]),
        git(&["status", "--porcelain"]),
    ) {
        (Some(commit), Some(changes)) if changes.is_empty() => commit,
        // Two states of it are two trees: work that one of them began the other must not go on with.
        (Some(commit), _) => format!("{commit}-modified-{}", contents()),
        // A tarball.
        _ => format!("unknown-{}", contents()),
    };
    println!("cargo:rustc-env=BNKF_TREE={tree}");
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

/// The first digits of a hash of all sources, by name and contents.
fn contents() -> String {
    let mut paths = Vec::new();
    for source in SOURCES {
        files(Path::new(source), &mut paths);
    }
    paths.sort();
    let mut hash = Sha256::new();
    for path in paths {
        let bytes = std::fs::read(&path).unwrap_or_default();
        hash.update(path.to_string_lossy().as_bytes());
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(bytes);
    }
    let digits = hash.finalize();
    digits[..4]
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

fn files(path: &Path, found: &mut Vec<PathBuf>) {
    match std::fs::read_dir(path) {
        Ok(entries) => entries
            .flatten()
            .for_each(|entry| files(&entry.path(), found)),
        Err(_) => found.push(path.to_owned()),
    }
}
