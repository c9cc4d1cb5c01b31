//! Readings out, estimates in: what other programs do with this one.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Four seconds of each of the sample flights: what is measured in these tests.
fn subject() -> Vec<String> {
    let flights = project().join("docs/sample-flights");
    let arguments = [
        "--flights",
        &flights.display().to_string(),
        "--segment-s",
        "4",
    ];
    arguments.map(str::to_owned).to_vec()
}

fn host_sim(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_host-sim"))
        .args(arguments)
        .output()
        .expect("the program starts")
}

fn run(arguments: &[&str]) -> String {
    let output = host_sim(arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).unwrap()
}

fn with<'a>(command: &[&'a str], subject: &'a [String]) -> Vec<&'a str> {
    let subject = subject.iter().map(String::as_str);
    command.iter().copied().chain(subject).collect()
}

/// The rows of a CSV file by column.
fn rows(path: &Path) -> Vec<HashMap<String, String>> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let rows = reader.deserialize().collect::<Result<_, _>>();
    rows.unwrap()
}

fn readings(folder: &Path) -> PathBuf {
    let out = folder.join("readings");
    run(&with(
        &["readings", "--out", out.to_str().unwrap()],
        &subject(),
    ));
    out.join("readings.csv")
}

/// What `track` said of each row, with the keys that `score` needs.
fn estimates(folder: &Path, readings: &Path, wanted: impl Fn(usize) -> bool) -> PathBuf {
    let out = folder.join("track");
    let arguments = [
        "track",
        "--readings",
        readings.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
    ];
    let said = run(&arguments);
    assert!(said.contains("NIS per degree of freedom"), "{said}");
    let asked = rows(readings);
    let names = [
        "x_m", "y_m", "z_m", "xx_m2", "xy_m2", "xz_m2", "yy_m2", "yz_m2", "zz_m2",
    ];
    let keys = ["flight", "noise_table", "noise", "rate", "step"];
    let path = folder.join("estimates.csv");
    let mut writer = csv::Writer::from_path(&path).unwrap();
    writer.write_record(keys.iter().chain(&names)).unwrap();
    for (index, answer) in rows(&out.join("estimates.csv")).iter().enumerate() {
        if !wanted(index) {
            continue;
        }
        // Line 1 is the header.
        let about = &asked[answer["line"].parse::<usize>().unwrap() - 2];
        assert_eq!(answer["time_us"], about["time_us"]);
        let record = keys.iter().map(|key| &about[*key]);
        writer
            .write_record(record.chain(names.iter().map(|name| &answer[*name])))
            .unwrap();
    }
    writer.flush().unwrap();
    assert!(out.join("track.svg").exists());
    path
}

fn scored(folder: &Path, entry: &str, more: &[&str]) -> Value {
    let json = folder.join("scores.json");
    let subject = subject();
    let mut arguments = with(
        &["score", "--estimates", entry, "--methods", "recursive"],
        &subject,
    );
    arguments.extend(["--json", json.to_str().unwrap()]);
    arguments.extend(more);
    run(&arguments);
    serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap()
}

/// The firmware's tracker over files is the firmware's tracker: to the last digit of every metric.
#[test]
fn estimates_from_a_file_are_worth_what_the_same_filter_is_worth_inside() {
    let folder = tempfile::tempdir().unwrap();
    let readings = readings(folder.path());
    let estimates = estimates(folder.path(), &readings, |_| true);
    let entry = format!("outside={}", estimates.display());
    let scores = scored(folder.path(), &entry, &[]);
    let cells = scores["cells"].as_array().unwrap();
    assert_eq!(cells.len(), 18);
    for pair in cells.chunks(2) {
        let [inside, outside] = pair else {
            panic!("two methods")
        };
        assert_eq!(
            (&inside["method"], &outside["method"]),
            (&"recursive".into(), &"outside".into())
        );
        for metric in [
            "steps",
            "ed_mean_m",
            "nees_mean",
            "coverage90",
            "nll",
            "diverged",
        ] {
            assert_eq!(inside[metric], outside[metric], "{metric}");
        }
    }
}

