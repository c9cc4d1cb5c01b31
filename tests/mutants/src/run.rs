//! The test binary once per change: first the tests of its own module, then all.

use crate::list::Change;
use std::collections::BTreeSet;
use std::error::Error;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Longest time that the tests may take of a change; more counts as noticed.
const TIME_MAX: Duration = Duration::from_secs(120);
/// What no change of another module can break; their own changes run them.
const SLOW: [&str; 2] = ["gaussian::", "kernel::"];

#[derive(Debug, PartialEq)]
enum Verdict {
    Survived,
    Noticed,
    Timeout,
}

/// Runs every `of`-th change from the `shard`-th on and writes a line for each.
pub fn shard(
    changes: &[Change],
    tree: &Path,
    unviable: &BTreeSet<usize>,
    binary: &str,
    results: &str,
    (shard, of): (usize, usize),
) -> Result<(), Box<dyn Error>> {
    let made = std::fs::read_to_string(tree.join("made"))?;
    let made: BTreeSet<usize> = made
        .split_whitespace()
        .map(str::parse)
        .collect::<Result<_, _>>()?;
    let package = tree.join("firmware");
    let tests = |number: usize, filter: &[String]| verdict(&package, binary, number, filter);
    if tests(usize::MAX, &[])? != Verdict::Survived {
        return Err("the tests fail without any change".into());
    }
    let mut lines = std::fs::File::create(results)?;
    for change in changes.iter().skip(shard).step_by(of) {
        let word = if unviable.contains(&change.number) {
            "unviable".to_owned()
        } else if !made.contains(&change.number) {
            "not-made".to_owned()
        } else {
            let file = change.file.trim_start_matches("firmware/src/");
            let module = file.trim_end_matches(".rs").replace('/', "::") + "::";
            let slow = SLOW.iter().filter(|slow| !module.starts_with(**slow));
            let elsewhere: Vec<_> = slow.flat_map(|s| ["--skip".into(), (*s).into()]).collect();
            let verdict = match tests(change.number, &[module])? {
                Verdict::Survived => tests(change.number, &elsewhere)?,
                noticed => noticed,
            };
            format!("{verdict:?}").to_lowercase()
        };
        writeln!(lines, "{} {word} {}", change.number, change.name)?;
    }
    Ok(())
}

fn verdict(
    package: &Path,
    binary: &str,
    number: usize,
    filter: &[String],
) -> Result<Verdict, Box<dyn Error>> {
    let mut child = Command::new(binary)
        .args(["-q", "--test-threads=1"])
        .args(filter)
        .current_dir(package)
        .env("BNKF_MUTANT", number.to_string())
        .env("PROPTEST_MAX_SHRINK_ITERS", "0")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()?;
    let begun = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(if status.success() {
                Verdict::Survived
            } else {
                Verdict::Noticed
            });
        }
        if begun.elapsed() > TIME_MAX {
            child.kill()?;
            child.wait()?;
            return Ok(Verdict::Timeout);
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}
