//! Every crate that the workspace or the Python wheel builds from has a licence that this table allows, with the reason.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// SPDX expressions as the crates' manifests write them, and why each is acceptable for a work under
/// "MIT OR Apache-2.0" that ships source and a firmware image.
const ALLOWED: [(&str, &str); 20] = [
    ("MIT OR Apache-2.0", "the workspace's own"),
    ("Apache-2.0 OR MIT", "the workspace's own"),
    (
        "MIT/Apache-2.0",
        "the workspace's own, as it was once written",
    ),
    ("MIT", "permissive: keep the notice"),
    ("Apache-2.0", "permissive: keep the notice"),
    (
        "Apache-2.0 WITH LLVM-exception OR Apache-2.0 OR MIT",
        "taken as MIT",
    ),
    ("MIT OR Apache-2.0 OR LGPL-2.1-or-later", "taken as MIT"),
    ("BSD-2-Clause OR Apache-2.0 OR MIT", "taken as MIT"),
    ("Zlib OR Apache-2.0 OR MIT", "taken as MIT"),
    ("Zlib", "permissive: changed sources say so"),
    ("Unlicense OR MIT", "taken as MIT"),
    ("Unlicense/MIT", "taken as MIT"),
    ("Apache-2.0 OR BSL-1.0", "taken as Apache-2.0"),
    ("BSD-3-Clause", "permissive: keep the notice"),
    ("BSD-2-Clause", "permissive: keep the notice"),
    ("Apache-2.0 OR GPL-2.0-only", "taken as Apache-2.0"),
    (
        "Apache-2.0 WITH LLVM-exception",
        "Apache-2.0 that asks less; a build-time tool of the Python wheel",
    ),
    (
        "MPL-2.0",
        "copyleft by file; cbindgen, which a test runs and nothing that ships is made of",
    ),
    (
        "CC0-1.0",
        "public domain; a build-time tool of a dependency",
    ),
    (
        "(MIT OR Apache-2.0) AND Unicode-3.0",
        "MIT, and Unicode's data: keep both notices",
    ),
];

/// What cargo says of the workspace in a folder of this one.
fn metadata(folder: &str) -> serde_json::Value {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--locked", "--format-version", "1"])
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(folder))
        .output()
        .expect("cargo runs");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "cargo metadata: {errors}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn every_dependency_has_an_allowed_licence() {
    let metadata = ["", "firmware/python"].map(metadata);
    let mut found: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    let packages = |of: usize| metadata[of]["packages"].as_array().expect("packages");
    for package in packages(0).iter().chain(packages(1)) {
        let licence = package["license"].as_str().unwrap_or("none named");
        let name = package["name"].as_str().expect("a name");
        found.entry(licence).or_default().push(name);
    }
    assert!(
        found.values().map(Vec::len).sum::<usize>() > 50,
        "{found:?}"
    );
    for (licence, crates) in &found {
        let known = ALLOWED.iter().any(|(allowed, _)| allowed == licence);
        assert!(known, "licence {licence:?} of {crates:?} is not allowed");
    }
    for (allowed, _) in ALLOWED {
        assert!(found.contains_key(allowed), "no crate has {allowed:?} now");
    }
}
