//! `host-sim image` as a user runs it: what it prints and how it exits.

use std::path::Path;
use std::process::{Command, Output};

use bnkf::Part;
use bnkf::blob::{self, Blob, field};
use bnkf_host_sim::image::build::build_image;
use bnkf_host_sim::image::toolchain::{Toolchain, ToolchainChoice};

const BLOB: &[u8] = include_bytes!("../../tests/golden/tiny_bnkf.bnkf");

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_host-sim"));
    command.arg("image").args(arguments);
    command
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The only line of standard error of a command that must fail.
fn error(mut command: Command) -> String {
    let output = command.output().unwrap();
    assert!(!output.status.success());
    let text = stderr(&output);
    assert_eq!(text.lines().count(), 1, "{text}");
    text
}

/// The blob with another weight in its last layer, and its checksum made good.
fn changed_blob() -> Vec<u8> {
    let mut bytes = BLOB.to_vec();
    let network = Blob::parse(BLOB).unwrap().networks().next().unwrap();
    let means = network.layer(network.layers() - 1).means;
    let weight = means.as_ptr().addr() - BLOB.as_ptr().addr();
    bytes[weight] ^= 0x40;
    let checksum = blob::checksum(&bytes).to_le_bytes();
    bytes[field::CRC].copy_from_slice(&checksum);
    bytes
}

/// The header of an ELF file for Arm that holds nothing.
fn empty_image() -> Vec<u8> {
    let mut bytes = b"\x7fELF\x01\x01\x01".to_vec();
    bytes.resize(16, 0);
    // Type and machine, version, three places and flags, sizes and numbers.
    bytes.extend([2_u16, 40, 1, 0].into_iter().flat_map(u16::to_le_bytes));
    bytes.extend([0; 16]);
    let sizes = [52_u16, 32, 0, 40, 0, 0];
    bytes.extend(sizes.into_iter().flat_map(u16::to_le_bytes));
    bytes
}

#[test]
fn equal_blobs_succeed_and_a_changed_weight_fails() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let (image, same, changed) = (path("image.elf"), path("same.bnkf"), path("changed.bnkf"));
    let toolchain = Toolchain::find(ToolchainChoice::Auto).unwrap();
    build_image(&toolchain, BLOB, &Part::ALL, &image).unwrap();
    std::fs::write(&same, BLOB).unwrap();
    std::fs::write(&changed, changed_blob()).unwrap();

    let run = |model: &Path| {
        let (image, model) = (text(&image), text(model));
        let arguments = [
            "--image", &image, "--model", &model, "--passes", "10", "--log",
        ];
        command(&arguments).output().unwrap()
    };
    let output = run(&same);
    let report = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", stderr(&output));
    for expected in [
        "\n150 of 150 estimates identical\n",
        "\nflash ",
        "\nRAM ",
        "\ninstructions  per estimate with 10 passes: min ",
        "\nlog           INFO  ready: blob ",
        "\nlog           INFO  new track: 10 passes\n",
    ] {
        assert!(
            report.contains(expected),
            "{expected:?} is not in\n{report}"
        );
    }

    let output = run(&changed);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("estimates differ"),
        "{}",
        stderr(&output)
    );
    let report = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(report.contains("holds another blob"), "{report}");
}

#[test]
fn wrong_inputs_give_one_line_and_a_failure() {
    let blob = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../tests/golden/tiny_bnkf.bnkf"
    );
    let model = ["--model", blob];
    let with = |more: &[&'static str]| command(&[&model, more].concat());

    let missing = error(with(&["--image", "/nowhere/image.elf"]));
    assert!(missing.contains("/nowhere/image.elf"), "{missing}");
    let flight = error(with(&["--flight", "/nowhere/flight.csv"]));
    assert!(flight.starts_with("error: /nowhere/flight.csv"), "{flight}");
    let passes = error(with(&["--image", "/nowhere/image.elf", "--passes", "0"]));
    assert!(passes.contains("passes"), "{passes}");
    let no_blob = error(command(&["--model", "/nowhere/m.bnkf"]));
    assert!(no_blob.starts_with("error: /nowhere/m.bnkf"), "{no_blob}");
    let other = std::env::current_exe().unwrap();
    for file in [Path::new(blob), &other] {
        let mut no_image = with(&["--image"]);
        no_image.arg(file);
        let no_image = error(no_image);
        let expected = format!(
            "error: {}: no ELF image for an Arm processor",
            file.display()
        );
        assert!(no_image.starts_with(&expected), "{no_image}");
    }
    let folder = tempfile::tempdir().unwrap();
    let image = folder.path().join("image.elf");
    std::fs::write(&image, empty_image()).unwrap();
    let mut no_tools = with(&["--image"]);
    no_tools.arg(&image).env("PATH", "/nowhere");
    let no_tools = error(no_tools);
    assert!(no_tools.contains("tests/setup.sh"), "{no_tools}");
}
