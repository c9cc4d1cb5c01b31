//! Builds the image with a given blob in its flash, and the other programs for microcontrollers.

use std::env;
use std::fs::{self, File};
use std::io;
use std::path::{self, Path, PathBuf};
use std::process::{Command, ExitStatus};

use bnkf::Part;

use crate::image::toolchain::Toolchain;

const PACKAGE: &str = "bnkf";
const BINARY: &str = "tracker-image";
/// Feature of the image, and the profile of everything that runs on a microcontroller.
const IMAGE: &str = "image";

/// Why the image was not built.
#[derive(Debug, thiserror::Error)]
pub enum ImageBuildError {
    /// The sources are not where this program was compiled.
    #[error("{}: the workspace's sources are not there; give a built image with --image", workspace.display())]
    NoSources {
        /// Where they were.
        workspace: PathBuf,
    },
    /// A file or process operation failed.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file or program.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// The compiler failed; it has said why.
    #[error(
        "building for the microcontroller failed ({status}), see the compiler's messages above"
    )]
    Compiler {
        /// Its exit status.
        status: ExitStatus,
    },
}

/// Builds the image around the bytes of `blob`, with those of the parts that can be left out, and copies it to
/// `image`.
///
/// # Errors
/// The sources are missing, or the compiler failed.
pub fn build_image(
    toolchain: &Toolchain,
    blob: &[u8],
    parts: &[Part],
    image: &Path,
) -> Result<(), ImageBuildError> {
    let io = |path: &Path| {
        let path = path.to_owned();
        move |cause| ImageBuildError::Io { path, cause }
    };
    let target_dir = target_dir(toolchain)?;

    // Another build with another blob must not replace the file before it was copied.
    let lock_path = target_dir.join("copying.lock");
    let lock = File::create(&lock_path).map_err(io(&lock_path))?;
    lock.lock().map_err(io(&lock_path))?;

    // Written only when it changed, so that the compiler sees when there is nothing to do.
    let blob_path = target_dir.join("blob.bnkf");
    if fs::read(&blob_path).ok().as_deref() != Some(blob) {
        fs::write(&blob_path, blob).map_err(io(&blob_path))?;
    }

    let mut command = toolchain.cargo("build");
    command.args([
        "--bin",
        BINARY,
        "--no-default-features",
        "--features",
        IMAGE,
    ]);
    for part in parts {
        command.args(["--features", &part.to_string()]);
    }
    command.env("BNKF_BLOB", &blob_path);
    let built = build(toolchain, command)?.join(BINARY);
    fs::copy(&built, image).map_err(io(&built))?;
    Ok(())
}

/// Builds the program `name` of the firmware's package, which has a feature of the same name.
///
/// # Errors
/// The sources are missing, or the compiler or the linker failed.
pub fn build_program(toolchain: &Toolchain, name: &str) -> Result<PathBuf, ImageBuildError> {
    let mut command = toolchain.cargo("build");
    command.args(["--bin", name, "--features", name]);
    Ok(build(toolchain, command)?.join(name))
}

/// Builds the example `name` of the firmware's package.
///
/// # Errors
/// The sources are missing, or the compiler or the linker failed.
pub fn build_example(toolchain: &Toolchain, name: &str) -> Result<PathBuf, ImageBuildError> {
    let mut command = toolchain.cargo("build");
    command.args(["--example", name]);
    Ok(build(toolchain, command)?.join("examples").join(name))
}

/// Builds the static library for C.
///
/// # Errors
/// The sources are missing, or the compiler failed.
pub fn build_library(toolchain: &Toolchain) -> Result<PathBuf, ImageBuildError> {
    let mut command = toolchain.cargo("rustc");
    command.args(["--lib", "--crate-type", "staticlib"]);
    command.args(["--features", "c-library"]);
    Ok(build(toolchain, command)?.join("libbnkf.a"))
}

fn workspace() -> Result<PathBuf, ImageBuildError> {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    if workspace.join("firmware/Cargo.toml").is_file() {
        Ok(workspace)
    } else {
        Err(ImageBuildError::NoSources { workspace })
    }
}

/// Where a toolchain's artefacts lie.
///
/// # Errors
/// The sources are missing, or the folder cannot be made.
pub fn target_dir(toolchain: &Toolchain) -> Result<PathBuf, ImageBuildError> {
    let target_dir = match env::var_os("CARGO_TARGET_DIR") {
        // The compiler is run in the workspace, and the image's build script in the package.
        Some(folder) => path::absolute(&folder).map_err(|cause| ImageBuildError::Io {
            path: folder.into(),
            cause,
        })?,
        None => workspace()?.join("target"),
    };
    let path = target_dir.join("tracker-image").join(toolchain.slug());
    fs::create_dir_all(&path)
        .map(|()| path.clone())
        .map_err(|cause| ImageBuildError::Io { path, cause })
}

/// Runs the compiler; answers where its artefacts lie.
fn build(toolchain: &Toolchain, mut command: Command) -> Result<PathBuf, ImageBuildError> {
    let target_dir = target_dir(toolchain)?;
    command
        .args(["--package", PACKAGE, "--profile", IMAGE, "--locked"])
        .arg("--target-dir")
        .arg(&target_dir)
        .current_dir(workspace()?);
    let status = command.status().map_err(|cause| ImageBuildError::Io {
        path: command.get_program().into(),
        cause,
    })?;
    if !status.success() {
        return Err(ImageBuildError::Compiler { status });
    }
    Ok(target_dir.join(toolchain.target()).join(IMAGE))
}
