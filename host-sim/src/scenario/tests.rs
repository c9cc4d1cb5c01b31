use std::path::Path;

use bnkf::measurement::Channel;
use bnkf_model_export::flights::volume::Volume;
use bnkf_model_export::radar::errors::Errors;
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::{
    COUNTER_UAS_ANGLES_DEG, NoiseLevel, NoiseSigmas, NoiseTable,
};
use bnkf_model_export::radar::reading::Reading;
use bnkf_model_export::radar::sensors::Sensors;
use bnkf_model_export::recursive::scenario::{
    COUNTER_UAS_MISSED, COUNTER_UAS_STRIDES, Scenario as Trained,
};

use super::kind::Kind;
use super::{BUILT_IN, FILE_BYTES_MAX, Scenario, WHOLE};
use crate::scenario::radar::{Lateness, Pattern, Radar};

#[test]
fn the_papers_scenario_is_the_papers() {
    let scenario = Scenario::find(Path::new("paper")).unwrap();
    assert_eq!(scenario.volume, Volume::PAPER);
    let radar = Radar::paper(NoiseTable::Radians);
    assert_eq!(scenario.radar.sigmas, radar.sigmas);
    assert_eq!(scenario.radar.rates, SamplingRate::ALL);
    assert_eq!(scenario.radar.conditions().len(), 18);
    for level in NoiseLevel::ALL {
        for table in [NoiseTable::Radians, NoiseTable::Printed] {
            assert_eq!(scenario.radar.sigmas(table, level), level.sigmas(table));
        }
    }
}

/// Variations change the radar as they say and nothing else.
#[test]
fn variations_are_the_papers_but_for_one_thing() {
    let paper = Scenario::find(Path::new("paper")).unwrap();
    for (name, _) in &BUILT_IN[WHOLE.len()..] {
        let varied = Scenario::find(Path::new(name)).unwrap();
        assert_eq!(varied.name, *name);
        assert_ne!(varied.sha256, paper.sha256);
        assert_eq!(varied.radar.tables, [NoiseTable::Radians]);
        let changes = [
            varied.radar.errors != Errors::Gaussian,
            varied.radar.missing.iter().any(|turn| !turn.is_empty()),
            varied.kind != paper.kind,
            varied.radar.late != paper.radar.late,
            !name.starts_with("range-doppler") && varied.radar.sensors != paper.radar.sensors,
            varied.speed_scale != paper.speed_scale,
        ];
        assert_eq!(
            changes.iter().filter(|changed| **changed).count(),
            1,
            "{name}"
        );
        let same = Scenario {
            name: paper.name.clone(),
            summary: paper.summary.clone(),
            sha256: paper.sha256.clone(),
            radar: paper.radar.clone(),
            kind: paper.kind,
            speed_scale: paper.speed_scale,
            ..varied
        };
        assert_eq!(same, paper);
    }
}

#[test]
fn variations_that_make_no_sense_are_named_with_their_line() {
    let text = "name = \"mine\"\nsummary = \"s\"\nlike = \"paper\"\n[radar]\n";
    let cases = [
        (
            "missing = [\"range\", \"range\"]",
            "`missing` has a value twice",
        ),
        ("missing = []", "`missing` is empty"),
        ("missing = [\"azimuth\"]", "without which no track starts"),
        ("missing = [\"doppler\"]", "unknown variant `doppler`"),
        ("errors = { kind = \"cauchy\" }", "unknown variant `cauchy`"),
        (
            "errors = { kind = \"student-t\", degrees = 2.0 }",
            "`degrees` = 2 is not between",
        ),
        (
            "errors = { kind = \"glint\", share = 1.5, factor = 2.0 }",
            "`share` = 1.5",
        ),
        (
            "errors = { kind = \"glint\", share = 0.5, factor = 0.0 }",
            "`factor` = 0",
        ),
        (
            "errors = { kind = \"bias\", part = 2.0, time_s = 2.0 }",
            "`part` = 2",
        ),
        (
            "errors = { kind = \"bias\", part = 0.2, time_s = nan }",
            "`time_s` = NaN",
        ),
        (
            "errors = { kind = \"ranged\", reference_m = 0.0 }",
            "`reference_m` = 0",
        ),
        ("rates = [1.0]", "unknown field `rates`"),
    ];
    for (line, message) in cases {
        let error = Scenario::parse(&format!("{text}{line}"), "mine.toml").unwrap_err();
        let error = error.to_string();
        assert!(error.starts_with("mine.toml:5: "), "{error}");
        assert!(error.contains(message), "{line}: {error}");
    }
    let unlike = text.replace("paper", "glint");
    let error = Scenario::parse(&unlike, "mine.toml")
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("mine.toml:3: `like` = \"glint\" is none of"),
        "{error}"
    );
    let number = text.replace("\"paper\"", "5");
    let error = Scenario::parse(&number, "mine.toml").unwrap_err();
    let error = error.to_string();
    assert!(
        error.starts_with("mine.toml:3: `like` is not a text"),
        "{error}"
    );
}

