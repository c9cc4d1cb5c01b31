//! The crate from C: a program without a heap prints the number that `same-bits` prints, on the host under the
//! address and undefined-behaviour sanitizers and on a Cortex-M4F in QEMU; what `docs/c.md` prints builds.
//!
//! What is not there (a compiler for the microcontroller, QEMU, CMake) is named and left out; `tests/setup.sh`
//! gets it.

#[path = "../firmware/src/bin/same-bits/flight.rs"]
mod flight;
#[path = "../firmware/src/bin/same-bits/hash.rs"]
mod hash;
mod runner;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use bnkf_host_sim::image::build::{build_library, target_dir};
use bnkf_host_sim::image::toolchain::{TARGET, Toolchain, ToolchainChoice};

const WARNINGS: [&str; 5] = ["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// What a command says, or nothing if there is no such program.
fn run(command: &mut Command) -> Option<Output> {
    match command.stdin(Stdio::null()).output() {
        Ok(output) => Some(output),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            eprintln!("not checked here: no {}", command.get_program().display());
            None
        }
        Err(error) => panic!("{command:?}: {error}"),
    }
}

/// What a command that must succeed says, or nothing if there is no such program.
fn succeed(command: &mut Command) -> Option<String> {
    let output = run(command)?;
    let errors = String::from_utf8_lossy(&output.stderr);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{command:?}: {said} {errors}");
    Some(said.trim().into())
}

/// The example, compiled and linked by `compiler`, with the part of it that is `platform`'s.
fn compile(
    compiler: &str,
    platform: &str,
    library: &Path,
    options: &[&str],
    program: &Path,
) -> bool {
    let example = root().join("firmware/examples/c");
    let sources = ["main.c", platform, "models.S"].map(|name| example.join(name));
    succeed(
        Command::new(compiler)
            .args(WARNINGS)
            // The flight's numbers must be the same everywhere.
            .args(["-O2", "-ffp-contract=off"])
            .arg("-I")
            .arg(root().join("firmware/include"))
            // For the models.
            .arg(format!("-Wa,-I{}", root().display()))
            .args(sources)
            .arg(library)
            .args(options)
            .arg("-o")
            .arg(program),
    )
    .is_some()
}

/// A toolchain for this computer.
fn host() -> Toolchain {
    let version = succeed(Command::new("rustc").arg("-vV")).expect("rustc");
    let line = version.lines().find_map(|line| line.strip_prefix("host: "));
    let host = String::from(line.expect("a host")).leak();
    Toolchain::find_for(host, ToolchainChoice::Installed).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_host_says_from_c_what_it_says_from_rust() {
    let library = build_library(&host()).unwrap_or_else(|e| panic!("{e}"));
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("program");
    let sanitizers = [
        "-fsanitize=address,undefined",
        "-fno-sanitize-recover=all",
        "-lm",
    ];
    assert!(
        compile("cc", "host.c", &library, &sanitizers, &program),
        "a C compiler"
    );
    let said = succeed(&mut Command::new(&program));
    assert_eq!(said, Some(format!("{:016x}", hash::hash())));
}

#[test]
fn a_microcontroller_says_from_c_what_the_host_says_from_rust() {
    let toolchain = match Toolchain::find(ToolchainChoice::Auto) {
        Ok(toolchain) => toolchain,
        Err(error) => return eprintln!("not checked here: {error}"),
    };
    let library = build_library(&toolchain).unwrap_or_else(|e| panic!("{e}"));
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("program");
    let script = root().join("firmware/examples/c/board.ld");
    let script = format!("-T{}", script.display());
    let options = [
        "-mcpu=cortex-m4",
        "-mthumb",
        "-mfpu=fpv4-sp-d16",
        "-mfloat-abi=hard",
        // No C library and no start-up code: only what the example and the library bring.
        "-ffreestanding",
        "-nostdlib",
        "-Wl,--gc-sections",
        "-Wl,-z,noexecstack",
        &script,
        "-lgcc",
    ];
    if !compile("arm-none-eabi-gcc", "board.c", &library, &options, &program) {
        return;
    }
    if let Some(said) = runner::says(TARGET, &program) {
        assert_eq!(said, format!("{:016x}", hash::hash()));
    }
}

#[test]
fn the_header_is_cpp_too() {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("header.cpp");
    fs::write(&source, "#include \"bnkf.h\"\n").unwrap();
    succeed(
        Command::new("c++")
            .args(["-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Werror"])
            .arg("-I")
            .arg(root().join("firmware/include"))
            .args(["-c", "-o", "/dev/null"])
            .arg(&source),
    );
}

/// The only block of `docs/c.md` in a language.
fn printed(page: &str, language: &str) -> String {
    let fence = format!("```{language}\n");
    let mut blocks = page.split(&fence).skip(1);
    let block = blocks.next().and_then(|rest| rest.split_once("```"));
    let (block, _) = block.unwrap_or_else(|| panic!("no {language} in docs/c.md"));
    assert!(blocks.next().is_none(), "one block of {language}");
    block.into()
}

/// A project beside a checkout, made of nothing but what the page prints.
#[test]
fn what_the_page_prints_builds_and_runs() {
    let page = fs::read_to_string(root().join("docs/c.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let node = folder.path();
    fs::write(node.join("CMakeLists.txt"), printed(&page, "cmake")).unwrap();
    fs::write(node.join("main.c"), printed(&page, "c")).unwrap();
    std::os::unix::fs::symlink(root(), node.join("bnkf")).unwrap();
    let host = host();
    // Where the library of the first test is, so that it is built once.
    let artefacts: PathBuf = target_dir(&host).unwrap_or_else(|e| panic!("{e}"));
    let configured = succeed(
        Command::new("cmake")
            .args(["-S", ".", "-B", "build"])
            .arg(format!("-DBNKF_TARGET={}", host.target()))
            .arg(format!("-DBNKF_ARTEFACTS={}", artefacts.display()))
            .current_dir(node),
    );
    if configured.is_none() {
        return;
    }
    succeed(
        Command::new("cmake")
            .args(["--build", "build"])
            .current_dir(node),
    );
    let said = succeed(Command::new("build/node").current_dir(node)).expect("what was built");
    assert!(said.contains("tracking"), "{said}");
}
