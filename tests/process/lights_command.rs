//! `signal-gateway lights` as a user meets it: text, JSON, picture, refusals, exit codes.
//!
//! What is printed as text, and refused, are cases in `tests/cases/command/lights.txt`. T14 is that of
//! docs/spec/traffic-lights.md, "Worked timelines": one frame a second, the first at the start.

use std::fs;
use std::path::PathBuf;

use serde_json::{Value, json};
use traffic_lights::command::parse_command;
use traffic_lights::compat::Compat;
use traffic_lights::scenario::{Phase, TrafficSignalController};

use crate::support::program::{Ran, run};

const GROUPS: &str = "[groups]\n100 = [11, 12]\n200 = [21]\n[[controller]]\nname = \"A\"\n";
const BY_THE_SECOND: [&str; 6] = ["--frame-rate", "1", "--first-frame", "0", "--v2i-rate", "1"];

/// A folder with one file in it.
struct Bench {
    folder: tempfile::TempDir,
    file: PathBuf,
}

impl Bench {
    fn new(name: &str, text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(name);
        fs::write(&file, text).unwrap();
        Self { folder, file }
    }

    /// Controller A with phases of (name, seconds, states), then more of the file.
    fn of_phases(phases: &[(&str, f64, &str)], more: &str) -> Self {
        let phase = |(name, seconds, states): &(&str, f64, &str)| {
            format!(
                "[[controller.phase]]\nname = \"{name}\"\nduration_s = {seconds}\nstates = {{ {states} }}\n"
            )
        };
        let phases: String = phases.iter().map(phase).collect();
        Self::new("bench.toml", &format!("{GROUPS}{phases}{more}"))
    }

    fn run(&self, args: &[&str]) -> Ran {
        run(&self.folder, &[&["lights", self.file.to_str().unwrap()], args].concat())
    }

    fn out(&self, args: &[&str]) -> String {
        self.run(args).succeeded()
    }

    fn json(&self, args: &[&str]) -> Vec<Value> {
        self.run(args).json()
    }

    fn picture(&self, args: &[&str]) -> String {
        let path = self.folder.path().join("picture.svg");
        self.out(&[args, &["--picture", path.to_str().unwrap()]].concat());
        fs::read_to_string(path).unwrap()
    }
}

fn cycling() -> Bench {
    let phases = [
        ("p1", 3.0, "\"21\" = \"green\""),
        ("p2", 1.0, "\"21\" = \"yellow\""),
        ("p3", 2.0, "\"21\" = \"red\""),
    ];
    Bench::of_phases(&phases, "")
}

fn by_hand() -> Bench {
    let first = "\"21\" = \"green\", \"21 conventional_detected\" = \"yellow\"";
    let event = "[[event]]\nname = \"hand\"\nat_s = 1\ndo = [{ set = \"21 conventional_detected\", state = \"red\" }, \
                 { set = \"11 conventional_detected\", state = \"unknown\" }]\n";
    Bench::of_phases(&[("p1", 3.0, first), ("p2", 3.0, "\"21\" = \"red\"")], event)
}

#[test]
fn t14_predictions_in_json() {
    let phases = [
        ("p1", 4.0, "\"21 v2i\" = \"green\""),
        ("p2", 2.0, "\"21 v2i\" = \"yellow\""),
        ("p3", 6.0, "\"21 v2i\" = \"red\""),
    ];
    let bench = Bench::of_phases(&phases, "");
    let lines = bench.json(&[&BY_THE_SECOND[..], &["--until", "6", "--json"]].concat());
    let predicted = |line: &Value| {
        let predictions = line["external"][0]["predictions"].as_array().unwrap();
        let predicted = predictions.iter().map(|prediction| {
            assert_eq!(
                (&prediction["reliability"], &prediction["source"]),
                (&json!(1.0), &json!("SIMULATION"))
            );
            format!("{} {}", prediction["at"], prediction["elements"][0]["color"].as_str().unwrap())
        });
        predicted.collect::<Vec<_>>().join(", ")
    };
    let times: Vec<_> = lines.iter().map(|line| line["t"].as_f64().unwrap()).collect();
    assert_eq!(times, [0.0, 1.0, 4.0, 6.0]);
    assert_eq!(lines[0]["external"], Value::Null, "nothing was sent yet");
    let from_4 = "12.0 green, 16.0 yellow, 18.0 red, 24.0 green";
    assert_eq!(predicted(&lines[1]), format!("4.0 yellow, 6.0 red, {from_4}"));
    assert_eq!(predicted(&lines[2]), format!("6.0 red, {from_4}, 28.0 yellow"));
    assert_eq!(predicted(&lines[3]), format!("{from_4}, 28.0 yellow, 30.0 red"));
}

