//! `signal-gateway decide` as a user sees it: JSON, pictures, exit codes; text and refusals are cases in
//! `tests/cases/decide`.
//!
//! The road is the line of the worked cases (docs/spec/turn-signal-decider.md, "Labels of test cases"):
//! a left turn from 100 to 116 m, straight so that the whole of it is required.

use std::fs;

use serde_json::Value;

use crate::support::program::{Ran, run};
use crate::support::sources::project;
use crate::support::two_lanes;

const TURN: &str = "map = \"map.osm\"
until_m = 130
[route]
segments = [[1, 11], [2], [3]]
[drive]
speed = [{ at_m = 0, mps = 10 }]
";
const EXPECTED: &str = "[[expect]]
from_m = 37
to_m = 116
command = \"LEFT\"
winner = \"intersection\"
tolerance_m = 0
";

/// A folder with a map and one scenario.
struct Bench {
    folder: tempfile::TempDir,
    name: &'static str,
}

impl Bench {
    fn new(name: &'static str, text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("map.osm"), two_lanes::osm([0, 100, 116, 216])).unwrap();
        fs::write(folder.path().join(name), text).unwrap();
        Self { folder, name }
    }

    fn run(&self, args: &[&str]) -> Ran {
        run(&self.folder, &[&["decide", self.name], args].concat())
    }

    /// Standard output and exit code, without a word on standard error.
    fn out(&self, args: &[&str]) -> (String, i32) {
        let Ran { code, out, error } = self.run(args);
        assert_eq!(error, "");
        (out, code)
    }
}

/// The drive of `crossing_left`, whose lanelets are found on its map.
#[test]
fn a_way_between_two_lanelets_needs_no_scenario() {
    let map = concat!(env!("CARGO_MANIFEST_DIR"), "/config/maps/crossing/lanelet2_map.osm");
    let decide = |args: &[&str]| run(project(), &[&["decide", "--map", map], args].concat());
    let Ran { code, out, error } = decide(&["--from", "101", "--to", "402", "--speed", "8"]);
    assert_eq!((code, error.as_str()), (0, ""), "{out}");
    let lines: Vec<_> = out.lines().map(str::trim).collect();
    assert!(lines[1].starts_with("DISABLE at 0 m") && lines[2].starts_with("LEFT at "), "{out}");
    assert!(lines[2].ends_with("of the left turn on 111") && lines[3].ends_with("on 111 is over"), "{out}");
    for (args, code, expected) in [
        (&["--from", "402", "--to", "101"][..], 3, "no way leads from lanelet 402 to lanelet 101"),
        (&["--from", "101", "--to", "7"], 3, "it has no lanelet 7"),
        (&["--from", "101", "--to", "402", "--speed", "-1"], 2, "give a speed in m/s from 0 to 100"),
        (&["--from", "101"], 2, "--to"),
        (&["turn.toml", "--from", "101", "--to", "402"], 2, "cannot be used with"),
    ] {
        decide(args).assert(code, expected);
    }
}

/// A copy of a shipped map, `map.osm`, whose text is changed.
fn copied_map(name: &str, change: impl Fn(&str) -> String) -> tempfile::TempDir {
    let folder = format!("{}/config/maps/{name}", env!("CARGO_MANIFEST_DIR"));
    let bench = tempfile::tempdir().unwrap();
    let projector = "map_projector_info.yaml";
    fs::copy(format!("{folder}/{projector}"), bench.path().join(projector)).unwrap();
    let map = fs::read_to_string(format!("{folder}/lanelet2_map.osm")).unwrap();
    fs::write(bench.path().join("map.osm"), change(&map)).unwrap();
    bench
}

fn survey(bench: &tempfile::TempDir, args: &[&str]) -> Ran {
    run(bench, &[&["decide", "--map", "map.osm"], args].concat())
}

