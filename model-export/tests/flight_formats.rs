//! One flight in every form, written by other programs (`tests/golden/flights.py`), read to the millimetre.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use bnkf_model_export::flights::csv::options::ReadOptions;
use bnkf_model_export::flights::flight_file::{FlightFile, parse, read_flight};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/golden/flights")
}

fn expected() -> BTreeMap<String, Vec<[f64; 4]>> {
    let text = std::fs::read(folder().join("expected.json")).unwrap();
    serde_json::from_slice(&text).unwrap()
}

fn read(name: &str, options: &ReadOptions) -> FlightFile {
    read_flight(&folder().join(name), options).unwrap()
}

#[test]
fn every_form_is_read_to_the_millimetre() {
    let all = expected();
    assert_eq!(all.len(), 9);
    for (name, rows) in all {
        let file = read(&name, &ReadOptions::default());
        assert_eq!(
            file.flight.samples.len(),
            rows.len(),
            "{name}: {:?}",
            file.notes
        );
        for (sample, [time_s, x, y, z]) in file.flight.samples.iter().zip(rows) {
            assert!((sample.time_s - time_s).abs() < 1e-6, "{name}");
            for (got, wanted) in sample.position_m.into_iter().zip([x, y, z]) {
                assert!((got - wanted).abs() < 1e-3, "{name}: {got} {wanted}");
            }
        }
    }
}

#[test]
fn what_was_assumed_is_said() {
    let said = |name: &str| read(name, &ReadOptions::default()).notes.join("; ");
    assert!(said("airdata.csv").contains("1 rows left out whose time is the one before"));
    assert!(said("airdata.csv").contains("(feet) read as latitude, longitude and height"));
    assert!(said("geodetic.csv").contains("up from it"));
    assert!(said("px4.ulg").contains("1 positions left out that the log marks as invalid"));
    assert!(said("ardupilot_pos.bin").contains("positions of POS"));
    assert_eq!(
        said("px4.ulg").split(';').next(),
        Some("read as PX4's ULog")
    );
    assert_eq!(said("ardupilot.bin"), "read as ArduPilot's log");
    assert!(said("tum_without_header.tum").contains("read as a TUM trajectory"));
    for name in ["tum.txt", "euroc.csv"] {
        assert_eq!(said(name), "", "{name}");
    }
}

#[test]
fn flights_take_the_rate_that_is_asked_for() {
    let options = |resample| ReadOptions {
        resample,
        ..ReadOptions::default()
    };
    let (plain, slow, fast) = (
        read("tum.txt", &options(None)),
        read("tum.txt", &options(Some(5.0))),
        read("tum.txt", &options(Some(50.0))),
    );
    assert_eq!(
        (slow.flight.samples.len(), fast.flight.samples.len()),
        (20, 196)
    );
    for (index, sample) in slow.flight.samples.iter().enumerate() {
        let own = &plain.flight.samples[2 * index];
        assert!((0..3).all(|axis| (sample.position_m[axis] - own.position_m[axis]).abs() < 1e-5));
    }
    // The truth of the script, between its samples.
    for sample in &fast.flight.samples {
        let t = sample.time_s;
        let truth = [
            20.0 + 5.0 * (0.8 * t).cos(),
            -12.0 + 4.0 * (0.8 * t).sin(),
            9.0 + 0.25 * t,
        ];
        assert!((0..3).all(|axis| (sample.position_m[axis] - truth[axis]).abs() < 0.01));
    }
    // Fifty readings a second are many for a radar, and somebody says so.
    let text: String = (0..60)
        .map(|i| format!("{},{},1,9\n", 0.005 * f64::from(i), 0.01 * f64::from(i)))
        .collect();
    let dense = parse(
        format!("timestamp,tx,ty,tz\n{text}").as_bytes(),
        "dense",
        &options(None),
    )
    .unwrap();
    assert!(
        dense.notes.join("; ").contains("samples every 5 ms"),
        "{:?}",
        dense.notes
    );
    let too_many = parse(
        b"timestamp,tx,ty,tz\n0,1,1,9\n4,2,1,9\n1e7,3,1,9\n",
        "long",
        &options(Some(1000.0)),
    );
    assert!(too_many.unwrap_err().1.to_string().contains("more than"));
}

/// Logs that break off anywhere, and logs with any byte changed: a flight or an error.
#[test]
fn damaged_logs_never_panic() {
    for name in ["px4.ulg", "ardupilot.bin", "ardupilot_pos.bin"] {
        let bytes = std::fs::read(folder().join(name)).unwrap();
        let options = ReadOptions::default();
        for end in (0..bytes.len()).step_by(7) {
            let cut = parse(&bytes[..end], name, &options);
            assert!(end > 100 || cut.is_err(), "{name} {end}");
        }
        for at in 0..bytes.len() {
            for value in [0, 0xff, bytes[at] ^ 0x10] {
                let mut damaged = bytes.clone();
                damaged[at] = value;
                parse(&damaged, name, &options).ok();
            }
        }
    }
}

#[test]
fn a_wrong_file_is_named_with_the_remedy() {
    let options = ReadOptions::default();
    let said = |bytes: &[u8]| parse(bytes, "x", &options).unwrap_err().1.to_string();
    assert!(said(b"ULog\x01\x12\x35\x01\0\0\0\0\0\0\0\0").contains("vehicle_local_position"));
    assert!(said(&[0xA3, 0x95, 0x80, 0, 0]).contains("XKF1, NKF1 and POS"));
    assert!(
        said(b"time,lat,lon,alt\n0,91,8,1\n1,47,8,1\n2,47,8,1\n")
            .contains("`lat` = 91 is no latitude")
    );
    let of_nan = said(b"time,lat,lon,alt\n0,nan,8,1\n1,47,8,1\n2,47,8,1\n");
    assert!(of_nan.contains("`lat` = NaN is no latitude"), "{of_nan}");
    assert!(said(b"1.0 2 3 4\n2.0 2 3 4\n").contains("no header"));
    assert!(said(b"time,lat,lon\n0,47,8\n").contains("--columns"));
}
