//! The snapshot says what the outputs say, at every step of the demo, and its JSON is read back as it was.

mod fields;

use std::collections::BTreeSet;
use std::io::Cursor;
use std::path::Path;

use boon::{Compiler, SchemaIndex, Schemas};
use can_log::Log;
use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use gateway_base::diagnostics::Level;
use gateway_base::names::state_word;
use gateway_base::time::MonoTime;
use gateway_core::vehicle_report::ReportState;
use serde::Serialize;
use serde_json::{Map, Value};
use signal_gateway::config::files::{DEMO_CONFIG, Embedded, Files as _};
use signal_gateway::config::{Overrides, Settings, load};
use signal_gateway::process_status::log::LogState;
use signal_gateway::process_status::snapshot::{Build, ProcessSnapshot, Snapshot};
use signal_gateway::replay::{Replay, Routes};
use signal_gateway::report::gateway::Changes;
use signal_gateway::report::gateway_view::GatewayView;

fn settings() -> Settings {
    load(&Embedded, Path::new(DEMO_CONFIG), &Overrides::default()).unwrap()
}

fn replay() -> Replay {
    let settings = settings();
    let bytes = Embedded.read(&settings.recording.unwrap().file).unwrap();
    let routes = Routes::by_interface(&settings.gateway);
    Replay::new(settings.gateway, Log::new(Box::new(Cursor::new(bytes))).unwrap(), routes).unwrap()
}

fn snapshot(replay: &Replay) -> Snapshot {
    replay.gateway().snapshot(replay.now())
}

/// Bits 1 to 3 of byte 2 of 0x2A5: the turn state of the demo vehicle.
fn turn_state(frame: &Frame) -> Option<i128> {
    (frame.id() == CanId::Standard(0x2A5)).then(|| i128::from(frame.data()[2] >> 1 & 7))
}

#[test]
fn snapshot_agrees_with_outputs_and_frames_throughout_the_demo() {
    let (mut replay, mut changes) = (replay(), Changes::default());
    let (mut last, mut seen, mut steps) = (None, BTreeSet::new(), 0);
    loop {
        let next = replay.upcoming().and_then(|(input, at)| {
            let CanInput::Frame { frame, .. } = input.can()? else { return None };
            Some((turn_state(frame)?, at))
        });
        if !replay.step().unwrap() {
            break;
        }
        last = next.or(last);
        let outputs = std::iter::from_fn(|| replay.poll_output());
        let has_changed = outputs.map(|output| changes.of(&output).len()).sum::<usize>() > 0;
        steps += 1;
        if !has_changed && steps % 400 != 0 {
            continue;
        }
        let (snapshot, now) = (snapshot(&replay), replay.now().mono);
        let turn = snapshot.turn_indicators.as_ref().unwrap();
        let hazard = snapshot.hazard_lights.as_ref().unwrap();
        let [shown_turn, shown_hazard] = ["turn_indicators", "hazard_lights"]
            .map(|report| changes.reports.get(report).map(String::as_str));
        assert_eq!(turn.published.map(|value| state_word(&value)).as_deref(), shown_turn);
        assert_eq!(hazard.published.map(|value| state_word(&value)).as_deref(), shown_hazard);
        assert_eq!(turn.published.is_none(), turn.withheld.is_some());
        seen.extend(turn.withheld.clone().or(shown_turn.map(str::to_owned)));
        let signal = snapshot.signals.iter().find(|signal| turn.signals.contains(&signal.name)).unwrap();
        let expected = last.map(|(state, at)| (state, age_ms(now, at)));
        assert_eq!(signal.raw.zip(signal.age_ms), expected);
        let is_missing = turn.message.contains("stale") || turn.state == ReportState::Starting;
        assert_eq!(signal.missing.is_some(), is_missing, "{}", turn.message);
        let statuses = replay.gateway().statuses(now);
        let shown = snapshot.diagnostics.iter().map(|shown| (&shown.task, shown.level, &shown.message));
        let expected = statuses.iter().map(|status| (&status.task, status.level, &status.message));
        assert!(shown.eq(expected));
        assert_eq!(snapshot.level, statuses.iter().map(|status| status.level).max().unwrap());
    }
    assert!(steps > 1000, "{steps}");
    for begin in ["left", "right", "off", "starting: ", "unknown: ", "invalid: "] {
        assert!(seen.iter().any(|text| text.starts_with(begin)), "{seen:?}");
    }
}

fn age_ms(now: MonoTime, at: MonoTime) -> u64 {
    u64::try_from(now.since(at).as_millis()).unwrap()
}