/// Of a step that the file leaves out the estimate before it is what counts, as a divergence.
#[test]
fn steps_that_are_left_out_are_divergences() {
    let folder = tempfile::tempdir().unwrap();
    let readings = readings(folder.path());
    let rows = rows(&readings).len();
    let estimates = estimates(folder.path(), &readings, |index| index % 2 == 0);
    let entry = format!("half={}", estimates.display());
    let scores = scored(folder.path(), &entry, &[]);
    let cells = scores["cells"].as_array().unwrap();
    let half = cells.iter().filter(|cell| cell["method"] == "half");
    let diverged: u64 = half.map(|cell| cell["diverged"].as_u64().unwrap()).sum();
    assert!(
        (diverged as f64 / rows as f64 - 0.5).abs() < 0.02,
        "{diverged} of {rows}"
    );
}

/// What cannot be written is found out before the estimates are read.
#[test]
fn where_the_scores_go_is_tried_first() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "in the way").unwrap();
    let (file, subject) = (file.to_str().unwrap(), subject());
    let missing = "own=/nowhere/estimates.csv";
    for arguments in [
        with(
            &["score", "--estimates", missing, "--json", "/nowhere/x.json"],
            &subject,
        ),
        vec!["score", "--estimates", missing, "--quick", "--out", file],
    ] {
        let output = host_sim(&arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(!said.contains("estimates.csv"), "{said}");
        assert!(said.contains("x.json") || said.contains(file), "{said}");
    }
    // A single pass over flights goes to no folder, so none is made where it is run.
    let output = Command::new(env!("CARGO_BIN_EXE_host-sim"))
        .current_dir(folder.path())
        .args(with(&["score", "--estimates", missing], &subject))
        .output()
        .expect("the program starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("estimates.csv"), "{said}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn what_is_no_estimate_of_these_readings_is_refused_by_line_and_column() {
    let folder = tempfile::tempdir().unwrap();
    let readings = readings(folder.path());
    let first = &rows(&readings)[0];
    let flight = &first["flight"];
    let header = "flight,noise,rate,step,x_m,y_m,z_m,xx_m2,xy_m2,xz_m2,yy_m2,yz_m2,zz_m2";
    let good = format!("{flight},low,1.00,0,1,2,3,1,0,0,1,0,1");
    let cases = [
        (
            header.replace(",zz_m2", ""),
            good[..good.len() - 2].to_owned(),
            "`xx_m2`, but not `zz_m2`",
        ),
        (
            header.replace("step", "x_m"),
            good.clone(),
            ":1: the column `x_m` is there twice",
        ),
        (
            header.replace("rate,", ""),
            good.clone(),
            ":1: there is no column `rate`",
        ),
        (
            header.to_owned(),
            good.replace(",low", ",loud"),
            ":2: noise \"loud\"",
        ),
        (
            header.to_owned(),
            good.replace("1.00,0,", "1.00,40,"),
            ":2: step 40",
        ),
        (header.to_owned(), format!("x{good}"), ":2: flight"),
        (
            header.to_owned(),
            good.replace(",3,", ",NaN,"),
            ":2: `z_m` is \"NaN\", not a finite number",
        ),
        (
            header.to_owned(),
            good.replace(",3,1,", ",3,-1,"),
            ":2: the covariance is not positive definite",
        ),
        // It is, and its determinant is none.
        (
            header.to_owned(),
            good.replace(",3,1,0,0,1,0,1", ",3,1e-300,0,0,1e-300,0,1e-300"),
            ":2: the covariance is not positive definite",
        ),
        (
            header.to_owned(),
            good.replace(",3,1,0,0,1,0,1", ",3,1e300,0,0,1e300,0,1e300"),
            ":2: the covariance is so large that its determinant is no number",
        ),
        (
            header.to_owned(),
            good.replace(",3,", ",-1e8,"),
            ":2: a coordinate beyond +-10000000 m",
        ),
        (
            header.to_owned(),
            format!("{good}\n{good}"),
            ":3: a second estimate",
        ),
        (
            header.to_owned(),
            format!("{good},7"),
            ":2: 14 fields, where the header has 13",
        ),
        (
            header[..header.find(",xx").unwrap()].to_owned(),
            format!("{flight},low,1.00,0,1,2,3"),
            "no covariance",
        ),
    ];
    for (header, row, expected) in cases {
        let path = folder.path().join("bad.csv");
        std::fs::write(&path, format!("{header}\n{row}\n")).unwrap();
        let entry = format!("bad={}", path.display());
        let subject = subject();
        let output = host_sim(&with(&["score", "--estimates", &entry], &subject));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            !output.status.success() && said.contains(expected),
            "{expected}: {said}"
        );
        assert!(said.contains("bad.csv"), "{said}");
    }
}

/// Degrees, one sigma for all rows, an epoch, missing channels, gaps, a sensor elsewhere: the same bits as in this
/// program's own layout.
#[test]
fn plots_in_other_layouts_are_the_same_plots() {
    let folder = tempfile::tempdir().unwrap();
    let track = |name: &str, text: &str, more: &[&str]| {
        let path = folder.path().join(format!("{name}.csv"));
        std::fs::write(&path, text).unwrap();
        let out = folder.path().join(name);
        let paths = [path.to_str().unwrap(), out.to_str().unwrap()];
        let mut arguments = vec!["track", "--readings", paths[0], "--out", paths[1]];
        arguments.extend(more);
        run(&arguments);
        let rows = rows(&out.join("estimates.csv"));
        rows.into_iter()
            .map(|row| {
                (
                    row["x_m"].clone(),
                    row["zz_m2"].clone(),
                    row["mode"].clone(),
                )
            })
            .collect::<Vec<_>>()
    };
    let plain = track(
        "plain",
        "time_us,range_m,elevation_rad,azimuth_rad,range_rate_mps,sigma_range_m,sigma_elevation_rad,sigma_azimuth_rad,sigma_range_rate_mps,sensor_x_m,sensor_y_m,sensor_z_m\n\
         0,30,0.7853981633974483,0.5235987755982988,1,1,0.01,0.01,0.1,5,0,0\n\
         100000,,,,,,,,,,,\n\
         200000,30.5,,0.5235987755982988,,1,,0.01,,5,0,0\n",
        &[],
    );
    let other = track(
        "other",
        "# somebody's radar\nsensor_x_m, sensor_y_m, sensor_z_m, time_s, range_rate_mps, azimuth_deg, elevation_deg, range_m\n\
         5,0,0,1700000000.0,1,30,45,30\n\
         5,0,0,1700000000.1,,,,\n\
         5,0,0,1700000000.2,,30,,30.5\n",
        &[
            "--sigma-range-m",
            "1",
            "--sigma-angle-rad",
            "0.01",
            "--sigma-range-rate-mps",
            "0.1",
        ],
    );
    assert_eq!(plain, other);
    let modes: Vec<_> = plain.iter().map(|row| row.2.as_str()).collect();
    assert_eq!(modes, ["started", "coasting", "tracking"]);
}

/// What `track` says of a file, and its rows of estimates.
fn tracked(text: &[u8]) -> (Output, Vec<HashMap<String, String>>) {
    let folder = tempfile::tempdir().unwrap();
    let (path, out) = (folder.path().join("plots.csv"), folder.path().join("out"));
    std::fs::write(&path, text).unwrap();
    let paths = [path.to_str().unwrap(), out.to_str().unwrap()];
    let output = host_sim(&["track", "--readings", paths[0], "--out", paths[1]]);
    let estimates = out.join("estimates.csv");
    let rows = estimates.exists().then(|| rows(&estimates));
    (output, rows.unwrap_or_default())
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A hundred plots of a target, each with `more` of its number behind them.
fn hundred(header: &str, more: impl Fn(usize) -> String) -> String {
    let mut text = format!("time_s,range_m,sigma_range_m{header}\n");
    for i in 0..100 {
        text += &format!("{:.1},{},1{}\n", 0.1 * i as f64, 30 + i, more(i));
    }
    text
}

#[test]
fn a_forgotten_quote_swallows_no_plots() {
    let open = |at: usize, i: usize| if i == at { ",\"forgotten" } else { ",\"kept\"" };
    for text in [
        hundred(",note", |i| open(50, i).to_owned()),
        hundred(",note", |i| open(99, i).to_owned()) + "99,1,1,\"kept\"\n",
        hundred(",note", |i| {
            if i == 50 { ",\"forgotten" } else { ",kept" }.to_owned()
        }),
    ] {
        let (output, rows) = tracked(text.as_bytes());
        let said = errors(&output);
        assert!(!output.status.success() && rows.is_empty(), "{said}");
        let line = if text.contains("9.9,129,1,\"forgotten") {
            101
        } else {
            52
        };
        let expected = format!("plots.csv:{line}: a quote is opened here and not closed");
        assert!(said.contains(&expected), "{said}");
    }
}

#[test]
fn lines_are_counted_the_same_whatever_ends_them() {
    let header = "\ntime_s,range_m,elevation_rad,azimuth_rad,sigma_range_m,sigma_elevation_rad,sigma_azimuth_rad\n";
    let text = format!("{header}0,30,.3,0,1,.01,.01\n\n.1,30,.3,0,1,.01,.01\n");
    for text in [text.clone(), text.replace('\n', "\r\n")] {
        let (output, rows) = tracked(text.as_bytes());
        assert!(output.status.success(), "{}", errors(&output));
        let lines: Vec<_> = rows.iter().map(|row| row["line"].as_str()).collect();
        assert_eq!(lines, ["3", "5"]);
        let (output, _) = tracked(text.replace(".1,30", ".1,x").as_bytes());
        let said = errors(&output);
        assert!(said.contains("plots.csv:5: `range_m` is \"x\""), "{said}");
    }
}

/// Names that a comment or a trimmed field would be made of, in this program's own table.
#[test]
fn a_flight_of_any_name_is_read_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let flights = folder.path().join("flights");
    std::fs::create_dir(&flights).unwrap();
    let names = ["#1.csv", " b .csv", "c, \"d\".csv"];
    let sample = project().join("docs/sample-flights");
    let sample = std::fs::read_dir(sample).unwrap();
    let mut samples = sample.map(|entry| entry.unwrap().path());
    let sample = samples.find(|path| path.extension().is_some_and(|e| e == "csv"));
    for name in names {
        std::fs::copy(sample.as_ref().unwrap(), flights.join(name)).unwrap();
    }
    let path = |name: &str| folder.path().join(name).display().to_string();
    let subject = ["--flights", &path("flights")].map(str::to_owned);
    run(&with(&["readings", "--out", &path("r")], &subject));
    let readings = folder.path().join("r/readings.csv");
    let estimates = estimates(folder.path(), &readings, |_| true);
    let found = rows(&folder.path().join("track/estimates.csv"));
    assert_eq!(found.len(), rows(&readings).len());
    for name in names {
        let own = found.iter().filter(|row| row["flight"].starts_with(name));
        assert_eq!(own.count(), found.len() / 3, "{name:?}");
    }
    let entry = format!("outside={}", estimates.display());
    let methods = ["--methods", "ekf"];
    let score = with(&["score", "--estimates", &entry], &subject);
    let output = host_sim(&[score, methods.to_vec()].concat());
    let said = errors(&output);
    assert!(
        output.status.success() && !said.contains("divergences"),
        "{said}"
    );
}

#[test]
fn comments_stand_before_the_header_or_alone_in_their_line() {
    let plain = "Time_s, RANGE_M,elevation_rad,azimuth_rad,sigma_range_m,sigma_elevation_rad,sigma_azimuth_rad\n\
                 0, 30 ,.3,0,1,.01,.01\n";
    let (output, rows) = tracked(format!("# a radar, of mine\n{plain}# restarted\n").as_bytes());
    assert!(output.status.success(), "{}", errors(&output));
    assert_eq!((rows.len(), rows[0]["line"].as_str()), (1, "3"));
    assert_eq!(errors(&output), "");
    let (output, _) = tracked(format!("{plain}#.1,30,.3,0,1,.01\n").as_bytes());
    let said = errors(&output);
    assert!(
        said.contains(":3: 6 fields, where the header has 7"),
        "{said}"
    );
}

const WHOLE: &str = "time_s,range_m,elevation_rad,azimuth_rad,sigma_range_m,sigma_elevation_rad,sigma_azimuth_rad\n";

#[test]
fn azimuths_that_are_none_are_refused_and_degrees_are_suspected() {
    let plots = |elevation: f64, azimuth: f64| {
        let row = |i: usize| format!(".{i},30,{elevation},{azimuth},1,.01,.01\n");
        let text = WHOLE.to_owned() + &(0..5).map(row).collect::<String>();
        let (output, rows) = tracked(text.as_bytes());
        (output.status.success(), rows, errors(&output))
    };
    let (succeeded, rows, said) = plots(0.3, 1e17);
    assert!(!succeeded, "{said}");
    for row in &rows {
        let refused = "measurement: azimuth [rad] is not within -100 to 100";
        assert_eq!(row["refused"], refused);
    }
    let warning = "warning: most of `azimuth_rad` are more than a whole turn; degrees are read from `azimuth_deg`";
    assert!(said.contains(warning), "{said}");
    let (succeeded, rows, said) = plots(0.3, 50.0);
    assert!(succeeded && said.contains(warning), "{said}");
    assert_eq!(rows[4]["mode"], "tracking");
    let (_, _, said) = plots(45.0, 1.0);
    let of_elevation = warning.replace("azimuth", "elevation");
    assert!(
        said.contains(&of_elevation) && !said.contains(warning),
        "{said}"
    );
    assert_eq!(plots(0.3, 6.0).2, "");
}

#[test]
fn a_sigma_that_is_too_large_is_named_and_not_its_value() {
    let row = "0,30,.3,0,1,.01,.01\n.1,30,.3,0,1e300,.01,.01\n";
    let (_, rows) = tracked(format!("{WHOLE}{row}").as_bytes());
    let expected = "measurement: sigma of range [m] is not within 0.0001 to 100000";
    assert_eq!(rows[1]["refused"], expected);
}

#[test]
fn a_sigma_that_a_column_gives_already_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plots.csv");
    let (file, out) = (path.to_str().unwrap(), folder.path().join("o"));
    let refused = |text: String, option: &str| {
        std::fs::write(&path, text).unwrap();
        let arguments = ["track", "--readings", file, option, "500", "--out"];
        let output = host_sim(&[&arguments[..], &[out.to_str().unwrap()]].concat());
        let said = errors(&output);
        let expected = format!("{option} is for channels whose `sigma_...` is no column");
        assert_eq!(!output.status.success(), said.contains(&expected), "{said}");
        !output.status.success()
    };
    let whole = || format!("{WHOLE}0,30,.3,0,1,.01,.01\n");
    assert!(refused(whole(), "--sigma-range-m"));
    assert!(refused(whole(), "--sigma-angle-rad"));
    // Of a channel that is not there.
    assert!(refused(whole(), "--sigma-range-rate-mps"));
    assert!(!refused(
        whole().replace("sigma_range_m", "sigma"),
        "--sigma-range-m"
    ));

    let readings = readings(folder.path());
    let estimates = estimates(folder.path(), &readings, |_| true);
    let (entry, subject) = (format!("own={}", estimates.display()), subject());
    let score = ["score", "--estimates", &entry, "--sigma-m", "500"];
    let said = errors(&host_sim(&with(&score, &subject)));
    assert!(
        said.contains("--sigma-m is for estimates without a covariance"),
        "{said}"
    );
}

