use super::{FILE_BYTES_MAX, FlightFileCause, parse, read_flight_csv, write_flight_csv};
use crate::flights::flight::Flight;
use proptest::prelude::*;
use std::path::Path;

const GOOD: &str = "timestamp,tx,ty,tz\n0.0,1,2,3\n0.1,1.5,2,3\n0.2,2,2,3\n";

fn read(text: &[u8]) -> Result<Flight, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flight.csv");
    std::fs::write(&path, text).unwrap();
    read_flight_csv(&path).map_err(|error| {
        let folder = format!("{}/", folder.path().display());
        error.to_string().replace(&folder, "")
    })
}

fn rejected(text: impl AsRef<[u8]>) -> String {
    read(text.as_ref()).unwrap_err()
}

#[test]
fn a_plain_file_is_read() {
    let flight = read(GOOD.as_bytes()).unwrap();
    assert_eq!(flight.name, "flight.csv");
    assert_eq!(flight.source, "flight.csv");
    assert_eq!(flight.samples.len(), 3);
    assert_eq!(flight.samples[2].position_m, [2.0, 2.0, 3.0]);
    assert!((flight.samples[1].velocity_mps[0] - 5.0).abs() < 1e-12);
}

#[test]
fn other_spellings_of_the_same_flight_are_read_alike() {
    let want = read(GOOD.as_bytes()).unwrap();
    let spellings = [
        GOOD.replace('\n', "\r\n"),
        GOOD.replace(',', ", "),
        GOOD.replace(',', " ,\t"),
        format!("\u{feff}{GOOD}"),
        format!("# {GOOD}"),
        format!("{GOOD}\n\n  \n,,,\n"),
        GOOD.trim_end().to_owned(),
        GOOD.replace("timestamp,tx,ty,tz", "\"timestamp\",\"tx\",\"ty\",\"tz\""),
        GOOD.replace("tz\n", "tz,qx,note\n")
            .replace(",3\n", ",3,0.5,text\n"),
        // Rows longer and extra columns shorter than the header.
        GOOD.replace("tz\n", "tz,qx\n")
            .replace("1.5,2,3\n", "1.5,2,3,4,5,6\n"),
        "tz,ty,tx,timestamp\n3,2,1,0.0\n3,2,1.5,0.1\n3,2,2,0.2\n".to_owned(),
        "timestamp,tx,ty,tz\n0e0,+1,2.,3\n1E-1,15e-1,2,3\n.2,2,2,3\n".to_owned(),
    ];
    for spelling in spellings {
        assert_eq!(
            read(spelling.as_bytes()).as_ref(),
            Ok(&want),
            "{spelling:?}"
        );
    }
}

#[test]
fn epoch_time_becomes_zero_based() {
    let text = GOOD
        .replace("0.0,", "1700000000.0,")
        .replace("0.1,", "1700000000.1,")
        .replace("0.2,", "1700000000.2,");
    let flight = read(text.as_bytes()).unwrap();
    assert_eq!(flight.samples[0].time_s, 0.0);
    assert!((flight.samples[2].time_s - 0.2).abs() < 1e-6);
}

#[test]
fn irregular_times_and_long_holes_are_flights() {
    let flight = read(b"timestamp,tx,ty,tz\n0,0,0,5\n0.1,1,0,5\n60,2,0,5\n60.05,3,0,5\n").unwrap();
    assert!((flight.duration_s() - 60.05).abs() < 1e-12);
}

