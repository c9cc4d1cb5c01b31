use super::frame::Frame;
use super::options::{ColumnNames, ReadOptions};
use super::time_unit::TimeUnit;
use super::{FlightFile, FlightFileCause, parse, write_flight_csv};
use crate::flights::flight::Flight;
use crate::flights::flight_file::{FILE_BYTES_MAX, FlightFileError, read_flight};
use crate::regular_file::ReadFileCause;
use proptest::prelude::*;
use std::path::Path;

const GOOD: &str = "timestamp,tx,ty,tz\n0.0,1,2,3\n0.1,1.5,2,3\n0.2,2,2,3\n";

fn read_flight_csv(path: &Path) -> Result<Flight, FlightFileError> {
    read_flight(path, &ReadOptions::default()).map(|file| file.flight)
}

fn read(text: &[u8]) -> Result<Flight, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flight.csv");
    std::fs::write(&path, text).unwrap();
    read_flight_csv(&path).map_err(|error| {
        let folder = format!("{}/", folder.path().display());
        error.to_string().replace(&folder, "")
    })
}

fn read_as(text: &str, options: &ReadOptions) -> Result<FlightFile, String> {
    parse(text.as_bytes(), "f", options).map_err(|(line, cause)| format!("{line:?} {cause}"))
}

/// A flight and what was said about its file.
fn said(text: &str) -> (Flight, Vec<String>) {
    let file = read_as(text, &ReadOptions::default()).unwrap();
    (file.flight, file.notes)
}

/// Ten seconds of a circle at 2 m/s, [time, x, y, z], `step_s` apart.
fn circle(step_s: f64) -> Vec<[f64; 4]> {
    let row = |i: u32| {
        let time_s = step_s * f64::from(i);
        let turned = time_s / 5.0;
        [
            time_s,
            20.0 + 10.0 * turned.cos(),
            20.0 + 10.0 * turned.sin(),
            12.0,
        ]
    };
    (0..=(10.0 / step_s).round() as u32).map(row).collect()
}

/// Rows as text, with the time by `time` and six decimals of the rest.
fn text_of(header: &str, rows: &[[f64; 4]], time: impl Fn(f64) -> String) -> String {
    let line = |[t, x, y, z]: &[f64; 4]| format!("{},{x:.6},{y:.6},{z:.6}\n", time(*t));
    format!("{header}\n{}", rows.iter().map(line).collect::<String>())
}