/// Only the flights differ, so that results compare.
#[test]
fn the_agile_scenario_has_the_papers_radar_and_volume() {
    let find = |name: &str| Scenario::find(Path::new(name)).unwrap();
    let (paper, agile) = (find("paper"), find("agile"));
    assert_eq!((paper.kind, agile.kind), (Kind::Cruise, Kind::Agile));
    assert_eq!(agile.volume, paper.volume);
    assert_eq!(agile.radar.tables, [NoiseTable::Radians]);
    let radar = Radar {
        tables: paper.radar.tables.clone(),
        ..agile.radar
    };
    assert_eq!(radar, paper.radar);
    assert_eq!(
        (agile.duration_s, agile.rate_hz),
        (paper.duration_s, paper.rate_hz)
    );
}

#[test]
fn late_readings_are_the_papers_later() {
    let (paper, late) = (
        Scenario::find(Path::new("paper")),
        Scenario::find(Path::new("late")),
    );
    let (paper, late) = (paper.unwrap(), late.unwrap());
    let (share, by_s) = (0.5, 0.3);
    assert_eq!(late.radar.late, Lateness { share, by_s });
    let flight = &late.flights(2, 1).unwrap()[0];
    let condition = late.radar.conditions()[0];
    let readings = late.radar.readings(flight, condition, 1);
    let mut count = 0;
    for (late, on_time) in readings
        .iter()
        .zip(paper.radar.readings(flight, condition, 1))
    {
        count += usize::from(late.is_some_and(|reading| reading.late_us == 300_000));
        assert_eq!(
            late.map(|reading| Reading {
                late_us: 0,
                ..reading
            }),
            on_time
        );
    }
    assert!((60..90).contains(&count), "{count}");
    assert_eq!(readings[0].unwrap().late_us, 0);
    let text = BUILT_IN[0].1.to_owned() + "\n[radar.late]\nshare = 0.5\nby_s = 0.6\n";
    let error = Scenario::parse(&text, "s.toml").unwrap_err().to_string();
    assert!(
        error.contains("`by_s` = 0.6 is not between 0 and 0.5"),
        "{error}"
    );
}

#[test]
fn radars_elsewhere_are_where_they_are_said_to_be() {
    let find = |name: &str| Scenario::find(Path::new(name)).unwrap().radar;
    let two = Sensors::ByTurns(vec![[-20.0, 0.0, 0.0], [20.0, 0.0, 0.0]]);
    let moving = Sensors::Circling {
        radius_m: 20.0,
        speed_mps: 15.0,
    };
    assert_eq!(find("two-radars").sensors, two);
    assert_eq!(find("moving-radar").sensors, moving);
    let beside = Sensors::ByTurns(vec![[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]]);
    for (name, sensors) in [("range-doppler", beside), ("range-doppler-apart", two)] {
        let by_turns = find(name);
        assert_eq!(by_turns.sensors, sensors);
        let angles = vec![Channel::Elevation, Channel::Azimuth];
        let distances = vec![Channel::Range, Channel::RangeRate];
        assert_eq!(by_turns.missing, [distances, angles]);
    }
}