#[test]
fn a_json_line_holds_all_there_is() {
    let args = [&BY_THE_SECOND[..], &["--until", "1", "--json"]].concat();
    let lines = by_hand().json(&args);
    let light = |state: &str| json!({ "state": format!("{state} solidOn circle"), "confidence": 1.0 });
    let group = |id: i64, color: &str| {
        let element = json!({ "color": color, "status": "solidOn", "shape": "circle", "confidence": 1.0 });
        json!({ "id": id, "elements": [element] })
    };
    let does = |does: &str| json!({ "what": "action", "event": "hand", "does": does });
    let expected = json!({
        "t": 1.0,
        "events": [
            { "what": "event", "act": "bench", "event": "hand" },
            does("set 21 conventional_detected to red"),
            does("set 11 conventional_detected to unknown"),
            { "what": "act_ends", "act": "bench" },
        ],
        "ground_truth": { "conventional": { "21": light("green") }, "v2i": {} },
        "detected": { "conventional": { "11": light("unknown"), "21": light("red") }, "v2i": {} },
        "internal": [group(100, "unknown"), group(200, "red")],
        "external": [],
    });
    assert_eq!(lines.last(), Some(&expected));
}

#[test]
fn every_frame_is_printed_on_request_and_else_the_changes() {
    let frames = |args: &[&str]| {
        let args = [&["--frame-rate", "10", "--until", "2.0", "--json"], args].concat();
        cycling().json(&args).len()
    };
    // Time zero, 20 frames, the first message over V2I with one of them.
    assert_eq!(frames(&["--every", "step"]), 21);
    assert_eq!(frames(&[]), 3);
}

#[test]
fn the_scenario_determines_how_long_it_is_shown() {
    let last = |bench: &Bench| bench.out(&BY_THE_SECOND).lines().last().unwrap().trim().to_owned();
    assert_eq!(last(&cycling()), "12.000  until                  twice the longest cycle");
    let stopped = format!("stop_at_s = 4\n{}", fs::read_to_string(cycling().file).unwrap());
    let text = Bench::new("stop.toml", &stopped).out(&BY_THE_SECOND);
    let (before, after) =
        text.split_once("    4.000  end                    stopped by its stop trigger\n").unwrap();
    assert!(before.contains("    4.000  phase") && after.lines().all(|line| line.starts_with("    4.000")));
}

#[test]
fn q7_upper_diagonals_are_sent_as_each_behaviour_can() {
    let bench =
        Bench::of_phases(&[("p1", 3.0, "\"21\" = \"red upperLeft\", \"21 v2i\" = \"red upperRight\"")], "");
    for (compat, camera, v2i) in [("improved", "upperLeft", "upperRight"), ("upstream", "unknown", "unknown")]
    {
        let lines =
            bench.json(&[&BY_THE_SECOND[..], &["--json", "--until", "1", "--compat", compat]].concat());
        let last = lines.last().unwrap();
        assert_eq!(last["ground_truth"]["conventional"]["21"]["state"], "red solidOn upperLeft");
        let shapes = [&last["internal"][0], &last["external"][0], &last["external"][0]["predictions"][0]]
            .map(|shown| shown["elements"][0]["shape"].as_str().unwrap());
        assert_eq!(shapes, [camera, v2i, v2i], "{compat}");
    }
}

#[test]
fn the_example_of_the_documentation_runs_as_documented() {
    let guide = include_str!("../../docs/traffic-lights.md");
    let block = |language: &str| {
        let (_, rest) = guide.split_once(&format!("```{language}\n")).unwrap();
        rest.split_once("```").unwrap().0
    };
    let bench = Bench::new("crossing.toml", block("toml"));
    assert_eq!(bench.out(&["--until", "5"]), block("text"));
}