/// On a map as it is, with the two tags of a crossing exchanged, and without tags.
#[test]
fn turns_that_were_made_wrong_on_purpose_are_found_and_are_the_map_s() {
    let crossing = |change: fn(&str) -> String| copied_map("crossing", change);
    let plain = crossing(str::to_owned);
    let Ran { code, out, .. } = survey(&plain, &["--all-routes", "60"]);
    assert!(code == 0 && out.ends_with(" 0 missed, 0 short, 0 opposite, 0 flickering\n"), "{out}");
    assert!(out.starts_with("improved: 60 routes, ") && !out.contains(", 0 turns"), "{out}");

    let exchanged = crossing(|map| {
        let [left, right] = ["left", "right"].map(|side| [format!("v='{side}'"), format!("v=\"{side}\"")]);
        let exchange = |text: String, index: usize| {
            text.replace(&left[index], "THE OTHER")
                .replace(&right[index], &left[index])
                .replace("THE OTHER", &right[index])
        };
        exchange(exchange(map.to_owned(), 0), 1)
    });
    let Ran { code, out, .. } = survey(&exchanged, &["--all-routes", "60"]);
    let last = out.lines().last().unwrap();
    assert!(code == 5 && out.contains("has the signal to the other side; by the map: tagged "), "{out}");
    assert!(last.contains(" 0 missed, 0 short, 0 opposite, 0 flickering; by the map: "), "{last}");
    assert!(last.ends_with(" opposite"), "{last}");

    let untagged = crossing(|map| map.replace("turn_direction", "turn_direction_of_nobody"));
    let Ran { code, out, .. } = survey(&untagged, &["--all-routes", "60", "--json"]);
    assert_eq!(code, 5);
    let lines: Vec<Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let (row, wrong) = lines.split_last().unwrap();
    assert!(wrong.iter().all(|turn| turn["fault"] == "missed" && turn["map_flaw"].is_string()), "{out}");
    assert_eq!((&row["by_decider"]["missed"], &row["by_map"]["missed"]), (&0.into(), &wrong.len().into()));
    assert_eq!((&row["routes"], &row["compat"]), (&60.into(), &"improved".into()));
}

/// Of a path that reaches hardly ahead, a turn is found late.
#[test]
fn a_sweep_shows_what_a_parameter_does() {
    let plain = copied_map("crossing", str::to_owned);
    let args = ["--all-routes", "30", "--sweep", "forward_path_length=1..41:20"];
    let Ran { code, out, .. } = survey(&plain, &args);
    let rows: Vec<Vec<&str>> = out.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(rows[0], ["improved,", "forward_path_length"]);
    assert_eq!(
        rows[1],
        ["value", "routes", "turns", "missed", "short", "opposite", "flickering", "by", "the", "map"]
    );
    let values: Vec<&str> = rows[2..].iter().map(|row| row[0]).collect();
    assert_eq!(values, ["1", "21", "41"]);
    let short = |row: usize| rows[row][4].parse::<usize>().unwrap();
    assert!(code == 5 && short(2) > 0 && (short(3), short(4)) == (0, 0), "{out}");
    let Ran { out, .. } = survey(&plain, &[&args[..], &["--json"]].concat());
    let lines: Vec<Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(
        (lines.len(), &lines[0]["sweep"], &lines[0]["value"]),
        (3, &"forward_path_length".into(), &"1".into())
    );
    assert_eq!(lines[0]["by_decider"]["short"], short(2));

    let Ran { code, out, .. } = survey(&plain, &["--all-routes", "20", "--sweep", "country"]);
    let codes: Vec<&str> = out.lines().skip(2).filter_map(|line| line.split_whitespace().next()).collect();
    assert!(code == 0 && codes.contains(&"JP") && codes.contains(&"US-CA"), "{out}");
}

#[test]
fn loops_are_the_routes_that_meet_themselves() {
    let around = copied_map("helix", str::to_owned);
    let Ran { code, out, .. } = survey(&around, &["--all-routes", "20", "--loops"]);
    assert!(code == 0 && !out.contains(" 0 routes"), "{out}");
    let straight = copied_map("lane_change_road", str::to_owned);
    let Ran { code, out, .. } = survey(&straight, &["--all-routes", "20", "--loops"]);
    assert!(code == 0 && out.starts_with("improved: 0 routes, 0 turns"), "{out}");
}

#[test]
fn a_sweep_that_cannot_be_made_is_refused_with_a_remedy() {
    let plain = copied_map("crossing", str::to_owned);
    for (sweep, expected) in [
        ("turn_signal_serch_time=1..2", "did you mean turn_signal_search_time?"),
        ("turn_signal_on_swerving=1..2", "takes no numbers; give a parameter with numbers"),
        ("turn_signal_search_time=5..1", "is not a range that ascends; give FROM..TO"),
        ("turn_signal_search_time=-4..4", "cannot be -4; give seconds, 0 to 3600"),
    ] {
        let Ran { code, out, error } = survey(&plain, &["--all-routes", "9", "--sweep", sweep]);
        assert!(code == 2 && out.is_empty(), "{sweep}: {code:?} {out}");
        assert!(error.contains("--sweep") && error.contains(expected), "{sweep}: {error}");
    }
    let Ran { code, .. } = survey(&plain, &["--from", "101", "--to", "402", "--sweep", "country"]);
    assert_eq!(code, 2, "a sweep is of all routes");
}