/// Returns true if two values are equal but for the last digit of a measured value, which is lost in reading.
fn are_near(one: &Value, other: &Value) -> bool {
    let same = |one: &[Value], other: &[Value]| {
        one.len() == other.len() && one.iter().zip(other).all(|(one, other)| are_near(one, other))
    };
    if let (Some(one), Some(other)) = (one.as_array(), other.as_array()) {
        return same(one, other);
    }
    if let (Some(one), Some(other)) = (one.as_object(), other.as_object()) {
        let values = |object: &Map<String, Value>| object.values().cloned().collect::<Vec<_>>();
        return one.keys().eq(other.keys()) && same(&values(one), &values(other));
    }
    let is_near = |one: f64, other: f64| (one - other).abs() <= 1e-12 * one.abs();
    let are_measured = one.is_f64() && other.is_f64();
    one == other
        || are_measured && one.as_f64().zip(other.as_f64()).is_some_and(|(one, other)| is_near(one, other))
}

#[test]
fn json_is_read_back_as_it_was() {
    let mut replay = replay();
    let mut steps = 0;
    while replay.step().unwrap() {
        while replay.poll_output().is_some() {}
        steps += 1;
        if steps % 1000 == 0 {
            let snapshot = snapshot(&replay);
            let json = serde_json::to_string(&snapshot).unwrap();
            let read = serde_json::from_str::<Snapshot>(&json).unwrap();
            let [read, written] = [&read, &snapshot].map(|snapshot| serde_json::to_value(snapshot).unwrap());
            assert!(are_near(&read, &written), "{read} instead of {written}");
        }
    }
    assert!(steps > 1000, "{steps}");
}

/// Checks JSON against a shipped schema by a validator that is not ours.
struct Validator(Schemas, SchemaIndex);

impl Validator {
    fn new(file: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/schema").join(file);
        let mut schemas = Schemas::new();
        let index = Compiler::new().compile(path.to_str().unwrap(), &mut schemas).unwrap();
        Self(schemas, index)
    }

    fn check(&self, value: &impl Serialize) {
        let json = serde_json::to_value(value).unwrap();
        if let Err(error) = self.0.validate(&json, self.1) {
            panic!("{error:#}: {json}");
        }
    }
}

#[test]
fn snapshots_and_events_are_valid_by_the_shipped_schemas() {
    let (status, feed) = (Validator::new("status.schema.json"), Validator::new("feed.schema.json"));
    let wrong = serde_json::json!({ "schema": "2" });
    assert!(status.0.validate(&wrong, status.1).is_err() && feed.0.validate(&wrong, feed.1).is_err());
    let mut replay = replay();
    let (mut steps, mut checked, mut messages) = (0, 0, BTreeSet::new());
    while replay.step().unwrap() {
        while replay.poll_output().is_some() {}
        steps += 1;
        if steps % 100 == 0 {
            let snapshot = snapshot(&replay);
            status.check(&snapshot);
            let event = GatewayView::of(&snapshot);
            feed.check(&event);
            messages.extend(event.reports.into_iter().map(|report| report.message));
            checked += 1;
        }
    }
    assert!(checked > 5, "{checked}");
    // The kind of a failure is said once.
    assert!(messages.iter().any(|text| text.starts_with("hardware fault: ")), "{messages:?}");
    assert!(!messages.iter().any(|text| text.matches("hardware fault").count() > 1), "{messages:?}");
}

#[test]
fn an_older_program_reads_the_json_of_a_newer_one_with_more_fields() {
    let snapshot = snapshot(&replay());
    let mut json = serde_json::to_value(&snapshot).unwrap();
    json["new_field"] = 1.into();
    json["buses"][0]["new_field"] = 2.into();
    assert_eq!(serde_json::from_str::<Snapshot>(&json.to_string()).unwrap(), snapshot);
}

#[test]
fn statuses_of_the_process_count_for_the_level() {
    let before = Snapshot { level: Level::Ok, ..snapshot(&replay()) };
    let log = LogState { dropped: 3, is_failing: true, ..LogState::default() }.status();
    let process = ProcessSnapshot {
        build: Build { version: "1.2.3".to_owned(), ..Build::default() },
        ..ProcessSnapshot::default()
    };
    let after = before.clone().with_process(process.clone(), &[log]);
    assert_eq!((after.level, after.process), (Level::Warn, Some(process)));
    assert_eq!(after.diagnostics.len(), before.diagnostics.len() + 1);
    let last = after.diagnostics.last().unwrap();
    assert_eq!((last.task.as_str(), last.values[1].value.as_str()), ("log", "3"));
}
