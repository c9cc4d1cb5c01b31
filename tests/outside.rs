//! The crate outside this repository: the README's lines in a crate of their own, and the crate as it is packaged.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use bnkf_host_sim::image::build::target_dir;
use bnkf_host_sim::image::toolchain::{TARGET, Toolchain, ToolchainChoice};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn succeed(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {errors}");
    String::from_utf8_lossy(&output.stdout).into()
}

/// All blocks in a language below "In your firmware".
fn printed(language: &str) -> String {
    let page = fs::read_to_string(root().join("README.md")).unwrap();
    let (_, section) = page.split_once("\n## In your firmware\n").unwrap();
    let (section, _) = section.split_once("\n## ").unwrap();
    let fence = format!("```{language}\n");
    let blocks = section.split(&fence).skip(1);
    blocks
        .map(|rest| rest.split_once("```").unwrap().0)
        .collect::<Vec<_>>()
        .join("\n")
}

#[test]
fn the_readme_builds_as_it_is_printed() {
    let folder = tempfile::tempdir().unwrap();
    let node = folder.path().join("node");
    let package = "[package]\nname = \"node\"\nedition = \"2024\"\n\n";
    fs::create_dir_all(node.join("src")).unwrap();
    fs::write(
        node.join("Cargo.toml"),
        format!("{package}{}", printed("toml")),
    )
    .unwrap();
    fs::write(node.join("src/lib.rs"), printed("rust")).unwrap();
    // The versions that are here already: no registry is asked.
    fs::copy(root().join("Cargo.lock"), node.join("Cargo.lock")).unwrap();
    std::os::unix::fs::symlink(root(), folder.path().join("bnkf")).unwrap();
    let mut built = Vec::new();
    for target in [TARGET, "riscv32imc-unknown-none-elf"] {
        match Toolchain::find_for(target, ToolchainChoice::Auto) {
            Ok(toolchain) => {
                let artefacts = target_dir(&toolchain).unwrap_or_else(|e| panic!("{e}"));
                let mut command = toolchain.cargo("build");
                command
                    .arg("--offline")
                    .arg("--target-dir")
                    .arg(artefacts.join("outside"));
                succeed(command.env("RUSTFLAGS", "-D warnings").current_dir(&node));
                built.push(target);
            }
            Err(error) => eprintln!("{target}: not checked here: {error}"),
        }
    }
    assert!(
        built.contains(&TARGET),
        "at least the image's core is checked"
    );
}

/// It is unpacked where nothing of this repository is beside it, and all of its tests run there.
#[test]
fn the_package_builds_and_tests_alone() {
    let folder = tempfile::tempdir().unwrap();
    let cargo = |arguments: &[&str], folder: &Path| {
        let mut command = Command::new(env!("CARGO"));
        command
            .args(arguments)
            .current_dir(folder)
            .env_remove("CARGO_MANIFEST_DIR");
        command
    };
    let packaged = folder.path().join("packaged");
    succeed(
        cargo(
            &[
                "package",
                "-p",
                "bnkf",
                "--offline",
                "--locked",
                "--allow-dirty",
                "--no-verify",
            ],
            root(),
        )
        .arg("--target-dir")
        .arg(&packaged),
    );
    let archives = fs::read_dir(packaged.join("package")).unwrap();
    let mut archives = archives.map(|entry| entry.unwrap().path());
    let archive: PathBuf = archives
        .find(|path| path.extension().is_some_and(|name| name == "crate"))
        .unwrap();
    // With times of now: those of an archive are the same for every version, and cargo would test what it built before.
    succeed(
        Command::new("tar")
            .arg("xmzf")
            .arg(&archive)
            .arg("-C")
            .arg(folder.path()),
    );
    let alone = folder.path().join(archive.file_stem().unwrap());
    for name in [
        "LICENSE-MIT",
        "LICENSE-APACHE",
        "README.md",
        "BLOB.md",
        "include/bnkf.h",
        "memory.x",
    ] {
        assert!(alone.join(name).is_file(), "{name} is not in the package");
    }
    // The workspace's own profile, so that the tests are as fast as there.
    let artefacts = root().join("target").join("packaged");
    let artefacts = std::env::var_os("CARGO_TARGET_DIR")
        .map_or(artefacts, |dir| PathBuf::from(dir).join("packaged"));
    let tests = cargo(&["test", "--offline", "--locked", "--quiet"], &alone)
        .env("CARGO_PROFILE_TEST_OPT_LEVEL", "1")
        .env("CARGO_PROFILE_TEST_DEBUG", "false")
        .env("CARGO_TARGET_DIR", artefacts)
        .output()
        .unwrap();
    let (said, errors) = (
        String::from_utf8_lossy(&tests.stdout),
        String::from_utf8_lossy(&tests.stderr),
    );
    assert!(tests.status.success(), "{said} {errors}");
    assert!(said.contains("passed"), "{said}");
}
