//! `model-export import` as a user runs it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn golden(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/golden/torch_networks");
    folder.join(name)
}

fn model_export(arguments: &[&Path]) -> Output {
    let program = env!("CARGO_BIN_EXE_model-export");
    Command::new(program).args(arguments).output().unwrap()
}

fn import(weights: &Path, recipe: &Path, out: &Path) -> Output {
    let option = |name| Path::new(name);
    model_export(&[
        option("import"),
        option("--weights"),
        weights,
        option("--recipe"),
        recipe,
        option("--out"),
        out,
    ])
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn an_imported_network_is_verified_and_inspected() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("m.bnkf");
    let imported = import(&golden("relu.pt"), &golden("relu.toml"), &out);
    assert!(imported.status.success(), "{}", text(&imported.stderr));
    let said = text(&imported.stdout);
    assert!(
        said.contains("m.bnkf: ") && said.contains("SHA-256"),
        "{said}"
    );
    assert!(
        said.contains("16x13") && said.contains("shift mean"),
        "{said}"
    );
    assert!(folder.path().join("m.bnkf.f32").exists());

    let inspected = model_export(&[Path::new("inspect"), &out]);
    let said = text(&inspected.stdout);
    for part in [
        "format      version 3",
        "activation  ReLU",
        "polar-13 (13 inputs)",
    ] {
        assert!(said.contains(part), "{part} is missing in:\n{said}");
    }
    let few = ["--rows", "10", "--passes", "100"].map(Path::new);
    let verified = model_export(&[&[Path::new("verify"), &out][..], &few].concat());
    let said = text(&verified.stdout);
    assert!(said.contains("\nall "), "{said}{}", text(&verified.stderr));
    // The passes that moments are compared with know GELU alone.
    let refused = model_export(&[Path::new("moments"), &out]);
    assert!(!refused.status.success());
    assert!(text(&refused.stderr).contains("do not end in GELU"));
}

#[test]
fn refusals_name_file_and_field_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let recipe = std::fs::read_to_string(golden("relu.toml")).unwrap();
    let recipe = |name: &str, from: &str, to: &str| {
        assert!(recipe.contains(from));
        file(name, recipe.replace(from, to).as_bytes())
    };
    let relu = golden("relu.pt");
    // Every number 50: deviations are exp(50), and no variance is.
    let mut wide = std::fs::read(golden("gelu.safetensors")).unwrap();
    let header = u64::from_le_bytes(*wide.first_chunk().unwrap()) as usize;
    let (numbers, []) = wide[8 + header..].as_chunks_mut() else {
        panic!("whole numbers");
    };
    numbers.fill(50_f32.to_le_bytes());
    let cases = [
        (
            file("wide", &wide),
            golden("gelu.toml"),
            "wide: no blob holds it: blob field out of range: largest weight variance",
        ),
        (
            golden("tanh.pt"),
            golden("relu.toml"),
            "tanh.pt: tensor \"0.mu_weight\" is of no",
        ),
        (
            golden("none.pt"),
            golden("relu.toml"),
            "none.pt: cannot read",
        ),
        (
            file("w.pt", b"PK\x03\x04"),
            golden("relu.toml"),
            "w.pt: not a whole zip archive",
        ),
        (
            file("w", b"{}"),
            golden("relu.toml"),
            "w: neither a file of torch.save",
        ),
        (
            relu.clone(),
            recipe("r.toml", "\"relu\"", "\"selu\""),
            "r.toml: line 2: unknown variant",
        ),
        (
            relu.clone(),
            recipe("p.toml", "= 4.0", "= 0.0"),
            "p.toml: no blob holds it: blob parameter",
        ),
        (
            relu.clone(),
            golden("identity.toml"),
            "relu.pt: layer \"0\" has 13 inputs",
        ),
    ];
    for (weights, recipe, expected) in cases {
        let out = folder.path().join("m.bnkf");
        let refused = import(&weights, &recipe, &out);
        let said = text(&refused.stderr);
        assert!(
            !refused.status.success() && said.contains(expected),
            "{expected}: {said}"
        );
        assert_eq!(said.lines().count(), 1, "{said}");
        assert!(!out.exists() && !folder.path().join("m.bnkf.f32").exists());
    }
}