/// Whether two flights are the same but for rounded texts.
fn alike(a: &Flight, b: &Flight) -> bool {
    let near = |a: f64, b: f64| (a - b).abs() < 1e-5;
    a.samples.len() == b.samples.len()
        && a.samples.iter().zip(&b.samples).all(|(a, b)| {
            near(a.time_s, b.time_s) && (0..3).all(|i| near(a.position_m[i], b.position_m[i]))
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
        // Other separators, letters and decimal signs; comments.
        GOOD.replace("timestamp,tx,ty,tz", "Timestamp,TX,Ty,tZ"),
        GOOD.replace(',', ";").replace('.', ","),
        GOOD.replace(',', ";"),
        GOOD.replace(',', "\t"),
        format!("# {}", GOOD.replace(',', "  ")),
        format!("# made by hand\n#\n{GOOD}# the end, \"really\"\n"),
        // RFC 4180: quotes around everything, and around a separator, a quote and a line break.
        quoted(GOOD),
        quoted(GOOD).replace("\",\"", "\";\"").replace('.', ","),
        GOOD.replace("timestamp", "note,timestamp")
            .replace("0.", "\"(1, 2), \"\"up\"\"\nand on\",0."),
    ];
    for spelling in spellings {
        assert_eq!(
            read(spelling.as_bytes()).as_ref(),
            Ok(&want),
            "{spelling:?}"
        );
    }
}

/// Every field of a file in quotes.
fn quoted(text: &str) -> String {
    let line = |line: &str| format!("\"{}\"\n", line.replace(',', "\",\""));
    text.lines().map(line).collect()
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
        "flight.csv:1: column `ty` is missing from the header, which has `timestamp`, `tx`, `y`, `tz` between commas; \
         --columns T,X,Y,Z names others"
    );
    assert_eq!(
        rejected("\n\n0.0,1,2,3\n"),
        "flight.csv:3: column `timestamp` is missing: the first line holds numbers and no header such as timestamp,tx,ty,tz"
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
        "flight.csv:3: a quote is opened here and not closed within 64 lines"
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
        rejected(GOOD.replace("0.1,", "1e10,").replace("0.2,", "2e10,")),
        "flight.csv: the median time step is 10000000000 s, more than 10 s: is `timestamp` in another unit? See --time-unit"
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
    assert!(matches!(
        missing.cause,
        FlightFileCause::Read(ReadFileCause::Io(_))
    ));
    assert!(
        missing.to_string().contains("none.csv: cannot read: "),
        "{missing}"
    );
    for path in [folder.path(), Path::new("/dev/zero")] {
        let cause = read_flight_csv(path).unwrap_err().cause;
        assert!(matches!(
            cause,
            FlightFileCause::Read(ReadFileCause::NotRegular(_))
        ));
    }

    // A sparse file: its length alone refuses it.
    let large = folder.path().join("large.csv");
    std::fs::File::create(&large)
        .and_then(|file| file.set_len(FILE_BYTES_MAX + 1))
        .unwrap();
    let too_large = read_flight_csv(&large).unwrap_err();
    assert!(matches!(
        too_large.cause,
        FlightFileCause::Read(ReadFileCause::TooLarge { .. })
    ));
}

#[test]
fn a_vector_in_quotes_is_one_column() {
    let rows = circle(0.1);
    let plain = text_of("timestamp,tx,ty,tz", &rows, |t| format!("{t:.1}"));
    let mut with_pose = String::new();
    for (i, line) in plain.lines().enumerate() {
        with_pose += &match i {
            0 => format!("pose,{line}\n"),
            _ => format!("\"({i}, 0.5, 100.0, 200.0, 300.0, 1.0)\",{line}\n"),
        };
    }
    assert_eq!(said(&with_pose), said(&plain));
    // Blanks before a quote, as people type them: the columns would shift.
    let typed = with_pose.replace("\"(", " \"(");
    let error = read_as(&typed, &ReadOptions::default()).unwrap_err();
    assert_eq!(
        error,
        "Some(2) blanks stand before a quote; RFC 4180 wants it to begin its field"
    );
}

#[test]
fn a_forgotten_quote_swallows_no_rows() {
    let text = text_of("timestamp,tx,ty,tz,note", &circle(0.1), |t| {
        format!("{t:.1}")
    });
    let opened = text
        .replace("0.500,", "0.5,")
        .replacen("\n0.5,", "\n\"0.5,", 1);
    let closed = opened.replacen("\n9.5,", "\n9.5\",", 1);
    for text in [opened, closed] {
        let error = read_as(&text, &ReadOptions::default()).unwrap_err();
        assert_eq!(
            error,
            "Some(7) a quote is opened here and not closed within 64 lines"
        );
    }
}

#[test]
fn units_of_time_are_recognised_and_said() {
    let rows = circle(0.01);
    let (want, notes) = said(&text_of("timestamp,tx,ty,tz", &rows, |t| format!("{t:.2}")));
    assert_eq!(notes, [""; 0]);
    // An epoch that an f64 of seconds would round to a quarter of a microsecond.
    let scaled = |unit: f64| {
        move |t: f64| {
            format!(
                "{}",
                1_700_000_000_u64 * unit as u64 + (t * unit).round() as u64
            )
        }
    };
    for (unit, name, suffix) in [
        (1e3, "milliseconds", "[ms]"),
        (1e6, "microseconds", "_us"),
        (1e9, "nanoseconds", "(ns)"),
    ] {
        let (flight, notes) = said(&text_of("timestamp,tx,ty,tz", &rows, scaled(unit)));
        assert!(alike(&flight, &want), "{name}");
        let expected = format!(
            "`timestamp` read as {name}, which gives plausible steps and speeds; --time-unit says otherwise"
        );
        assert_eq!(notes, [expected]);
        let (flight, notes) = said(&text_of(
            &format!("Time{suffix},tx,ty,tz"),
            &rows,
            scaled(unit),
        ));
        assert!(alike(&flight, &want), "{name}");
        assert_eq!(notes, [""; 0]);
    }
    let as_seconds = ReadOptions {
        time_unit: Some(TimeUnit::S),
        ..ReadOptions::default()
    };
    let text = text_of("timestamp,tx,ty,tz", &rows, scaled(1e3));
    let error = read_as(&text, &as_seconds).unwrap_err();
    assert!(
        error.contains("`timestamp` = 1700000000000 is beyond"),
        "{error}"
    );
    let text = text_of("time,tx,ty,tz", &circle(0.1), |t| {
        format!("{}", (1e3 * t).round())
    });
    let error = read_as(&text, &as_seconds).unwrap_err();
    assert!(error.contains("the median time step is 100 s"), "{error}");
}

#[test]
fn pyulog_files_are_read_and_what_was_assumed_is_said() {
    let rows = circle(0.1);
    let want = said(&text_of("timestamp,tx,ty,tz", &rows, |t| format!("{t:.1}"))).0;
    // As pyulog writes them: microseconds, north, east, down, and marks of what is known.
    let mut down = "timestamp,timestamp_sample,xy_valid,z_valid,x,y,z,vx\n".to_owned();
    let mut up = "timestamp,xy_valid,x,y,z\n".to_owned();
    for [t, x, y, z] in &rows {
        let us = (1e6 * t).round();
        down += &format!("{us},{us},1,1,{y:.6},{x:.6},{:.6},0.1\n", -z);
        up += &format!("{us},1,{x:.6},{y:.6},{z:.6}\n");
    }
    down += "10100000,10100000,0,1,nan,nan,-12,0.1\n";
    let (flight, notes) = said(&down);
    assert!(alike(&flight, &want));
    assert_eq!(notes.len(), 3, "{notes:?}");
    assert!(notes[0].starts_with("1 rows left out"), "{notes:?}");
    assert!(
        notes[1].starts_with("`timestamp` read as microseconds"),
        "{notes:?}"
    );
    assert!(
        notes[2].starts_with("`x`, `y`, `z` read as north, east, down"),
        "{notes:?}"
    );
    let (flight, notes) = said(&up);
    assert!(alike(&flight, &want));
    assert!(
        notes[1].starts_with("`x`, `y`, `z` read as east, north, up"),
        "{notes:?}"
    );
    assert!(
        notes[1].ends_with("--frame ned says otherwise"),
        "{notes:?}"
    );

    let as_down = ReadOptions {
        frame: Some(Frame::Ned),
        time_unit: Some(TimeUnit::Us),
        ..ReadOptions::default()
    };
    let file = read_as(&up, &as_down).unwrap();
    assert_eq!(file.notes, [""; 0]);
    assert!((file.flight.samples[0].position_m[2] + 12.0).abs() < 1e-9);
    // Names that say the frame need no assumption.
    let named = up
        .replace("x,y,z", "North [m],East [m],Down [m]")
        .replace("timestamp", "time_us");
    let (flight, notes) = said(&named);
    assert_eq!((&flight, notes), (&file.flight, vec![]));
    // In feet they are not read, rather than in metres.
    let spelt = |unit: &str| named.replace("[m]", unit);
    assert_eq!(said(&spelt("(meters)")).0, flight);
    let error = read_as(&spelt("(ft)"), &ReadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("is missing"), "{error}");
}

#[test]
fn columns_can_be_named() {
    let text = GOOD.replace("timestamp,tx,ty,tz", "stamp,a,b,C");
    let names = ["stamp", "A", "b", "c"].map(str::to_owned);
    let mut options = ReadOptions {
        columns: Some(ColumnNames(names)),
        frame: Some(Frame::Enu),
        ..ReadOptions::default()
    };
    let want = said(GOOD).0;
    assert_eq!(
        read_as(&text, &options).unwrap().flight.samples,
        want.samples
    );
    options.columns = Some(ColumnNames(["stamp", "a", "b", "d"].map(str::to_owned)));
    let error = read_as(&text, &options).unwrap_err();
    assert!(error.contains("column `d` is missing"), "{error}");
    let error = rejected(text);
    assert!(
        error.contains("column `timestamp` is missing")
            && error.contains("`stamp`, `a`, `b`, `C` between commas"),
        "{error}"
    );
    let wide = (0..40)
        .map(|i| format!("column{i}"))
        .collect::<Vec<_>>()
        .join(";");
    let error = rejected(wide);
    assert!(
        error.contains("`column11`, 28 more between semicolons"),
        "{error}"
    );
}

#[test]
fn times_closer_than_the_clock_counts_say_so() {
    let error = rejected(GOOD.replace("0.2,", "0.1000005,"));
    assert_eq!(
        error,
        "flight.csv:4: time 0.1000005 s is 0.50 us after 0.1 s, the sample before: closer than 1 us, which times are \
         counted in"
    );
}

#[test]
fn decimal_signs_are_not_guessed() {
    let semicolons = GOOD.replace(',', ";");
    let error = rejected(semicolons.replace("1.5;", "1,5;"));
    assert_eq!(
        error,
        "flight.csv:3: `tx` = \"1,5\": decimal commas and decimal points in one file"
    );
    let error = rejected(semicolons.replace("0.1;1.5;", "0.1;1.500,5;"));
    assert!(
        error.contains("decimal commas and decimal points"),
        "{error}"
    );
    // In a file of commas a quoted comma may as well stand between thousands.
    let error = rejected(GOOD.replace("1.5,", "\"1,500\","));
    assert_eq!(error, "flight.csv:3: `tx` is not a number: \"1,500\"");
    let (flight, notes) = said(&semicolons.replace('.', ","));
    assert_eq!(flight.samples[1].position_m[0], 1.5);
    assert_eq!(notes, ["commas within numbers read as decimal signs"]);
}

#[test]
fn hostile_bytes_are_named() {
    let utf16: Vec<u8> = [0xff, 0xfe]
        .into_iter()
        .chain(GOOD.encode_utf16().flat_map(u16::to_le_bytes))
        .collect();
    assert!(rejected(&utf16).contains("UTF-16 text"));
    assert_eq!(
        rejected(GOOD.replace("1.5", "1\0")),
        "flight.csv:3: `tx` is not a number: \"1\\0\""
    );
    assert_eq!(rejected("\u{feff}"), "flight.csv: the file is empty");
    assert_eq!(rejected("\u{feff}#\n#\n").lines().count(), 1);
    assert_eq!(
        rejected(GOOD.replace("0.1,1.5,2,3\n", "0.1,1.5,2,3\n0.1,1.5,2,3\n")),
        "flight.csv:4: time 0.1 s does not follow 0.1 s"
    );
    assert_eq!(
        rejected("timestamp,tx,ty,tz\n0,1,2,3\n"),
        "flight.csv: 1 samples, at least 3 are needed"
    );
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
            if let Ok(file) = parse(&input, "f", &ReadOptions::default()) {
                prop_assert!(file.flight.samples.len() >= 3);
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
        if let Ok(file) = parse(&bytes, "f", &ReadOptions::default()) {
            let times = file.flight.samples.windows(2).map(|w| w[1].time_s - w[0].time_s);
            prop_assert!(times.into_iter().all(|step| step > 0.0));
        }
    }
}