#[test]
fn faults_are_named_by_file_line_and_column() {
    let with = |from: &str, to: &str| rejected(GOOD.replace(from, to));
    assert_eq!(rejected(""), "flight.csv: the file is empty");
    assert_eq!(rejected("\n \n\r\n"), "flight.csv: the file is empty");
    assert_eq!(
        with("ty", "y"),
        "flight.csv:1: column `ty` is missing from the header"
    );
    assert_eq!(
        rejected("\n\n0.0,1,2,3\n"),
        "flight.csv:3: column `timestamp` is missing from the header"
    );
    assert_eq!(
        with("tz", "tz,tx"),
        "flight.csv:1: column `tx` appears twice in the header"
    );
    assert_eq!(with("1.5,2,3", "1.5,2"), "flight.csv:3: `tz` is missing");
    assert_eq!(with("1.5,2,3", "1.5,,3"), "flight.csv:3: `ty` is missing");
    assert_eq!(
        with("1.5", "fast"),
        "flight.csv:3: `tx` is not a number: \"fast\""
    );
    assert_eq!(
        with("1.5", "1;5"),
        "flight.csv:3: `tx` is not a number: \"1;5\""
    );
    assert_eq!(
        with("0.1,", "\"0.1,"),
        "flight.csv:3: `timestamp` is not a number: \"\\\"0.1\""
    );
    for text in ["NaN", "nan", "inf", "-infinity", "1e999"] {
        assert_eq!(with("1.5", text), "flight.csv:3: `tx` is not finite");
    }
    assert_eq!(
        with("2,2,3", "2,2,1e8"),
        "flight.csv:4: `tz` = 100000000 is beyond +-10000000"
    );
    assert_eq!(
        with("0.2,", "0.1,"),
        "flight.csv:4: time 0.1 s does not follow 0.1 s"
    );
    assert_eq!(
        with("0.2,", "-7,"),
        "flight.csv:4: time -7 s does not follow 0.1 s"
    );
    assert_eq!(
        rejected("timestamp,tx,ty,tz\n"),
        "flight.csv: 0 samples, at least 3 are needed"
    );
    assert_eq!(
        with("0.2,2,2,3\n", ""),
        "flight.csv: 2 samples, at least 3 are needed"
    );
    assert_eq!(
        rejected(GOOD.replace("0.1,", "100,").replace("0.2,", "200,")),
        "flight.csv: the median time step is 100 s: is `timestamp` in seconds?"
    );
    assert_eq!(
        with("0.2,", "1700000000000,"),
        "flight.csv:4: `timestamp` = 1700000000000 is beyond +-100000000000"
    );
    // A comment or a blank line before the fault does not shift its line number.
    assert_eq!(
        with("0.0,1,2,3\n", "\n\r\n0.0,1,x,3\n"),
        "flight.csv:4: `ty` is not a number: \"x\""
    );
}

#[test]
fn text_that_is_not_utf8_is_named() {
    let mut bytes = GOOD.as_bytes().to_vec();
    bytes.extend(b"0.3,\xff\xfe,2,3\n");
    assert_eq!(rejected(&bytes), "flight.csv:5: not UTF-8 text");
    assert_eq!(
        rejected(b"\x89PNG\r\n\x1a\n"),
        "flight.csv:1: not UTF-8 text"
    );
}

#[test]
fn a_long_wrong_field_is_quoted_in_part() {
    let message = rejected(GOOD.replace("1.5", &"x".repeat(100_000)));
    assert!(message.len() < 120, "{message}");
}

#[test]
fn what_is_not_a_file_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let missing = read_flight_csv(&folder.path().join("none.csv")).unwrap_err();
    assert!(matches!(missing.cause, FlightFileCause::Io(_)));
    assert!(
        missing.to_string().contains("none.csv: cannot read: "),
        "{missing}"
    );
    let not_a_file = read_flight_csv(folder.path()).unwrap_err();
    assert!(matches!(not_a_file.cause, FlightFileCause::NotAFile));
    let not_a_file = read_flight_csv(Path::new("/dev/zero")).unwrap_err();
    assert!(matches!(not_a_file.cause, FlightFileCause::NotAFile));

    // A sparse file: its length alone refuses it.
    let large = folder.path().join("large.csv");
    std::fs::File::create(&large)
        .and_then(|file| file.set_len(FILE_BYTES_MAX + 1))
        .unwrap();
    let too_large = read_flight_csv(&large).unwrap_err();
    assert!(matches!(too_large.cause, FlightFileCause::TooLarge { .. }));
}

proptest! {
    #[test]
    fn what_is_written_is_read_back(
        steps in prop::collection::vec(1e-3..1.0_f64, 2..40),
        places in prop::collection::vec(prop::array::uniform3(-1e6..1e6_f64), 41)
    ) {
        let mut time_s = 0.0;
        let mut rows = vec![[0.0, places[0][0], places[0][1], places[0][2]]];
        for (step, [x, y, z]) in steps.iter().zip(&places[1..]) {
            time_s += step;
            rows.push([time_s, *x, *y, *z]);
        }
        let flight = Flight::from_track("trip.csv", "trip.csv", &rows).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trip.csv");
        write_flight_csv(&path, &flight).unwrap();
        prop_assert_eq!(read_flight_csv(&path).unwrap(), flight);
    }

    #[test]
    fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let mut with_header = b"timestamp,tx,ty,tz\n".to_vec();
        with_header.extend(&bytes);
        // What parses is a valid flight; the rest is an error value.
        for input in [bytes, with_header] {
            if let Ok(flight) = parse(input.as_slice(), "f") {
                prop_assert!(flight.samples.len() >= 3);
            }
        }
    }

    #[test]
    fn no_damaged_file_panics(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<prop::sample::Index>()
    ) {
        let mut bytes = GOOD.as_bytes().to_vec();
        for (place, value) in edits {
            let i = place.index(bytes.len());
            bytes[i] = value;
        }
        bytes.truncate(cut.index(bytes.len()) + 1);
        if let Ok(flight) = parse(bytes.as_slice(), "f") {
            let times = flight.samples.windows(2).map(|w| w[1].time_s - w[0].time_s);
            prop_assert!(times.into_iter().all(|step| step > 0.0));
        }
    }
}