#[test]
fn plots_that_cannot_be_used_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plots.csv");
    let cases = [
        (
            "range_m,sigma_range_m\n1,1\n",
            ":1: there is no column `time_s`",
        ),
        ("time_s,x\n1,1\n", ":1: there is no column `range_m`"),
        (
            "time_s,range_m\n1,1\n",
            ":1: there is no column `sigma_range_m`; --sigma-range-m",
        ),
        (
            "time_s,range_m,sigma_range_m\n1,x,1\n",
            ":2: `range_m` is \"x\"",
        ),
        (
            "time_s,range_m,sigma_range_m\n1,1,1\n0,1,1\n",
            ":3: `time_s`",
        ),
        (
            "time_s,azimuth_rad,azimuth_deg\n1,1,1\n",
            "both `azimuth_rad` and `azimuth_deg`",
        ),
        (
            "time_s,range_m,sigma_range_m,sensor_x_m\n1,1,1,1\n",
            "`sensor_x_m`, but not `sensor_y_m`",
        ),
        ("time_s,range_m,sigma_range_m\n", "no rows"),
        ("", "the file is empty"),
        (
            "time;range;sigma_range_m\n0,0;1,5;1\n",
            ":1: there is no column `time_s` or `time_us`; the header has `time`, `range`, `sigma_range_m` between semicolons, not commas",
        ),
        (
            "range,when\n1,1\n",
            ":1: there is no column `time_s` or `time_us`; the header has `range`, `when` between commas",
        ),
        (
            "time_s,time_us,range_m,sigma_range_m\n0,0,1,1\n",
            "both `time_us` and `time_s`",
        ),
        (
            "time_s,range_m,sigma_range_m\n0,1,1\n1,1,1\n",
            "nothing was tracked: line 2: ",
        ),
        (
            "time_s,range_m,sigma_range_m,range_rate\n0,1,1,1\n",
            "columns that are not read: `range_rate`",
        ),
    ];
    for (text, expected) in cases {
        std::fs::write(&path, text).unwrap();
        let output = host_sim(&[
            "track",
            "--readings",
            path.to_str().unwrap(),
            "--out",
            folder.path().join("o").to_str().unwrap(),
        ]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            !output.status.success() && said.contains(expected),
            "{expected}: {said}"
        );
    }
    let utf_16: Vec<u8> = "\u{feff}time_s,range_m\n"
        .encode_utf16()
        .flat_map(u16::to_le_bytes)
        .collect();
    let said = errors(&tracked(&utf_16).0);
    assert!(
        said.contains(":1: UTF-16 text; save the file as UTF-8"),
        "{said}"
    );
    // What the tracker refuses is a row like any other, with the reason.
    std::fs::write(
        &path,
        "time_s,range_m,azimuth_rad,elevation_rad,sigma_range_m\n1,30,0,0.3,1\n1.1,-1e9,0,0.3,1\n",
    )
    .unwrap();
    let out = folder.path().join("o");
    let said = run(&[
        "track",
        "--readings",
        path.to_str().unwrap(),
        "--sigma-angle-rad",
        "0.01",
        "--out",
        out.to_str().unwrap(),
    ]);
    let rows = rows(&out.join("estimates.csv"));
    assert_eq!(rows[0]["mode"], "started");
    assert!(rows[1]["refused"].contains("range"), "{rows:?}");
    assert!(
        said.contains("first refused: line 3: measurement: range"),
        "{said}"
    );
}

