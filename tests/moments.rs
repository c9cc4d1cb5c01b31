//! The firmware's moments without passes beside those of a million passes, on every shipped model and
//! under every noise: inputs and references as `model-export moments MODEL --inputs 20 --json FILE`
//! wrote them (`--scenario counter-uas` for the counter-UAS model).

use bnkf::blob::Blob;
use bnkf_model_export::cmd::moments::File;
use bnkf_model_export::moments::comparison::Errors;

/// Every network under every noise stays within the limits of the command.
fn assert_accepted(blob: &[u8], references: &str, networks: usize) {
    let blob = Blob::parse(blob).expect("shipped blob");
    let file: File = serde_json::from_str(references).expect("references");
    assert_eq!(file.blob_crc, blob.checksum(), "references of another blob");
    assert_eq!(file.references.len(), 3 * networks);
    for references in &file.references {
        assert!(references.cases.len() >= 20 && references.passes >= 1_000_000);
        let errors = Errors::of(&blob, references).expect("cases of the blob");
        let (network, level) = (references.network, &references.level);
        assert!(errors.accepted(), "network {network}, {level}: {errors:?}");
    }
}

#[test]
fn of_bnkf() {
    assert_accepted(
        include_bytes!("../models/bnkf.bnkf"),
        include_str!("golden/moments/bnkf.json"),
        1,
    );
}

#[test]
fn of_bnkfe() {
    assert_accepted(
        include_bytes!("../models/bnkfe.bnkf"),
        include_str!("golden/moments/bnkfe.json"),
        3,
    );
}

#[test]
fn of_the_recursive_model() {
    assert_accepted(
        include_bytes!("../models/recursive.bnkf"),
        include_str!("golden/moments/recursive.json"),
        1,
    );
}

#[test]
fn of_the_counter_uas_model() {
    assert_accepted(
        include_bytes!("../models/recursive-counter-uas.bnkf"),
        include_str!("golden/moments/recursive-counter-uas.json"),
        1,
    );
}
