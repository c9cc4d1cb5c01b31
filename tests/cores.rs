//! The same bits on other cores: a program with the crate in it runs in QEMU and prints a hash of all that
//! trackers of both kinds said; the host's is the same.
//!
//! A core is left out, and named, where its compiler or QEMU is missing; `tests/cores.sh` gets what can be had.

#[path = "../firmware/src/bin/same-bits/flight.rs"]
mod flight;
#[path = "../firmware/src/bin/same-bits/hash.rs"]
mod hash;
mod runner;

use bnkf_host_sim::image::build::build_program;
use bnkf_host_sim::image::toolchain::{TARGET, Toolchain, ToolchainChoice};

/// `.cargo/config.toml` names a machine of QEMU for each.
const CORES: [&str; 6] = [
    "thumbv6m-none-eabi",
    "thumbv7m-none-eabi",
    TARGET,
    "thumbv8m.main-none-eabihf",
    "riscv32imc-unknown-none-elf",
    "riscv32imafc-unknown-none-elf",
];

#[test]
fn every_core_says_what_the_host_says() {
    let expected = format!("{:016x}", hash::hash());
    let mut left_out = Vec::new();
    for target in CORES {
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
        let Some(said) = runner::says(target, &elf) else {
            left_out.push(target);
            continue;
        };
        assert_eq!(said, expected, "{target}");
        println!("{target}: {expected}, as the host");
    }
    assert!(
        !left_out.contains(&TARGET),
        "at least the image's core is checked"
    );
}