/// FilterPy from a script of forty lines, outside the project.
#[test]
fn a_script_with_filterpy_is_ranked_beside_ours() {
    let folder = tempfile::tempdir().unwrap();
    let readings = readings(folder.path());
    let script = folder.path().join("filterpy_track.py");
    std::fs::copy(project().join("tests/exchange/filterpy_track.py"), &script).unwrap();
    let estimates = folder.path().join("estimates.csv");
    let output = Command::new(python())
        .args([&script, &readings, &estimates])
        .output()
        .expect("python starts");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let entry = format!("FilterPy={}", estimates.display());
    let scores = scored(folder.path(), &entry, &[]);
    for pair in scores["cells"].as_array().unwrap().chunks(2) {
        let metric = |cell: &Value, name: &str| cell[name].as_f64().unwrap();
        let (ours, theirs) = (metric(&pair[0], "ed_mean_m"), metric(&pair[1], "ed_mean_m"));
        assert_eq!(pair[1]["method"], "FilterPy");
        assert_eq!(pair[1]["diverged"], 0);
        assert!(ours < theirs && theirs < 40.0, "{ours} {theirs}");
    }
}

/// Python with what the script needs, made once under target/.
fn python() -> PathBuf {
    let venv = Path::new(env!("CARGO_TARGET_TMPDIR")).join("exchange-venv");
    let python = venv.join("bin/python");
    let has_all = || {
        let check = Command::new(&python)
            .args(["-c", "import numpy, scipy, filterpy"])
            .output();
        check.is_ok_and(|output| output.status.success())
    };
    if !has_all() {
        let done = |command: &mut Command| {
            let output = command.output().expect("python3 is there");
            assert!(
                output.status.success(),
                "{}",
                String::from_utf8_lossy(&output.stderr)
            );
        };
        done(
            Command::new("python3")
                .args(["-m", "venv", "--clear"])
                .arg(&venv),
        );
        // Without matplotlib, which FilterPy names but does not need here.
        done(Command::new(&python).args([
            "-m",
            "pip",
            "install",
            "--quiet",
            "numpy==2.4.6",
            "scipy==1.17.1",
        ]));
        done(Command::new(&python).args([
            "-m",
            "pip",
            "install",
            "--quiet",
            "--no-deps",
            "filterpy==2.0.0",
        ]));
    }
    python
}

