//! Tells the program which tree it was built from, for the provenance of results.

use std::process::Command;

fn main() {
    // The sources that the answer depends on; without git (a tarball) it is "unknown".
    for path in [
        "src",
        "scenarios",
        "build.rs",
        "../firmware/src",
        "../model-export/src",
        "../models",
    ] {
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
        (Some(commit), _) => format!("{commit}-modified"),
        _ => "unknown".to_owned(),
    };
    println!("cargo:rustc-env=BNKF_TREE={tree}");
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
