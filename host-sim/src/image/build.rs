//! Builds the image with a given blob in its flash.

use std::env;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitStatus;

use crate::image::toolchain::{TARGET, Toolchain};

const PACKAGE: &str = "bnkf";
const BINARY: &str = "tracker-image";
/// Profile and feature of the image, both called the same.
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
    #[error("building the image failed ({status}), see the compiler's messages above")]
    Compiler {
        /// Its exit status.
        status: ExitStatus,
    },
}

/// Builds the image around the bytes of `blob` and copies it to `image`.
///
/// # Errors
/// The sources are missing, or the compiler failed.
pub fn build_image(
    toolchain: &Toolchain,
    blob: &[u8],
    image: &Path,
) -> Result<(), ImageBuildError> {
    let io = |path: &Path| {
        let path = path.to_owned();
        move |cause| ImageBuildError::Io { path, cause }
    };
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    if !workspace.join("firmware/Cargo.toml").is_file() {
        return Err(ImageBuildError::NoSources { workspace });
    }
    let target_dir = env::var_os("CARGO_TARGET_DIR")
        .map_or_else(|| workspace.join("target"), PathBuf::from)
        .join("tracker-image")
        .join(toolchain.slug());
    fs::create_dir_all(&target_dir).map_err(io(&target_dir))?;

    // Another build with another blob must not replace the file before it was copied.
    let lock_path = target_dir.join("copying.lock");
    let lock = File::create(&lock_path).map_err(io(&lock_path))?;
    lock.lock().map_err(io(&lock_path))?;

    // Written only when it changed, so that the compiler sees when there is nothing to do.
    let blob_path = target_dir.join("blob.bnkf");
    if fs::read(&blob_path).ok().as_deref() != Some(blob) {
        fs::write(&blob_path, blob).map_err(io(&blob_path))?;
    }

    let mut command = toolchain.cargo_build();
    command
        .args(["--package", PACKAGE, "--bin", BINARY])
        .args(["--features", IMAGE, "--profile", IMAGE, "--locked"])
        .arg("--target-dir")
        .arg(&target_dir)
        .env("BNKF_BLOB", &blob_path)
        .current_dir(&workspace);
    let program = PathBuf::from(command.get_program());
    let status = command.status().map_err(io(&program))?;
    if !status.success() {
        return Err(ImageBuildError::Compiler { status });
    }
    let built = target_dir.join(TARGET).join(IMAGE).join(BINARY);
    fs::copy(&built, image).map_err(io(&built))?;
    Ok(())
}