/// The example, with its own filter in the table, the page and the intervals.
#[test]
fn a_filter_from_outside_is_in_every_table() {
    let folder = tempfile::tempdir().unwrap();
    let tests = std::env::current_exe().unwrap();
    let example = tests.parent().unwrap().join("../examples/own_filter");
    // Whoever runs all tests has built it; whoever runs this one alone has not.
    if !example.exists() {
        let build = [
            "build",
            "--quiet",
            "-p",
            "bnkf-host-sim",
            "--example",
            "own_filter",
        ];
        let built = Command::new(env!("CARGO")).args(build).status();
        assert!(built.expect("cargo starts").success());
    }
    let out = folder.path().join("out");
    let flights = project().join("docs/sample-flights");
    let output = Command::new(example)
        .args([
            "--folds",
            "2",
            "--methods",
            "recursive",
            "--noise-table",
            "radians",
            "--segment-s",
            "4",
        ])
        .args([
            "--flights",
            flights.to_str().unwrap(),
            "--out",
            out.to_str().unwrap(),
        ])
        .output()
        .expect("the example starts");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(String::from_utf8_lossy(&output.stdout).contains("last reading"));
    for file in [
        "cells.csv",
        "comparisons.csv",
        "forecasts.csv",
        "bins.csv",
        "report.html",
        "results.json",
    ] {
        let text = std::fs::read_to_string(out.join(file)).unwrap();
        assert!(text.contains("last reading"), "{file}");
    }
}