#[test]
fn places_of_radars_have_bounds_that_are_named() {
    let site = "[[radar.site]]\neast_m = 1.0\nnorth_m = 2.0\nup_m = 3.0\n";
    let circle = "[radar.circle]\nradius_m = 20.0\nspeed_mps = 15.0\n";
    let (_, paper) = BUILT_IN[0];
    let cases = [
        (
            site.replace("1.0", "6e4"),
            "`east_m` = 60000 is not between",
        ),
        (site.replace("2.0", "nan"), "`north_m` = NaN is not between"),
        (site.replace("up_m", "down_m"), "unknown field `down_m`"),
        (site.repeat(11), "`site`: 11 of them, at most 10"),
        (
            format!("{site}missing = [\"azimuth\"]\n"),
            "without which no track starts",
        ),
        (
            format!("{site}{circle}"),
            "`site` and `circle` exclude each other",
        ),
        (
            circle.replace("20.0", "0.0"),
            "`radius_m` = 0 is not between",
        ),
        (
            circle.replace("15.0", "1e3"),
            "`speed_mps` = 1000 is not between",
        ),
    ];
    for (added, message) in cases {
        let error = Scenario::parse(&format!("{paper}\n{added}"), "s.toml").unwrap_err();
        let error = error.to_string();
        assert!(error.contains(message), "{added}: {error}");
    }
    let scenario = Scenario::parse(&format!("{paper}\n{}", site.repeat(10)), "s.toml").unwrap();
    assert_eq!(
        scenario.radar.sensors,
        Sensors::ByTurns(vec![[1.0, 2.0, 3.0]; 10])
    );
}

#[test]
fn the_surveillance_radar_sees_kilometres_and_misses_some() {
    let scenario = Scenario::find(Path::new("counter-uas")).unwrap();
    assert_eq!(scenario.radar.range_m_max, 3000.0);
    assert_eq!(scenario.radar.pattern, Pattern::Even);
    let high = scenario.radar.sigmas(NoiseTable::Printed, NoiseLevel::High);
    assert!((high.azimuth_rad - 0.7_f64.to_radians()).abs() < 1e-15);
    assert_eq!(high.range_m, 3.0);
}

/// The figures that the counter-UAS model was trained for are the scenario's.
#[test]
fn the_surveillance_radar_is_the_one_that_its_model_was_trained_for() {
    let scenario = Scenario::find(Path::new("counter-uas")).unwrap();
    let trained = Trained::CounterUas.held_out_flights();
    assert_eq!(scenario.volume, Volume::COUNTER_UAS);
    assert_eq!(scenario.volume, trained.volume);
    assert_eq!(scenario.speed_scale, trained.speed_scale);
    assert_eq!(scenario.size_scale, trained.size_scale);
    assert_eq!(scenario.rate_hz, trained.rate_hz);
    for (level, angle_deg) in NoiseLevel::ALL.into_iter().zip(COUNTER_UAS_ANGLES_DEG) {
        let sigmas = scenario.radar.sigmas(NoiseTable::Printed, level);
        assert_eq!(sigmas, NoiseSigmas::counter_uas(angle_deg));
    }
    let strides = scenario.radar.rates.iter().map(|rate| 1.0 / rate.get());
    let trained = COUNTER_UAS_STRIDES.map(|stride| stride as f64);
    assert!(strides.eq(trained));
    let missed = 1.0 - scenario.radar.detection_probability;
    assert!((missed - COUNTER_UAS_MISSED).abs() < 1e-12);
}