#[test]
fn commands_of_the_documentation_are_commands() {
    let guide = include_str!("../../docs/traffic-lights.md");
    let (_, rows) = guide.split_once("| command | example |\n").unwrap();
    let rows = rows.split_once("\n\n").unwrap().0.lines().skip(1);
    let commands: Vec<_> = rows
        .flat_map(|row| row.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>())
        .collect();
    assert_eq!(commands.len(), 11);
    let stop = Phase { name: "stop".to_owned(), duration: None, entries: Vec::new() };
    let main = TrafficSignalController { name: "main road".to_owned(), reference: None, phases: vec![stop] };
    for command in commands {
        parse_command(&command, std::slice::from_ref(&main), Compat::Improved).unwrap();
    }
}

#[test]
fn the_same_scenario_gives_the_same_bytes() {
    for args in [&[][..], &["--json"], &["--json", "--every", "frame"]] {
        assert_eq!(by_hand().out(args), by_hand().out(args));
    }
    assert_eq!(by_hand().picture(&[]), by_hand().picture(&[]));
}

/// A bar: left, right, and what it is.
type Bar = (f64, f64, String);

/// Rows as `lane | row`, each with its bars.
fn rows(svg: &str) -> Vec<(String, Vec<Bar>)> {
    let document = roxmltree::Document::parse(svg).unwrap();
    let is_a = |node: &roxmltree::Node<'_, '_>, class: &str| node.attribute("class") == Some(class);
    let title = |node: &roxmltree::Node<'_, '_>| {
        let title = node.children().find(|child| child.has_tag_name("title")).unwrap();
        title.text().unwrap().to_owned()
    };
    let number = |shape: &roxmltree::Node<'_, '_>, name: &str| -> f64 {
        shape.attribute(name).unwrap().parse().unwrap()
    };
    let mut rows = Vec::new();
    for lane in document.descendants().filter(|node| is_a(node, "lane")) {
        for row in lane.children().filter(|node| is_a(node, "row")) {
            let bars = row.children().filter(|node| is_a(node, "bar")).map(|bar| {
                let shape = bar.children().find(|child| child.has_tag_name("rect")).unwrap();
                let x = number(&shape, "x");
                (x, x + number(&shape, "width"), title(&bar))
            });
            rows.push((format!("{} | {}", title(&lane), title(&row)), bars.collect()));
        }
    }
    rows
}

#[test]
fn the_picture_has_a_lane_for_each_light_with_detected_above_ground_truth() {
    let svg = by_hand().picture(&[&BY_THE_SECOND[..], &["--until", "6"]].concat());
    let rows = rows(&svg);
    let names: Vec<_> = rows.iter().map(|(name, _)| name.as_str()).collect();
    let expected = [
        "A | phase",
        "11 (group 100) | Detected",
        "21 (group 200) | Detected",
        "21 (group 200) | GroundTruth",
        "group 100 | internal",
        "group 200 | internal",
    ];
    assert_eq!(names, expected);
    let described = |row: usize| rows[row].1.iter().map(|(_, _, text)| text.as_str()).collect::<Vec<_>>();
    assert_eq!(described(0), ["0 s to 3 s: p1", "3 s to 6 s: p2"]);
    assert_eq!(described(2), ["0 s to 1 s: yellow solidOn circle", "1 s to 3 s: red solidOn circle"]);
    assert_eq!(described(3), ["0 s to 3 s: green solidOn circle", "3 s to 6 s: red solidOn circle"]);
    for text in ["set 21 conventional_detected to red", "set 11 conventional_detected to unknown"] {
        assert!(svg.contains(text), "{text}");
    }
}

