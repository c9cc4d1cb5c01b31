//! Every type that `bnkf` re-exports stands in one of its examples, which every test run
//! compiles. The types for C stand in `firmware/include/bnkf.h`, whose examples `tests/from_c.rs` runs.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The sources of a module and of those below it.
fn sources(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, into);
        } else {
            into.push(path);
        }
    }
}

/// Modules that the crate's root hides, that are C's, or that are no library.
fn left_out(root: &str) -> BTreeSet<String> {
    let hidden = root.split("#[doc(hidden)]\npub mod ").skip(1);
    let hidden = hidden.map(|rest| rest.split(';').next().unwrap().to_owned());
    hidden.chain(["bin", "c"].map(String::from)).collect()
}

fn is_word(text: &str, word: &str) -> bool {
    text.split(|c: char| !c.is_alphanumeric() && c != '_')
        .any(|other| other == word)
}

#[test]
fn every_public_type_stands_in_an_example() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("firmware/src");
    let root = fs::read_to_string(source.join("lib.rs")).unwrap();
    let left_out = left_out(&root);
    assert!(left_out.contains("kernel"), "{left_out:?}");
    let mut paths = Vec::new();
    sources(&source, &mut paths);
    let (mut types, mut examples, mut exports) = (BTreeSet::new(), String::new(), String::new());
    for path in paths {
        let inside = path.strip_prefix(&source).unwrap().with_extension("");
        let module = inside.iter().next().unwrap().to_str().unwrap();
        if left_out.contains(module) || path.extension().is_none_or(|name| name != "rs") {
            continue;
        }
        let mut in_example = false;
        for line in fs::read_to_string(&path).unwrap().lines() {
            let line = line.trim();
            let doc = line.strip_prefix("///").or(line.strip_prefix("//!"));
            match doc.map(str::trim) {
                Some("```") => in_example = !in_example,
                Some(code) if in_example => examples += &format!("{code}\n"),
                _ => {}
            }
            for kind in ["pub struct ", "pub enum ", "pub trait ", "pub type "] {
                if let Some(rest) = line.strip_prefix(kind) {
                    let end = rest
                        .find(|c: char| !c.is_alphanumeric())
                        .unwrap_or(rest.len());
                    types.insert(rest[..end].to_owned());
                }
            }
            exports += &format!("{line}\n");
        }
    }
    // What no `pub use` names is the workspace's own.
    let exported = |name: &String| {
        exports
            .split("pub use ")
            .skip(1)
            .any(|rest| is_word(rest.split(';').next().unwrap(), name))
    };
    let shown: Vec<String> = types.into_iter().filter(exported).collect();
    assert!(shown.len() > 40, "{shown:?}");
    let missing: Vec<&String> = shown
        .iter()
        .filter(|name| !is_word(&examples, name))
        .collect();
    assert!(missing.is_empty(), "in no example: {missing:?}");
}

/// A table that is stale is rewritten by the command that its failure names.
#[test]
fn tables_of_the_pages_are_those_of_the_files() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/results/tables.py");
    let output = Command::new("python3")
        .arg(script)
        .arg("--check")
        .output()
        .expect("python3 is there");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}