/// Every built-in file with one line changed, and what the error must say.
#[test]
fn typos_are_named_with_file_and_line() {
    let (_, text) = BUILT_IN[0];
    let cases = [
        (
            "rate_hz = 10.0",
            "rate_herz = 10.0",
            "unknown field `rate_herz`",
        ),
        (
            "rate_hz = 10.0",
            "rate_hz = -1.0",
            "`rate_hz` = -1 is not between",
        ),
        (
            "rate_hz = 10.0",
            "rate_hz = \"ten\"",
            "invalid type: string",
        ),
        ("count = 100", "count = 1", "`count` = 1 is not between"),
        (
            "range_m_max = 46.9",
            "range_m_max = 4.69",
            "`range_m_min` is not below `range_m_max`",
        ),
        (
            "rates = [1.0, 0.75, 0.5]",
            "rates = [1.0, 1.75]",
            "`rates` = 1.75 is not between 0.001 and 1",
        ),
        ("rates = [1.0, 0.75, 0.5]", "rates = []", "`rates` is empty"),
        (
            "pattern = \"blocks\"",
            "pattern = \"block\"",
            "unknown variant `block`",
        ),
        (
            "detection_probability = 1.0",
            "detection_probability = 1.5",
            "`detection_probability` = 1.5",
        ),
        (
            "elevation = 0.01\n",
            "elevation = nan\n",
            "`elevation` = NaN",
        ),
        (
            "count = 100 ",
            "kind = \"lazy\"\ncount = 100 ",
            "unknown variant `lazy`",
        ),
        ("[volume]", "[volume", ""),
    ];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    for (from, to, message) in cases {
        let line =
            text[..text.find(from).unwrap()].lines().count() + usize::from(!text.starts_with(from));
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let error = Scenario::find(&path).unwrap_err().to_string();
        assert!(error.contains(message), "{to}: {error}");
        assert!(!error.contains('\n'), "{error}");
        // Of two keys that contradict each other either may be named; a table that ends too
        // early is noticed a line later.
        let named = [line - 1, line, line + 1]
            .iter()
            .any(|line| error.starts_with(&format!("{}:{line}: ", path.display())));
        assert!(named, "{to}: line {line}, {error}");
    }
    std::fs::write(&path, text.replacen("rate_hz = 10.0\n", "", 1)).unwrap();
    let error = Scenario::find(&path).unwrap_err().to_string();
    assert!(error.contains("missing field `rate_hz`"), "{error}");
}

