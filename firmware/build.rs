//! Names the target's extensions for the kernel, and places the memory map and the model blob for
//! the image.

use std::env;
use std::error::Error;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=BNKF_BLOB");
    println!("cargo::rerun-if-env-changed=DEFMT_LOG");
    // Stable compilers do not tell `cfg(target_feature)` about these two, the target's name does.
    println!("cargo::rustc-check-cfg=cfg(arm_dsp, arm_vfp)");
    let target = env::var("TARGET")?;
    if target.starts_with("thumbv7em-") {
        println!("cargo::rustc-cfg=arm_dsp");
        if target.ends_with("eabihf") {
            println!("cargo::rustc-cfg=arm_vfp");
        }
    }

    let out = PathBuf::from(env::var("OUT_DIR")?);
    let folder = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    if env::var_os("CARGO_FEATURE_SAME_BITS").is_some() {
        let script = out.join("same-bits.x");
        std::fs::write(&script, emulated_memory(&target)?)
            .map_err(|error| format!("{}: {error}", script.display()))?;
        println!("cargo::rustc-link-arg-bin=same-bits=-T{}", script.display());
    }

    // Arguments of these programs alone: a crate that depends on this one has its own memory map.
    if target.starts_with("thumb") {
        let memory = folder.join("memory.x");
        println!("cargo::rerun-if-changed={}", memory.display());
        std::fs::copy(&memory, out.join("memory.x"))
            .map_err(|error| format!("{}: {error}", memory.display()))?;
        println!("cargo::rustc-link-arg-examples=-L{}", out.display());
        println!("cargo::rustc-link-arg-examples=-Tlink.x");
    }
    if env::var_os("CARGO_FEATURE_IMAGE").is_none() {
        return Ok(());
    }
    for program in ["tracker-image", "bench"] {
        println!("cargo::rustc-link-arg-bin={program}=-L{}", out.display());
        println!("cargo::rustc-link-arg-bin={program}=-Tlink.x");
        println!("cargo::rustc-link-arg-bin={program}=-Tdefmt.x");
    }

    let blob = env::var_os("BNKF_BLOB")
        .map_or_else(|| folder.join("models/recursive.bnkf"), PathBuf::from);
    println!("cargo::rerun-if-changed={}", blob.display());
    let blob = blob
        .canonicalize()
        .map_err(|error| format!("{}: {error}", blob.display()))?;
    println!("cargo::rustc-env=BNKF_BLOB={}", blob.display());

    // defmt compiles logs below the level of this variable away, and its default is `error`.
    if env::var_os("DEFMT_LOG").is_none() {
        println!("cargo::rustc-env=DEFMT_LOG=info");
    }
    Ok(())
}

/// The linker script for the machine on which QEMU runs the program of a target. QEMU loads data where they
/// are used, so there is nothing to copy at the start.
fn emulated_memory(target: &str) -> Result<String, String> {
    let (code, ram): (u32, u32) = match target {
        // mps2-an385, lm3s6965evb, netduinoplus2
        "thumbv6m-none-eabi" | "thumbv7m-none-eabi" | "thumbv7em-none-eabihf" => (0, 0x2000_0000),
        // mps2-an505, in its secure memory
        "thumbv8m.main-none-eabihf" => (0x1000_0000, 0x3800_0000),
        // virt
        _ if target.starts_with("riscv32") => (0x8000_0000, 0x8040_0000),
        _ => return Err(format!("no emulated machine is known for {target}")),
    };
    // What the smallest of the machines, the lm3s6965evb, has.
    let ram_bytes: u32 = 64 << 10;
    Ok(format!(
        "ENTRY(_start)
stack_top = {ram:#x} + {ram_bytes:#x};
SECTIONS
{{
  . = {code:#x};
  .text : {{ KEEP(*(.start)) *(.text .text.*) *(.rodata .rodata.*) }}
  . = {ram:#x};
  .data : {{ *(.data .data.* .sdata .sdata.*) }}
  .bss : {{ *(.bss .bss.* .sbss .sbss.*) }}
  /DISCARD/ : {{ *(.ARM.exidx*) *(.eh_frame*) }}
}}
"
    ))
}
