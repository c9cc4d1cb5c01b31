//! `firmware/include/bnkf.h` is what cbindgen makes of `firmware/src/c/`. To write it anew:
//! `BNKF_WRITE_HEADER=1 cargo test --test header`.

use std::fmt::Write as _;
use std::path::Path;
use std::{env, fs};

use bnkf::TRACK_SNAPSHOT_BYTES;
use bnkf::c::{BNKF_MODEL_WORDS, BNKF_TRACK_WORDS, BNKF_WORKSPACE_WORDS, BnkfTrack};
use cbindgen::{Builder, Config, DocumentationStyle, EnumConfig, Language, RenameRule, Style};

const HEADER: &str = "firmware/include/bnkf.h";
const OPENING: &str = "/* BNKF, a Bayesian neural Kalman tracker: firmware/src/c/ for C. See docs/c.md.

   Made by cbindgen (tests/header.rs): do not edit. Metres, seconds, radians; x east, y north, z up. Nothing
   is allocated, nothing panics, and no function keeps state: whatever is not given to two calls at a time
   may be used from any thread or interrupt. */";

/// Sizes as numbers, which C needs before any type.
fn sizes() -> String {
    let mut text = String::from(
        "/* Alignment of every place, and sizes in words of 8 bytes and in bytes. */\n",
    );
    let alignment = align_of::<BnkfTrack>();
    writeln!(text, "#define BNKF_ALIGNMENT {alignment}").unwrap();
    for (name, words) in PLACES {
        writeln!(text, "#define BNKF_{name}_WORDS {words}").unwrap();
        writeln!(text, "#define BNKF_{name}_BYTES {}", 8 * words).unwrap();
    }
    writeln!(text, "/* Length of every track as bytes. */").unwrap();
    write!(
        text,
        "#define BNKF_TRACK_SNAPSHOT_BYTES {TRACK_SNAPSHOT_BYTES}"
    )
    .unwrap();
    text
}

const PLACES: [(&str, usize); 3] = [
    ("MODEL", BNKF_MODEL_WORDS),
    ("WORKSPACE", BNKF_WORKSPACE_WORDS),
    ("TRACK", BNKF_TRACK_WORDS),
];

/// The compiler's sizes are those above, or nothing compiles.
fn assertions() -> String {
    let mut text = String::from(
        "#ifdef __cplusplus\n#define BNKF_ASSERT static_assert\n#define BNKF_ALIGN_OF alignof\n#else\n\
         #define BNKF_ASSERT _Static_assert\n#define BNKF_ALIGN_OF _Alignof\n#endif\n",
    );
    for (name, place) in [
        ("MODEL", "BnkfModel"),
        ("WORKSPACE", "BnkfWorkspace"),
        ("TRACK", "BnkfTrack"),
    ] {
        writeln!(
            text,
            "BNKF_ASSERT(sizeof({place}) == BNKF_{name}_BYTES, \"{place}\");"
        )
        .unwrap();
        writeln!(
            text,
            "BNKF_ASSERT(BNKF_ALIGN_OF({place}) == BNKF_ALIGNMENT, \"{place}\");"
        )
        .unwrap();
    }
    text + "#undef BNKF_ASSERT\n#undef BNKF_ALIGN_OF"
}

fn header(root: &Path) -> String {
    let mut config = Config {
        language: Language::C,
        header: Some(OPENING.into()),
        include_guard: Some("BNKF_H".into()),
        after_includes: Some(sizes()),
        trailer: Some(assertions()),
        cpp_compat: true,
        style: Style::Both,
        documentation_style: DocumentationStyle::C99,
        line_length: 110,
        no_includes: true,
        sys_includes: ["stdbool.h", "stddef.h", "stdint.h"]
            .map(String::from)
            .into(),
        usize_is_size_t: true,
        enumeration: EnumConfig {
            rename_variants: RenameRule::QualifiedScreamingSnakeCase,
            ..EnumConfig::default()
        },
        ..Config::default()
    };
    // Codes that are given as numbers, because C may give any.
    config.export.include = ["BnkfCorrection", "BnkfInferenceKind"]
        .map(String::from)
        .into();
    let files = [
        "status",
        "place",
        "settings",
        "measurement",
        "estimate",
        "likelihood",
        "mounting",
        "model",
        "workspace",
        "track",
    ];
    let sources = files.map(|name| root.join("firmware/src/c").join(name).with_extension("rs"));
    let builder = sources
        .iter()
        .fold(Builder::new().with_config(config), |builder, source| {
            builder.with_src(source)
        });
    let mut text = Vec::new();
    builder.generate().unwrap().write(&mut text);
    String::from_utf8(text).unwrap()
}

#[test]
fn the_header_is_current() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (path, made) = (root.join(HEADER), header(root));
    if env::var_os("BNKF_WRITE_HEADER").is_some() {
        fs::write(&path, &made).unwrap();
    }
    let there = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        there == made,
        "{HEADER} is not current: BNKF_WRITE_HEADER=1 cargo test --test header"
    );
}
