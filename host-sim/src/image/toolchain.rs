//! Finds a compiler that can build for a microcontroller.
//!
//! Two are known. `installed`: the `rustc` in use already has the target's libraries, as after
//! `rustup target add`. `debian`: Debian's packages rustc-web, cargo-web and rust-web-src, which
//! build the core library from its sources, for machines where rustup cannot download.

use std::env;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The target of the image: Cortex-M4F with its floating point unit.
pub const TARGET: &str = "thumbv7em-none-eabihf";

const DEBIAN_RUSTC: &str = "/usr/bin/rustc";
const DEBIAN_CARGO: &str = "/usr/bin/cargo";

/// Which toolchain to look for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum ToolchainChoice {
    /// The installed one when it has the target, else Debian's.
    #[default]
    Auto,
    /// The `rustc` in use.
    Installed,
    /// Debian's rustc-web with the sources of the core library.
    Debian,
}

/// A toolchain that can build for one target.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Toolchain {
    target: &'static str,
    cargo: OsString,
    /// What differs from the caller's own toolchain; `None` when nothing does.
    from_source: Option<FromSource>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct FromSource {
    rustc: PathBuf,
    linker: PathBuf,
}

/// Why no toolchain was found.
#[derive(Debug, thiserror::Error)]
pub enum ToolchainError {
    /// The `rustc` in use has no libraries for the target.
    #[error(
        "the installed rustc cannot build for {target}: run `rustup target add {target}` or tests/setup.sh"
    )]
    NoTarget {
        /// The target.
        target: &'static str,
    },
    /// Debian's compiler or its sources are missing.
    #[error(
        "Debian's rustc-web, cargo-web and rust-web-src are not complete ({} is missing): run tests/setup.sh",
        missing.display()
    )]
    NoDebian {
        /// The first file that is not there.
        missing: PathBuf,
    },
    /// Debian's compiler is there, but no linker for the target.
    #[error(
        "no linker for microcontrollers: neither rustup's rust-lld nor ld.lld found; run tests/setup.sh"
    )]
    NoLinker,
    /// Neither toolchain is there.
    #[error(
        "no compiler for {target}: neither the installed rustc (`rustup target add {target}`) nor Debian's rustc-web has it; run tests/setup.sh"
    )]
    Neither {
        /// The target.
        target: &'static str,
    },
}

impl Toolchain {
    /// Looks for a toolchain for the image.
    ///
    /// # Errors
    /// What is missing, and how to get it.
    pub fn find(choice: ToolchainChoice) -> Result<Self, ToolchainError> {
        Self::find_for(TARGET, choice)
    }

    /// Looks for a toolchain for another core.
    ///
    /// # Errors
    /// What is missing, and how to get it.
    pub fn find_for(target: &'static str, choice: ToolchainChoice) -> Result<Self, ToolchainError> {
        match choice {
            ToolchainChoice::Installed => {
                installed(target).ok_or(ToolchainError::NoTarget { target })
            }
            ToolchainChoice::Debian => debian(target),
            ToolchainChoice::Auto => match installed(target) {
                Some(toolchain) => Ok(toolchain),
                None => debian(target).map_err(|error| match error {
                    ToolchainError::NoDebian { .. } => ToolchainError::Neither { target },
                    other => other,
                }),
            },
        }
    }

    /// What it builds for.
    pub fn target(&self) -> &'static str {
        self.target
    }

    /// `cargo build` or `cargo rustc` for the target, with what this toolchain needs; the caller adds the package.
    pub fn cargo(&self, subcommand: &str) -> Command {
        let mut command = Command::new(&self.cargo);
        command.args([subcommand, "--target", self.target]);
        // Flags meant for the host (a CPU, a sanitiser) must not reach the microcontroller.
        command.env_remove("RUSTFLAGS");
        command.env_remove("CARGO_ENCODED_RUSTFLAGS");
        if let Some(parts) = &self.from_source {
            command.arg("-Zbuild-std=core");
            // Building core needs an unstable flag; Debian's compiler is a stable one.
            command.env("RUSTC_BOOTSTRAP", "1");
            command.env("RUSTC", &parts.rustc);
            command.env_remove("RUSTC_WRAPPER");
            command.env_remove("RUSTUP_TOOLCHAIN");
            let target = self.target.to_uppercase().replace(['-', '.'], "_");
            command.env(format!("CARGO_TARGET_{target}_LINKER"), &parts.linker);
        }
        command
    }

    /// A folder name that keeps the artefacts of different toolchains apart.
    pub fn slug(&self) -> &'static str {
        match self.from_source {
            None => "installed",
            Some(_) => "debian",
        }
    }
}

impl std::fmt::Display for Toolchain {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.from_source {
            None => write!(f, "the installed rustc, which has {}", self.target),
            Some(parts) => write!(
                f,
                "Debian's {} with core built from source, linked by {}",
                parts.rustc.display(),
                parts.linker.display()
            ),
        }
    }
}

fn installed(target: &'static str) -> Option<Toolchain> {
    let rustc = env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let libraries = printed_path(&rustc, &["--print", "target-libdir", "--target", target])?;
    libraries.is_dir().then(|| Toolchain {
        target,
        cargo: env::var_os("CARGO").unwrap_or_else(|| "cargo".into()),
        from_source: None,
    })
}

fn debian(target: &'static str) -> Result<Toolchain, ToolchainError> {
    let present = |path: PathBuf| {
        if path.is_file() {
            Ok(path)
        } else {
            Err(ToolchainError::NoDebian { missing: path })
        }
    };
    let rustc = present(DEBIAN_RUSTC.into())?;
    let cargo = present(DEBIAN_CARGO.into())?;
    let sysroot = printed_path(rustc.as_os_str(), &["--print", "sysroot"]).ok_or_else(|| {
        ToolchainError::NoDebian {
            missing: rustc.clone(),
        }
    })?;
    present(sysroot.join("lib/rustlib/src/rust/library/core/src/lib.rs"))?;
    let linker = linker(&sysroot).ok_or(ToolchainError::NoLinker)?;
    Ok(Toolchain {
        target,
        cargo: cargo.into_os_string(),
        from_source: Some(FromSource { rustc, linker }),
    })
}

/// `rust-lld` of either toolchain, or LLVM's own `ld.lld`.
fn linker(debian_sysroot: &Path) -> Option<PathBuf> {
    let in_sysroot = |sysroot: &Path| {
        let host = sysroot
            .join("lib/rustlib")
            .join(format!("{}-unknown-linux-gnu", env::consts::ARCH));
        Some(host.join("bin/rust-lld")).filter(|path| path.is_file())
    };
    in_sysroot(debian_sysroot)
        .or_else(|| {
            let sysroot = printed_path(&OsString::from("rustc"), &["--print", "sysroot"])?;
            in_sysroot(&sysroot)
        })
        .or_else(|| {
            let paths = env::var_os("PATH")?;
            env::split_paths(&paths)
                .map(|folder| folder.join("ld.lld"))
                .find(|path| path.is_file())
        })
}

/// The path a compiler prints, or `None` when it cannot.
fn printed_path(rustc: &std::ffi::OsStr, arguments: &[&str]) -> Option<PathBuf> {
    let output = Command::new(rustc)
        .args(arguments)
        .stderr(Stdio::null())
        .output()
        .ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().into())
}