#[test]
fn json_holds_every_cycle_with_its_reasons() {
    let bench = Bench::new("turn.toml", &format!("{TURN}{EXPECTED}"));
    let lines = |args: &[&str]| -> Vec<Value> {
        let (text, code) = bench.out(&[args, &["--json", "--compat", "upstream"]].concat());
        assert_eq!(code, 0);
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    let changes = lines(&[]);
    assert_eq!(changes.len(), 4, "{changes:?}");
    let at = &changes[1];
    assert_eq!(
        (&at["turn"], &at["hazard"], &at["winner"]),
        (&"LEFT".into(), &"DISABLE".into(), &"intersection".into())
    );
    assert_eq!((&at["compat"], at["at_m"].as_f64().map(f64::round)), (&"upstream".into(), Some(37.0)));
    let turn = &at["candidates"][0];
    assert_eq!((&turn["source"], &turn["why"]), (&"intersection".into(), &"won".into()));
    assert!((turn["distances"]["required_start_m"].as_f64().unwrap() - 59.21).abs() < 1e-6);
    assert_eq!((&at["basis"], &at["candidates"][1]["distances"]), (&"candidates".into(), &Value::Null));
    assert_eq!(changes[3]["expectations"]["met"], 1);
    // 0 to 130 m, a metre a cycle, and the summary.
    assert_eq!(lines(&["--every", "step"]).len(), 132);
}

/// The front is 24 m before a shift at 50 m from x = 22.21 on: the first sample of 0.8 m is 22.4.
#[test]
fn an_avoidance_moves_the_vehicle_and_is_signalled() {
    let more = "[[manoeuvre]]
kind = \"avoidance\"
lines = [{ from_m = 50, to_m = 80, offset_m = 1.5 }]
[[expect]]
from_m = 0
to_m = 21.6
command = \"DISABLE\"
tolerance_m = 0
[[expect]]
from_m = 22.4
to_m = 70
command = \"LEFT\"
winner = \"manoeuvre\"
tolerance_m = 0
";
    let text = TURN.replace("mps = 10", "mps = 8").replace("until_m = 130", "until_m = 90") + more;
    let bench = Bench::new("avoid.toml", &text);
    let (out, code) = bench.out(&["--compat", "upstream"]);
    assert_eq!(code, 0, "{out}");
    let (json, _) = bench.out(&["--json", "--every", "step", "--compat", "upstream"]);
    let ys: Vec<f64> = json
        .lines()
        .filter_map(|line| serde_json::from_str::<Value>(line).unwrap()["y_m"].as_f64())
        .collect();
    assert_eq!((ys.first(), ys.last()), (Some(&0.0), Some(&1.5)));
}

#[test]
fn disturbances_are_findings_and_never_signalled() {
    let disturbance = |kind: &str, at_m: u32, more: &str| {
        format!("[[disturbance]]\nkind = \"{kind}\"\nat_m = {at_m}\n{more}\n")
    };
    let expect = |from_m: u32, to_m: u32, command: &str, finding: &str| {
        format!(
            "[[expect]]\nfrom_m = {from_m}\nto_m = {to_m}\ncommand = \"{command}\"\nfinding = \"{finding}\"\n\
             tolerance_m = 0\n"
        )
    };
    let text = [
        TURN.to_owned(),
        disturbance("odometry_gap", 40, "for_s = 1"),
        disturbance("nan_pose", 60, "for_s = 0.5"),
        disturbance("not_lane_driving", 70, "for_s = 0.5"),
        disturbance("empty_path", 80, "for_s = 0.5"),
        disturbance("time_jump", 95, "by_s = -5"),
        // Up to 500 ms old is accepted, and the last one came at 39 m.
        expect(45, 49, "NO_COMMAND", "odometry is"),
        expect(60, 64, "NO_COMMAND", "odometry is not a number"),
        expect(70, 74, "NO_COMMAND", "not lane driving"),
        expect(80, 84, "NO_COMMAND", "planned path is empty"),
        expect(95, 96, "LEFT", "clock went back by 4900 ms"),
    ]
    .concat();
    let (out, code) = Bench::new("disturbances.toml", &text).out(&["--compat", "upstream"]);
    assert_eq!(code, 0, "{out}");
}

#[test]
fn a_picture_shows_sections_and_signals_of_each_compat() {
    let bench = Bench::new("turn.toml", &format!("name = \"I1 <left>\"\n{TURN}{EXPECTED}"));
    let picture = || {
        bench.out(&["--picture", "turn.svg"]);
        fs::read_to_string(bench.folder.path().join("turn.svg")).unwrap()
    };
    let svg = picture();
    let titles = [
        "I1 &lt;left&gt;",
        "100.00 m to 116.00 m: required section, LEFT",
        "37.00 m to 116.00 m: desired section, LEFT",
        "37.00 m to 117.00 m: signal: LEFT",
        "117.00 m to 130.00 m: signal: DISABLE",
        "37.00 m to 116.00 m: expected: LEFT",
        ">distance<",
        // The changeovers with their reasons, the speed, and the lanes from above.
        "37 m: improved, upstream: LEFT at 37 m: ",
        "m: 36.0 km/h",
        "class=\"plan\"",
    ];
    for title in titles {
        assert!(svg.contains(title), "{title}\n{svg}");
    }
    assert_eq!(svg.matches("class=\"lane\"").count(), 3, "route, improved, upstream");
    roxmltree::Document::parse(&svg).unwrap();
    assert_eq!(svg, picture(), "the same bytes each time");
}

/// Backing up covers the same metres as driving out: it must not be painted over.
#[test]
fn a_picture_shows_the_signals_while_backing_up() {
    let more = "[[manoeuvre]]
kind = \"pull_out\"
from_m = 20
to_m = 50
offset_m = 1.0
backwards_until_s = 3
[[manoeuvre]]
kind = \"avoidance\"
lines = [{ from_m = 110, to_m = 120, offset_m = 1 }]
";
    let text = TURN
        .replace("{ at_m = 0, mps = 10 }", "{ at_s = 0, mps = -1 }, { at_s = 3, mps = 4 }")
        .replace("until_m = 130", "start_m = 23\nuntil_m = 60");
    let bench = Bench::new("back.toml", &(text + more));
    bench.out(&["--picture", "back.svg", "--compat", "improved"]);
    let svg = fs::read_to_string(bench.folder.path().join("back.svg")).unwrap();
    for part in [">backing<", "20.00 m to 23.00 m: signal: HAZARD", "20.00 m to 59.60 m: 1"] {
        assert!(svg.contains(part), "{part}\n{svg}");
    }
    assert_eq!(
        svg.matches("<title>planner</title>").count(),
        1,
        "the avoidance lies beyond the drive\n{svg}"
    );
}

/// A stop of ten seconds out of reach of the announced turn.
const STOPPING: &str = "map = \"map.osm\"
[route]
segments = [[1, 11], [2], [3]]
[drive]
speed = [{ at_m = 0, mps = 10 }]
stops = [{ at_m = 45, for_s = 10 }]
";

#[test]
fn a_drive_decides_as_the_gateway_whose_settings_it_takes() {
    let keys = "standing_limit_ms = 5000\nminimum_on_ms = 3000\nplanning_hz = 5\ncountry = \"KR\"\n\
                age_limits.odometry_ms = 300\n";
    let bench = Bench::new("stop.toml", STOPPING);
    let gateway = format!("[vehicle_geometry]\nwheel_base_m = 3.0\n[turn_signal]\nmap = \"map.osm\"\n{keys}");
    let keys = format!("{keys}vehicle.wheel_base_m = 3.0\n");
    fs::write(bench.folder.path().join("gateway.toml"), gateway).unwrap();
    fs::write(bench.folder.path().join("none.toml"), "[[can]]\ninterface = \"can0\"\n").unwrap();
    let args = ["--compat", "improved", "--every", "step", "--json"];
    let (by_default, _) = bench.out(&args);
    let (by_gateway, _) = bench.out(&[&["--config", "gateway.toml"][..], &args].concat());
    let (by_file, _) = Bench::new("stop.toml", &format!("{keys}{STOPPING}")).out(&args);
    assert_eq!(by_gateway, by_file);
    assert_ne!(by_gateway, by_default);
    // The vehicle stands from 4.5 s on; announced again when it drives.
    let turn_at = |text: &str, at_s: f64| {
        let lines = text.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
        let at = lines.into_iter().find(|line| line["t"].as_f64().is_some_and(|t| t >= at_s)).unwrap();
        at["turn"].as_str().unwrap().to_owned()
    };
    assert_eq!([9.0, 10.0, 14.0].map(|at_s| turn_at(&by_gateway, at_s)), ["LEFT", "DISABLE", "DISABLE"]);
    assert_eq!(turn_at(&by_default, 14.0), "LEFT");

    bench.run(&["--config", "none.toml"]).assert(3, "none.toml");
}
