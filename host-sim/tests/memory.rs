//! An evaluation's memory does not grow with the number of its flights, but for the flights themselves.
#![cfg(target_os = "linux")]

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// `count` circles of 120 samples in the paper's volume, as files.
fn write_flights(folder: &Path, count: u32) {
    for number in 0..count {
        let turn = f64::from(number);
        let row = |i: i32| {
            let t = f64::from(i) * 0.1;
            let (x, y) = (25.0 + 5.0 * (t + turn).cos(), 12.0 + 5.0 * (t + turn).sin());
            format!("{t:.1},{x:.4},{y:.4},{:.2}", 9.0 + 0.1 * t)
        };
        let rows: Vec<_> = (0..120).map(row).collect();
        let text = format!("timestamp,tx,ty,tz\n{}\n", rows.join("\n"));
        std::fs::write(folder.join(format!("{number:04}.csv")), text).unwrap();
    }
}

/// The largest resident set of an evaluation of `count` flights, kilobytes.
fn peak_kb(count: u32) -> u64 {
    let folder = tempfile::tempdir().unwrap();
    write_flights(folder.path(), count);
    let mut child = Command::new(env!("CARGO_BIN_EXE_host-sim"))
        .args(["evaluate", "--methods", "ekf", "--flights"])
        .arg(folder.path())
        .env("RAYON_NUM_THREADS", "2")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak_kb = 0;
    // The system keeps the largest so far; what a look misses is the last milliseconds.
    while child.try_wait().unwrap().is_none() {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let number = line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse().ok());
        peak_kb = peak_kb.max(number.unwrap_or(0));
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(child.wait().unwrap().success());
    peak_kb
}

/// Of 500 flights more, 120 samples each, the flights take 3.4 MB and the errors whose median is wanted 1 MB; the
/// steps of all conditions, which once were kept, take 40 MB.
#[test]
fn six_times_the_flights_take_little_more() {
    let (few_kb, many_kb) = (peak_kb(100), peak_kb(600));
    assert!(few_kb > 2000, "{few_kb} KB");
    assert!(many_kb < few_kb + 20_000, "{few_kb} KB, then {many_kb} KB");
}
