//! A cross-validation that several processes divide ends with the bytes of a single one.

mod complaint;
mod tiny_campaign;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant, SystemTime};

use complaint::complaint;
use tiny_campaign::{evaluation, folder};

/// What every run here is asked for: all that can be the same bytes.
fn whole(folder: &Path) -> Command {
    let mut command = evaluation(folder);
    command.args(["--steps", "--no-times"]);
    command
}

fn shard(folder: &Path, shard: &str) -> Command {
    let mut command = whole(folder);
    command.args(["--shard", shard]);
    command
}

fn said(mut command: Command) -> Output {
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command.output().unwrap()
}

/// Every file of the results, by its name.
fn results(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder.join("out")).unwrap();
    let files = entries.map(|entry| entry.unwrap().path());
    let files = files.filter(|path| path.is_file());
    let named = |path: PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        (name, std::fs::read(path).unwrap())
    };
    files.map(named).collect()
}

/// The finished pieces and when they were written.
fn pieces(work: &Path) -> BTreeMap<PathBuf, SystemTime> {
    let Ok(entries) = std::fs::read_dir(work) else {
        return BTreeMap::new();
    };
    let paths = entries.map(|entry| entry.unwrap().path());
    let is_piece = |path: &PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        !name.starts_with(".bnkf-") && !name.ends_with(".claim") && name != "lock"
    };
    let timed = |path: PathBuf| {
        let time = std::fs::metadata(&path).unwrap().modified().unwrap();
        (path, time)
    };
    paths.filter(is_piece).map(timed).collect()
}

fn assert_same_results(calm: &Path, divided: &Path) {
    let (one, other) = (results(calm), results(divided));
    assert!(one.len() > 20 && one.contains_key("report.html"));
    assert!(one.keys().eq(other.keys()), "the same files");
    for (name, bytes) in &one {
        assert!(other[name] == *bytes, "{name} differs");
    }
}

#[test]
fn three_shards_one_of_them_killed_end_with_the_bytes_of_one_run() {
    let (calm, divided) = (folder(), folder());
    assert!(whole(calm.path()).status().unwrap().success());
    assert!(!calm.path().join("out/work").exists());

    let work = divided.path().join("out/work");
    assert!(shard(divided.path(), "1/3").status().unwrap().success());
    let before = pieces(&work).len();
    // Killed with its first pieces written.
    let mut second = shard(divided.path(), "2/3")
        .env("RAYON_NUM_THREADS", "1")
        .spawn()
        .unwrap();
    let start = Instant::now();
    while pieces(&work).len() == before && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(1));
    }
    second.kill().unwrap();
    second.wait().unwrap();
    let made = pieces(&work);
    assert!(made.len() > before, "the second shard had begun");

    // Without them there are no results, and what is missing is named.
    let merge = || {
        let mut command = whole(divided.path());
        command.arg("--merge");
        command
    };
    let error = complaint(&said(merge()));
    assert!(
        error.contains("out/work: ") && error.contains(" of its pieces are missing: unit-000-0000"),
        "{error}"
    );
    assert!(error.contains(" more; run their shards again"), "{error}");
    assert!(results(divided.path()).is_empty());

    // Again, beside the third.
    let mut second = shard(divided.path(), "2/3").spawn().unwrap();
    let mut third = shard(divided.path(), "3/3").spawn().unwrap();
    assert!(second.wait().unwrap().success() && third.wait().unwrap().success());
    let all = pieces(&work);
    for (path, time) in &made {
        assert_eq!(all[path], *time, "{} was made twice", path.display());
    }
    let said = said(merge());
    assert!(said.status.success(), "{said:?}");
    assert_same_results(calm.path(), divided.path());
    assert_eq!(pieces(&work), all, "a merge leaves the pieces as they are");
}

#[test]
fn shards_without_a_shared_folder_are_merged_from_theirs() {
    let (calm, divided) = (folder(), folder());
    assert!(whole(calm.path()).status().unwrap().success());
    for (name, work) in [("1/2", "a"), ("2/2", "b")] {
        let mut command = shard(divided.path(), name);
        assert!(command.args(["--work", work]).status().unwrap().success());
    }
    let mut merge = whole(divided.path());
    merge.args(["--merge", "--work", "b", "--work", "a"]);
    let output = said(merge);
    assert!(output.status.success(), "{output:?}");
    assert_same_results(calm.path(), divided.path());
}

#[test]
fn a_last_run_makes_what_no_shard_has_made() {
    let (calm, divided) = (folder(), folder());
    assert!(whole(calm.path()).status().unwrap().success());
    assert!(shard(divided.path(), "2/2").status().unwrap().success());
    assert!(whole(divided.path()).status().unwrap().success());
    assert_same_results(calm.path(), divided.path());
    assert!(!divided.path().join("out/work").exists());
}

#[test]
fn what_makes_no_sense_is_said() {
    let folder = folder();
    let refused = |command: Command| {
        let output = said(command);
        assert!(!output.status.success(), "{output:?}");
        String::from_utf8(output.stderr).unwrap()
    };
    for (wrong, why) in [
        ("4/3", "shard 4 of 3: shards are numbered from 1 to 3"),
        ("0/3", "shard 0 of 3"),
        ("1", "`1` is not K/N"),
        ("1/0", "0 shards"),
    ] {
        let text = refused(shard(folder.path(), wrong));
        assert!(text.contains(why) && text.contains("--shard"), "{text}");
    }
    let mut both = shard(folder.path(), "1/3");
    both.arg("--merge");
    assert!(refused(both).contains("cannot be used with"));
    let mut two = shard(folder.path(), "1/3");
    two.args(["--work", "a", "--work", "b"]);
    let text = refused(two);
    assert!(
        text.contains("--work: several folders are for --merge"),
        "{text}"
    );
    let mut merge = whole(folder.path());
    merge.arg("--merge");
    let text = refused(merge);
    assert!(
        text.contains("out/work: holds no pieces of an evaluation"),
        "{text}"
    );
    let mut short = Command::new(env!("CARGO_BIN_EXE_host-sim"));
    short.args(["evaluate", "--flights", ".", "--shard", "1/2"]);
    assert!(refused(short).contains("required"));
    assert!(pieces(&folder.path().join("out/work")).is_empty());
}
