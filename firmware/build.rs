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

    if env::var_os("CARGO_FEATURE_IMAGE").is_none() {
        return Ok(());
    }
    let workspace = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).join("..");

    let memory = workspace.join("memory.x");
    println!("cargo::rerun-if-changed={}", memory.display());
    let out = PathBuf::from(env::var("OUT_DIR")?);
    std::fs::copy(&memory, out.join("memory.x"))
        .map_err(|error| format!("{}: {error}", memory.display()))?;
    println!("cargo::rustc-link-search={}", out.display());
    println!("cargo::rustc-link-arg-bin=tracker-image=-Tlink.x");
    println!("cargo::rustc-link-arg-bin=tracker-image=-Tdefmt.x");

    let blob =
        env::var_os("BNKF_BLOB").map_or_else(|| workspace.join("models/bnkf.bnkf"), PathBuf::from);
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
