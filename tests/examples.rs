//! The interrupt-fed example says in QEMU, where a timer interrupts the loop, what it says on a host. The programs of
//! the firmware that nothing here can run are built.

mod runner;

use std::process::Command;

use bnkf_host_sim::image::build::{build_example, build_program};
use bnkf_host_sim::image::toolchain::{TARGET, Toolchain, ToolchainChoice};

fn microcontroller() -> Option<Toolchain> {
    Toolchain::find(ToolchainChoice::Auto)
        .inspect_err(|error| eprintln!("not checked here: {error}"))
        .ok()
}

#[test]
fn an_interrupt_feeds_the_same_track_everywhere() {
    let Some(toolchain) = microcontroller() else {
        return;
    };
    let elf = build_example(&toolchain, "interrupt").unwrap_or_else(|e| panic!("{e}"));
    let Some(said) = runner::says(TARGET, &elf) else {
        return;
    };
    let host = Command::new(env!("CARGO"))
        .args([
            "run",
            "--quiet",
            "--locked",
            "-p",
            "bnkf",
            "--example",
            "interrupt",
        ])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    let (expected, errors) = (
        String::from_utf8_lossy(&host.stdout),
        String::from_utf8_lossy(&host.stderr),
    );
    assert!(host.status.success(), "{errors}");
    assert_eq!(said.lines().count(), 20, "{said}");
    assert_eq!(said, expected.trim());
}

/// It reads a counter that QEMU does not have.
#[test]
fn the_bench_image_links() {
    if let Some(toolchain) = microcontroller() {
        build_program(&toolchain, "bench").unwrap_or_else(|e| panic!("{e}"));
    }
}
