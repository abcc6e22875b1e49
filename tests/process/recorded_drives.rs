//! `decide RECORDING`: drives that writers of other makes have recorded, and the report on the signals in
//! them.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use signal_gateway::config::drive::read;
use signal_gateway::config::files::Disk;
use signal_gateway::desk::drive::simulation::DriveSimulation;
use turn_signal::light_command::TurnCommand;

use crate::support::drive_script::Script;
use crate::support::mcap::McapReaders;
use crate::support::prerequisite::require;
use crate::support::program::{Ran, run};
use crate::support::sources::project;

/// A drive with a turn to each side, and one whose lane change the planner announces.
const DRIVES: [&str; 3] = ["left_then_right.toml", "crossing_left.toml", "lane_change_left.toml"];

/// What the planner does with the signal that the decider would give.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Planner {
    Agrees,
    Late,
    Missing,
    WrongSide,
}

/// A recorded drive.
struct Recorded {
    folder: tempfile::TempDir,
    map: PathBuf,
}

impl Recorded {
    fn new(writers: &McapReaders, drive: &str, planner: Planner) -> Self {
        Self::with_topics(writers, drive, planner, "")
    }

    /// A planner that sends its path as a trajectory, and no planning factors.
    fn of_learned_planner(writers: &McapReaders, drive: &str, planner: Planner) -> Self {
        Self::with_topics(writers, drive, planner, "\"trajectory\": \"/planner/trajectory\", ")
    }

    fn with_topics(writers: &McapReaders, drive: &str, planner: Planner, topics: &str) -> Self {
        let path = Path::new(project()).join("config/drives").join(drive);
        let simulation = DriveSimulation::new(read(&Disk, &path).unwrap()).unwrap();
        let mut script = Script::new(&simulation);
        let decided: Vec<TurnCommand> = script.steps.iter().map(|step| step.decided[0].0).collect();
        script.add("own_turn", |index, _| Some(signal(&decided, index, planner) as u8));
        let folder = tempfile::tempdir().unwrap();
        let script_path = folder.path().join("script");
        fs::write(&script_path, script.text().replacen('{', &format!("{{{topics}"), 1)).unwrap();
        writers.write_drive(&script_path, folder.path());
        Self { folder, map: simulation.file().map.clone() }
    }

    fn report(&self, recording: &str, arguments: &[&str]) -> Ran {
        let decide = ["decide", recording, "--map", self.map.to_str().unwrap()];
        run(&self.folder, &[&decide, arguments].concat())
    }

    fn json(&self, recording: &str) -> (Vec<Value>, Value, i32) {
        let ran = self.report(recording, &["--json"]);
        assert_eq!(ran.error, "");
        let lines = ran.json();
        let (summary, manoeuvres) = lines.split_last().unwrap();
        let manoeuvres = manoeuvres.iter().map(|line| line["manoeuvre"].clone()).collect();
        (manoeuvres, summary["summary"].clone(), ran.code)
    }
}

/// The planner's signal in a cycle; a late one comes after 7 s, when it has been required for a second.
fn signal(decided: &[TurnCommand], index: usize, planner: Planner) -> TurnCommand {
    match (planner, decided[index]) {
        (Planner::Late, command) if decided[index.saturating_sub(70)] == command => command,
        (Planner::Late | Planner::Missing, _) => TurnCommand::Disable,
        (Planner::WrongSide, TurnCommand::Left) => TurnCommand::Right,
        (Planner::WrongSide, TurnCommand::Right) => TurnCommand::Left,
        (Planner::Agrees | Planner::WrongSide, command) => command,
    }
}

#[test]
fn bags_of_other_writers_give_the_same_report_and_a_signal_like_the_deciders_agrees() {
    let writers = require!(McapReaders::find());
    for drive in DRIVES {
        let recorded = Recorded::new(&writers, drive, Planner::Agrees);
        let (manoeuvres, summary, code) = recorded.json("drive.mcap");
        assert_eq!(summary["agreement_percent"], 100.0, "{drive}: {manoeuvres:#?}");
        assert_eq!((code, summary["counts"]["unjudged"].as_u64()), (0, Some(0)), "{drive}");
        assert!(!manoeuvres.is_empty() && manoeuvres.iter().all(|one| one["verdict"] == "agree"), "{drive}");
        assert_eq!(recorded.json("rosbags_sqlite3"), (manoeuvres, summary, code), "{drive}");
    }
}

#[test]
fn each_fault_of_a_signal_is_named_with_its_place_and_the_reason() {
    let writers = require!(McapReaders::find());
    for (planner, verdict) in
        [(Planner::Late, "late"), (Planner::Missing, "missing"), (Planner::WrongSide, "wrong_side")]
    {
        let recorded = Recorded::new(&writers, "crossing_left.toml", planner);
        let (manoeuvres, summary, code) = recorded.json("drive.mcap");
        let [turn] = manoeuvres.as_slice() else { panic!("{planner:?}: {manoeuvres:#?}") };
        let named = turn["verdict"].as_str().map(str::to_owned);
        let named = named.or_else(|| turn["verdict"].as_object()?.keys().next().cloned());
        println!("{planner:?}: {turn}");
        assert_eq!(named.as_deref(), Some(verdict));
        assert_eq!((turn["kind"].as_str(), turn["side"].as_str()), (Some("turn"), Some("left")));
        assert!(turn["decider"].as_str().unwrap().starts_with("LEFT at "), "{turn}");
        assert_eq!((summary["agreement_percent"].as_f64(), code), (Some(0.0), 5));
    }
}

