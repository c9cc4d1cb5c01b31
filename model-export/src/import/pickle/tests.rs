use super::*;

/// A pickle of one tensor `w` of the given global, as `torch.save` writes it.
fn pickle(storage: &str, rebuild: &str) -> Vec<u8> {
    let mut bytes = b"\x80\x02ccollections\nOrderedDict\nq\x00)Rq\x01(X\x01\x00\x00\x00w".to_vec();
    bytes.extend(format!("c{rebuild}\nq\x02((X\x07\x00\x00\x00storagectorch\n{storage}\n").bytes());
    bytes.extend(b"X\x01\x00\x00\x000X\x03\x00\x00\x00cpuK\x06tQK\x02K\x02K\x03\x86K\x03K\x01\x86\x89h\x00)RtRu}X\x09\x00\x00\x00_metadata}sb.");
    bytes
}

const REBUILD: &str = "torch._utils\n_rebuild_tensor_v2";

#[test]
fn a_tensor_is_what_its_record_says() {
    let formats = [
        ("HalfStorage", NumberFormat::F16),
        ("FloatStorage", NumberFormat::F32),
        ("DoubleStorage", NumberFormat::F64),
    ];
    for (storage, format) in formats {
        let bytes = pickle(storage, REBUILD);
        let record = TensorRecord {
            name: "w",
            format,
            storage: "0",
            offset: 2,
            shape: vec![2, 3],
            strides: vec![3, 1],
        };
        assert_eq!(state_dict(&bytes), Ok(vec![record]));
    }
}

#[test]
fn nothing_else_is_named() {
    let global = |name: &str| Err(PickleError::Global(name.to_owned()));
    let bytes = pickle("LongStorage", REBUILD);
    assert_eq!(state_dict(&bytes), global("torch.LongStorage"));
    let bytes = pickle("FloatStorage", "os\nsystem");
    assert_eq!(state_dict(&bytes), global("os.system"));
    // What runs a shell in Python's reader.
    let bytes = b"cposix\nsystem\n(X\x07\x00\x00\x00echo hitR.";
    assert_eq!(state_dict(bytes), global("posix.system"));
    let bytes = b"\x80\x04\x8c\x02os\x8c\x06system\x93.";
    let refused = PickleError::Operation { code: 0x8c, at: 2 };
    assert_eq!(state_dict(bytes), Err(refused));
}

#[test]
fn what_is_no_dictionary_of_tensors_says_so() {
    let cases: [(&[u8], &str); 4] = [
        (
            b"N.",
            "is no state dict: the whole is no tensor; save it with torch.save(model.state_dict(), FILE)",
        ),
        (
            b"}X\x05\x00\x00\x00epochK\x03s.",
            "is no state dict: \"epoch\" is no tensor; save it with torch.save(model.state_dict(), FILE)",
        ),
        (
            b"}K\x03K\x03s.",
            "is no state dict: an entry without a name is no tensor; save it with torch.save(model.state_dict(), FILE)",
        ),
        (b"}.", ""),
    ];
    for (bytes, expected) in cases {
        match state_dict(bytes) {
            Ok(records) => assert!(records.is_empty() && expected.is_empty()),
            Err(error) => assert_eq!(error.to_string(), expected),
        }
    }
}

#[test]
fn no_truncation_is_read() {
    let bytes = pickle("FloatStorage", REBUILD);
    for length in 0..bytes.len() {
        state_dict(&bytes[..length]).unwrap_err();
    }
}

#[test]
fn operations_on_what_is_not_there_are_refused() {
    let cases: [&[u8]; 15] = [
        b".",
        b"t.",
        b"u.",
        b"s.",
        b"R.",
        b"Q.",
        b"b.",
        b"q\x00.",
        b"h\x00.",
        b"\x85.",
        b"K\x01(0.",
        b"}(K\x01u.",
        b"K\x01K\x02K\x03s.",
        b"(}N.t.",
        b"NN(R.",
    ];
    for bytes in cases {
        state_dict(bytes).unwrap_err();
    }
    // A mark below which the stack has shrunk.
    let refused = state_dict(b"}K\x01K\x02(s)t.").unwrap_err();
    assert!(matches!(refused, PickleError::Misfit { .. }), "{refused}");
}

/// One tensor under `names` names, three bytes of pickle and a name each.
fn many_names(names: usize) -> Vec<u8> {
    let mut bytes = pickle("FloatStorage", REBUILD);
    let end = bytes.windows(4).position(|four| four == b"tRu}").unwrap();
    let more = b"X\x01\x00\x00\x00wh\x05".repeat(names - 1);
    bytes.splice(end + 2..end + 2, [&b"q\x05"[..], &more].concat());
    bytes
}

#[test]
fn a_tensor_has_no_more_names_than_a_file_has_tensors() {
    let bytes = many_names(TENSORS_MAX);
    assert_eq!(state_dict(&bytes).map(|r| r.len()), Ok(TENSORS_MAX));
    let bytes = many_names(TENSORS_MAX + 1);
    assert_eq!(state_dict(&bytes), Err(PickleError::Tensors));
}

/// As many values as operations, and a bounded number of tensors.
#[test]
fn what_would_fill_the_memory_is_refused() {
    let mut bytes = pickle("FloatStorage", REBUILD);
    let end = bytes.windows(3).position(|three| three == b"tRu").unwrap();
    // The call's arguments, kept and used again and again.
    let again = b"tq\x09Rh\x02h\x09".to_vec();
    let call = [&again[..], &b"Rh\x02h\x09".repeat(TENSORS_MAX)].concat();
    bytes.splice(end..end + 1, call);
    assert_eq!(state_dict(&bytes), Err(PickleError::Tensors));

    let deep = [&b"N\x85"[..], &b"\x85".repeat(100_000), b"."].concat();
    assert!(matches!(state_dict(&deep), Err(PickleError::NotTensors(_))));
    let name = [&b"X\xFF\xFF\xFF\xFF"[..], &[b'a'; 300]].concat();
    assert_eq!(state_dict(&name), Err(PickleError::Name { at: 5 }));
}