#[test]
fn bars_lie_where_their_times_are() {
    let rows = rows(&cycling().picture(&[&BY_THE_SECOND[..], &["--until", "6"]].concat()));
    let (_, bars) = rows.iter().find(|(name, _)| name == "21 (group 200) | GroundTruth").unwrap();
    let (left, right) = (bars[0].0, bars[2].1);
    let expected = [(0.0, 3.0), (3.0, 4.0), (4.0, 6.0)];
    assert_eq!(bars.len(), expected.len());
    assert!(right - left > 500.0);
    for ((from_px, to_px, _), (from_s, to_s)) in bars.iter().zip(expected) {
        let px = |seconds: f64| left + seconds / 6.0 * (right - left);
        assert!((from_px - px(from_s)).abs() < 0.05 && (to_px - px(to_s)).abs() < 0.05, "{bars:?}");
    }
}

#[test]
fn an_hour_of_short_phases_is_one_mark_that_says_so() {
    let svg = cycling().picture(&["--until", "3600"]);
    let rows = rows(&svg);
    let (_, bars) = rows.iter().find(|(name, _)| name == "21 (group 200) | GroundTruth").unwrap();
    assert!(bars.is_empty(), "{}", bars.len());
    assert!(svg.contains(": 1800 states, too short to be told apart</title>"), "{svg}");
    assert!(svg.contains("width=\"880\"") && svg.len() < 40_000, "{}", svg.len());
}

#[test]
fn names_with_every_kind_of_sign_leave_the_picture_whole() {
    let name = "<a> & \\\"b\\\" 信号 ✓";
    let bench = Bench::of_phases(&[(name, 3.0, "\"21\" = \"green flashing, red solidOff left\"")], "");
    let rows = rows(&bench.picture(&["--until", "2"]));
    assert!(rows[0].1[0].2.ends_with(": <a> & \"b\" 信号 ✓"), "{rows:?}");
}

#[test]
fn a_verdict_that_cannot_be_decided_is_said_in_text_json_and_exit_code() {
    let text = "<OpenSCENARIO><RoadNetwork><TrafficSignals/></RoadNetwork><Storyboard><Story name='s'><Act name='a'>\
        <ManeuverGroup name='g'><Maneuver name='m'><Event name='collision'><Action name='x'><UserDefinedAction>\
        <CustomCommandAction type='exitFailure'/></UserDefinedAction></Action><StartTrigger><ConditionGroup>\
        <Condition name='c'><ByEntityCondition><EntityCondition><CollisionCondition/></EntityCondition>\
        </ByEntityCondition></Condition></ConditionGroup></StartTrigger></Event></Maneuver></ManeuverGroup></Act>\
        </Story></Storyboard></OpenSCENARIO>";
    let bench = Bench::new("s.xosc", text);
    let map = bench.folder.path().join("map");
    fs::create_dir(&map).unwrap();
    fs::write(map.join("lanelet2_map.osm"), "<osm/>").unwrap();
    let args = ["--until", "1", "--map", map.to_str().unwrap()];
    let text = bench.run(&args);
    text.assert(6, "");
    let last = text.out.lines().last().unwrap();
    assert!(last.contains("end") && last.contains("undecided: the event \"collision\" would end"), "{last}");
    let json = bench.run(&[&args[..], &["--json"]].concat());
    let lines = json.json();
    assert_eq!((json.code, &lines.last().unwrap()["events"][0]["verdict"]), (6, &json!("undecided")));
}

#[test]
fn a_timeout_is_no_failure_when_the_success_before_it_was_left_out() {
    let event = |command: &str, condition: &str| {
        format!(
            "<Event name='e'><Action name='x'><UserDefinedAction><CustomCommandAction type='{command}'/></UserDefinedAction>\
             </Action><StartTrigger><ConditionGroup><Condition>{condition}</Condition></ConditionGroup></StartTrigger></Event>"
        )
    };
    let timeout =
        "<ByValueCondition><SimulationTimeCondition value='2' rule='greaterThan'/></ByValueCondition>";
    for (before, code) in [("exitSuccess", 6), ("exitFailure", 5)] {
        let events = event(before, "<ByEntityCondition/>") + &event("exitFailure", timeout);
        let text = format!(
            "<OpenSCENARIO><Storyboard><Story><Act><ManeuverGroup><Maneuver>{events}</Maneuver></ManeuverGroup></Act></Story>\
             </Storyboard></OpenSCENARIO>"
        );
        assert_eq!(Bench::new("s.xosc", &text).run(&["--without-map"]).code, code, "{before}");
    }
}