#[test]
fn a_folder_of_drives_is_a_table_with_the_verdict_on_each() {
    let writers = require!(McapReaders::find());
    let recorded = Recorded::new(&writers, "crossing_left.toml", Planner::Agrees);
    fs::write(recorded.folder.path().join("broken.mcap"), b"\x89MCAP0\r\nnothing").unwrap();
    let ran = recorded.report(".", &["--json"]);
    let rows = ran.json();
    let row = |name: &str| rows.iter().find(|row| row["recording"] == name).unwrap();
    assert_eq!((ran.code, &row("./broken.mcap")["exit_code"]), (1, &Value::from(1)), "{rows:#?}");
    let drive = row("./drive.mcap");
    let summary = &drive["result"]["summary"];
    assert_eq!((&drive["exit_code"], &summary["agreement_percent"]), (&Value::from(0), &Value::from(100.0)));
    assert!(drive["found"].as_str().unwrap().starts_with("100 % agree (1 agree); "), "{drive}");
}

#[test]
fn a_recording_without_what_is_needed_is_refused_with_what_it_has() {
    let writers = require!(McapReaders::find());
    let recorded = Recorded::new(&writers, "crossing_left.toml", Planner::Agrees);
    let refused = run(&recorded.folder, &["decide", "drive.mcap"]);
    assert!(refused.error.contains("a recording needs --map"), "{}", refused.error);
    let other_map = concat!(env!("CARGO_MANIFEST_DIR"), "/config/maps/helix/lanelet2_map.osm");
    let refused = run(&recorded.folder, &["decide", "drive.mcap", "--map", other_map]);
    assert!(refused.error.contains("the decider could never decide"), "{}", refused.error);
    assert_eq!(refused.code, 1);
    let refused = recorded.report("drive.mcap", &["--signal", "report"]);
    assert!(refused.error.contains("the recording has no turn signal to judge"), "{}", refused.error);
    assert!(refused.error.contains("/vehicle/status/turn_indicators_status"), "{}", refused.error);
}

#[test]
fn a_bag_of_autoware_alone_drives_the_decider_in_a_replay() {
    let writers = require!(McapReaders::find());
    let recorded = Recorded::new(&writers, DRIVES[1], Planner::Missing);
    let config = format!("[turn_signal]\nenabled = true\nmap = \"{}\"\n", recorded.map.display());
    fs::write(recorded.folder.path().join("gateway.toml"), config).unwrap();
    let replayed = |recording: &str| {
        let ran = run(&recorded.folder, &["replay", recording, "--config", "gateway.toml", "--json"]);
        assert_eq!((ran.code, ran.error.as_str()), (0, ""), "{recording}");
        ran.json()
    };
    let lines = replayed("drive.mcap");
    let command = |line: &Value| {
        (line["topic"] == "/planning/turn_indicators_cmd").then(|| line["data"]["command"].as_u64().unwrap())
    };
    let mut commands: Vec<_> = lines.iter().filter_map(command).collect();
    commands.dedup();
    assert_eq!(commands, [0, 1, 2, 1], "nothing before the first inputs, then a turn to the left");
    assert_eq!(replayed("rosbags_sqlite3"), lines);
}

#[test]
fn a_learned_planners_signal_is_judged_by_its_trajectory() {
    let writers = require!(McapReaders::find());
    for (planner, verdict) in [(Planner::Agrees, "agree"), (Planner::Missing, "missing")] {
        let recorded = Recorded::of_learned_planner(&writers, "lane_change_left.toml", planner);
        let config = format!(
            "[turn_signal]\nmap = \"{}\"\n[turn_signal.inputs]\ntrajectory = \"/planner/trajectory\"\n",
            recorded.map.display()
        );
        fs::write(recorded.folder.path().join("gateway.toml"), config).unwrap();
        let ran = run(&recorded.folder, &["decide", "drive.mcap", "--config", "gateway.toml", "--json"]);
        assert_eq!(ran.error, "", "the planned path is not missed");
        let lines = ran.json();
        let change = &lines[0]["manoeuvre"];
        assert_eq!((change["kind"].as_str(), change["side"].as_str()), (Some("lane_change"), Some("left")));
        assert_eq!(change["verdict"], verdict, "{change}");
        let unnamed = recorded.report("drive.mcap", &[]);
        let advice = "give a --config whose [turn_signal.inputs] names its topic: trajectory =";
        assert!(unnamed.error.contains(advice), "{}", unnamed.text());
        assert!(unnamed.error.contains("it has /planner/trajectory"), "{}", unnamed.error);
    }
}
