//! The same bits on other cores: a program with the crate in it runs in QEMU and prints a hash of all that
//! trackers of both kinds said; the host's is the same.
//!
//! A core is left out, and named, where its compiler or QEMU is missing; `tests/cores.sh` gets what can be had.

#[path = "../firmware/src/bin/same-bits/hash.rs"]
mod hash;

use std::process::{Command, Stdio};

use bnkf_host_sim::image::build::build_program;
use bnkf_host_sim::image::toolchain::{TARGET, Toolchain, ToolchainChoice};

/// A target, and a machine of QEMU that runs its instructions: the only Cortex-M0 there has 16 KiB, too little
/// for this program, so a Cortex-M3 runs what was built for one.
const CORES: [(&str, &str, &[&str]); 6] = [
    (
        "thumbv6m-none-eabi",
        "qemu-system-arm",
        &["-M", "mps2-an385"],
    ),
    (
        "thumbv7m-none-eabi",
        "qemu-system-arm",
        &["-M", "lm3s6965evb"],
    ),
    (TARGET, "qemu-system-arm", &["-M", "mps2-an386"]),
    (
        "thumbv8m.main-none-eabihf",
        "qemu-system-arm",
        &["-M", "mps2-an505"],
    ),
    (
        "riscv32imc-unknown-none-elf",
        "qemu-system-riscv32",
        RISCV_WITHOUT_UNIT,
    ),
    (
        "riscv32imafc-unknown-none-elf",
        "qemu-system-riscv32",
        RISCV,
    ),
];
const RISCV: &[&str] = &["-M", "virt", "-bios", "none"];
const RISCV_WITHOUT_UNIT: &[&str] = &[
    "-M",
    "virt",
    "-bios",
    "none",
    "-cpu",
    "rv32,f=false,d=false",
];

#[test]
fn every_core_says_what_the_host_says() {
    let expected = format!("{:016x}", hash::hash());
    let mut left_out = Vec::new();
    for (target, program, machine) in CORES {
        let toolchain = match Toolchain::find_for(target, ToolchainChoice::Auto) {
            Ok(toolchain) => toolchain,
            Err(error) => {
                eprintln!("{target}: not checked here: {error}");
                left_out.push(target);
                continue;
            }
        };
        let elf =
            build_program(&toolchain, "same-bits").unwrap_or_else(|e| panic!("{target}: {e}"));
        // A core that hangs must not hang the test.
        let answer = Command::new("timeout")
            .args(["300", program])
            .args(machine)
            .args(["-nographic", "-monitor", "none", "-serial", "none"])
            .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
            .arg(&elf)
            .stdin(Stdio::null())
            .output()
            .unwrap();
        // What `timeout` says when there is no such program.
        if answer.status.code() == Some(127) {
            eprintln!("{target}: built, not run here: no {program}");
            left_out.push(target);
            continue;
        }
        let said = String::from_utf8_lossy(&answer.stdout);
        let errors = String::from_utf8_lossy(&answer.stderr);
        assert_eq!(said.trim(), expected, "{target}: {errors}");
        assert!(answer.status.success(), "{target}: {errors}");
        println!("{target}: {expected}, as the host");
    }
    assert!(
        !left_out.contains(&TARGET),
        "at least the image's core is checked"
    );
}