/// Numbers that are legal TOML and no scenario, and the field and range that are named.
#[test]
fn every_field_has_bounds_that_are_named() {
    let (_, text) = BUILT_IN[0];
    let ones = format!("rates = [{}]", vec!["1.0"; 10_000].join(", "));
    let many = (1..=11).map(|i| format!("0.{i:02}")).collect::<Vec<_>>();
    let many = format!("rates = [{}]", many.join(", "));
    let long = format!("name = \"{}\"", "x".repeat(61));
    let cases = [
        (
            "range_m_min = 18.7",
            "range_m_min = 0.0",
            "`range_m_min` = 0 is not between 0.1 and 50000",
        ),
        (
            "range_m_max = 46.9",
            "range_m_max = 1e300",
            "is not between 0.1 and 50000",
        ),
        (
            "range_m_max = 46.9",
            "range_m_max = inf",
            "`range_m_max` = inf is not between 0.1 and 50000",
        ),
        (
            "range_m_mean = 40.0",
            "range_m_mean = -1e9",
            "is not between 0.1 and 50000",
        ),
        (
            "range_m_sd = 14.0",
            "range_m_sd = nan",
            "`range_m_sd` = NaN is not between 0.1 and 50000",
        ),
        (
            "height_m_min = 4.85",
            "height_m_min = -1e6",
            "is not between -50000 and 50000",
        ),
        (
            "height_m_max = 24.7",
            "height_m_max = 1e6",
            "is not between -50000 and 50000",
        ),
        (
            "count = 100 ",
            "count = 1e9 ",
            "`count` = 1000000000 is not between 2 and 100000",
        ),
        (
            "count = 100 ",
            "count = 99.5 ",
            "`count` = 99.5 is not a whole number",
        ),
        (
            "quick_count = 30",
            "quick_count = 0",
            "`quick_count` = 0 is not between",
        ),
        (
            "duration_s = 15.0",
            "duration_s = 1e5",
            "`duration_s` = 100000 is not between 1 and 3600",
        ),
        (
            "duration_s = 15.0",
            "duration_s = 1.0",
            "`duration_s` x `rate_hz`",
        ),
        (
            "rate_hz = 10.0",
            "rate_hz = 1e4",
            "`rate_hz` = 10000 is not between 0.1 and 1000",
        ),
        (
            "speed_scale = 1.0",
            "speed_scale = 0.0",
            "`speed_scale` = 0 is not between 0.01 and 100",
        ),
        (
            "size_scale = 1.0",
            "size_scale = 1e4",
            "`size_scale` = 10000 is not between 0.01 and 1000",
        ),
        (
            "rates = [1.0, 0.75, 0.5]",
            "rates = [1e4]",
            "`rates` = 10000 is not between 0.001 and 1",
        ),
        (
            "rates = [1.0, 0.75, 0.5]",
            "rates = [1e-4]",
            "`rates` = 0.0001 is not between 0.001 and 1",
        ),
        (
            "rates = [1.0, 0.75, 0.5]",
            "rates = [1.0, 1]",
            "`rates` has a value twice",
        ),
        (
            "rates = [1.0, 0.75, 0.5]",
            &ones,
            "`rates` has 11 values, at most 10",
        ),
        (
            "rates = [1.0, 0.75, 0.5]",
            &many,
            "`rates` has 11 values, at most 10",
        ),
        (
            "[\"radians\", \"printed\"]",
            "[\"printed\", \"printed\"]",
            "`noise_tables` has a value twice",
        ),
        (
            "name = \"paper\"",
            "name = \"\"",
            "`name` has 0 characters, not 1 to 60",
        ),
        (
            "name = \"paper\"",
            &long,
            "`name` has 61 characters, not 1 to 60",
        ),
        (
            "name = \"paper\"",
            "name = \"a\\nb\"",
            "`name` has a line break",
        ),
    ];
    for (from, to, message) in cases {
        assert!(text.contains(from), "{from}");
        let mut changed = text.replacen(from, to, 1);
        if message.starts_with("`duration_s` x") {
            changed = changed.replacen("rate_hz = 10.0", "rate_hz = 0.1", 1);
        }
        let error = Scenario::parse(&changed, "s.toml").unwrap_err().to_string();
        assert!(
            error.contains(message) && !error.contains('\n'),
            "{to}: {error}"
        );
        assert!(error.len() < 300, "{error}");
    }
}

/// Each field within its bounds, and all together months of work.
#[test]
fn all_flights_together_have_a_bound() {
    let (_, text) = BUILT_IN[0];
    let changed = text
        .replacen("count = 100 ", "count = 100000 ", 1)
        .replacen("duration_s = 15.0", "duration_s = 3600.0", 1);
    let error = Scenario::parse(&changed, "s.toml").unwrap_err().to_string();
    assert_eq!(
        error,
        "s.toml:9: `count` x `duration_s` x `rate_hz` = 3600000000 is not between 0 and 5000000"
    );
}

#[test]
fn what_is_no_scenario_file_is_refused_unread() {
    let error = Scenario::find(Path::new("/dev/zero")).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!(
            "/dev/zero: a character device, not a regular file (built in: {})",
            BUILT_IN.map(|(known, _)| known).join(", ")
        )
    );
    let file = tempfile::NamedTempFile::new().unwrap();
    file.as_file().set_len(FILE_BYTES_MAX + 1).unwrap();
    let error = Scenario::find(file.path()).unwrap_err().to_string();
    assert!(error.contains("more than the 65536 bytes"), "{error}");
}

#[test]
fn an_unknown_name_lists_the_built_in_ones() {
    let error = Scenario::find(Path::new("papper")).unwrap_err().to_string();
    assert!(
        error.contains("papper") && error.contains("paper, counter-uas"),
        "{error}"
    );
}
