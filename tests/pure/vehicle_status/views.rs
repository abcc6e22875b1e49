//! The drive of the bench vehicle as terminal, page, text and metrics show it.

use std::io::Cursor;

use can_log::Log;
use gateway_base::time::MonoTime;
use serde_json::{Value, json};
use signal_gateway::config::Settings;
use signal_gateway::process_status::snapshot::Snapshot;
use signal_gateway::replay::{Replay, Routes};
use signal_gateway::report::gateway_view::GatewayView;
use signal_gateway::report::terminal::view_model::Model;
use signal_gateway::report::{metrics, status};

use crate::pure::terminal_view::check_model;
use crate::support::files::MemoryFiles;
use crate::support::status_vehicle;

/// Moments of the drive: on a bend; with most of it not available; parked with open doors.
const DRIVING_MS: u64 = 1_500;
const UNKNOWN_MS: u64 = 2_700;
const PARKED_MS: u64 = 5_800;

fn settings() -> Settings {
    MemoryFiles::new([
        ("gateway.toml", "profile = \"bench.toml\"\n[can.body]\ninterface = \"can0\"\n"),
        ("bench.toml", status_vehicle::PROFILE),
        ("bench.dbc", status_vehicle::DBC),
    ])
    .settings()
}

/// The state after so much of the drive.
fn snapshot_at(ms: u64) -> Snapshot {
    let settings = settings().gateway;
    let routes = Routes::by_interface(&settings);
    let log = Log::new(Box::new(Cursor::new(status_vehicle::drive().into_bytes()))).unwrap();
    let mut replay = Replay::new(settings, log, routes).unwrap();
    while replay.next_time().is_some_and(|next| next <= MonoTime::from_millis(ms)) {
        assert!(replay.step().unwrap());
        while replay.poll_output().is_some() {}
    }
    replay.gateway().snapshot(replay.now())
}

/// The row of a status text that begins with a name.
fn row<'a>(text: &'a str, name: &str) -> &'a str {
    let row = text.lines().find_map(|line| line.strip_prefix("  ")?.strip_prefix(name)?.strip_prefix(' '));
    row.unwrap_or_else(|| panic!("{name}: {text}")).trim()
}

#[test]
fn status_text_has_each_report_with_its_unit() {
    let driving = status::text(&GatewayView::of(&snapshot_at(DRIVING_MS)), None);
    let expected = [
        ("velocity", "10.00 m/s, 5.00°/s, 0 ms old, from speedometer"),
        ("steering", "2.00°"),
        ("gear", "drive"),
        ("control_mode", "autonomous"),
        ("doors", "all closed"),
        ("MOTION.SPEED", "3600"),
    ];
    for (name, value) in expected {
        assert!(row(&driving, name).starts_with(value), "{name}: {driving}");
    }
    let unknown = status::text(&GatewayView::of(&snapshot_at(UNKNOWN_MS)), None);
    for name in ["velocity", "steering", "gear", "control_mode"] {
        assert!(row(&unknown, name).starts_with("withheld"), "{name}: {unknown}");
    }
    let doors = row(&unknown, "doors");
    assert!(doors.starts_with("front left not available, front right closed"), "{doors}");
    let headline = GatewayView::of(&snapshot_at(DRIVING_MS)).headline();
    assert_eq!(headline, "OK: gear drive, mode autonomous, turn off, hazard off");
}

#[test]
fn metrics_have_si_units_in_their_names_and_no_value_while_none_is_published() {
    let driving = metrics::openmetrics(&snapshot_at(DRIVING_MS));
    let value = |metrics: &str, name: &str| -> Option<f64> {
        metrics.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' ')?.parse().ok())
    };
    let measured = [
        ("signal_gateway_velocity_longitudinal_meters_per_second{}", 10.0),
        ("signal_gateway_velocity_heading_rate_radians_per_second{}", 5.0_f64.to_radians()),
        ("signal_gateway_steering_tire_angle_radians{}", 2.0_f64.to_radians()),
    ];
    let unknown = metrics::openmetrics(&snapshot_at(UNKNOWN_MS));
    for (name, expected) in measured {
        let found = value(&driving, name).unwrap_or_else(|| panic!("{name}: {driving}"));
        assert!((found - expected).abs() < 1e-9, "{name} {found}");
        assert_eq!(value(&unknown, name), None, "{name}");
    }
    for (metrics, sample, expected) in [
        (&driving, "signal_gateway_report_state{report=\"gear\",state=\"DRIVE\"}", 1.0),
        (&driving, "signal_gateway_report_state{report=\"gear\",state=\"REVERSE\"}", 0.0),
        (&driving, "signal_gateway_report_state{report=\"control_mode\",state=\"AUTONOMOUS\"}", 1.0),
        (&driving, "signal_gateway_report_published{report=\"velocity\"}", 1.0),
        (&unknown, "signal_gateway_report_published{report=\"velocity\"}", 0.0),
        (&unknown, "signal_gateway_report_failures_total{report=\"velocity\",kind=\"unknown\"}", 1.0),
        (&unknown, "signal_gateway_report_state{report=\"gear\",state=\"DRIVE\"}", 0.0),
        (&unknown, "signal_gateway_door_state{door=\"front left\",state=\"NOT_AVAILABLE\"}", 1.0),
        (&driving, "signal_gateway_door_state{door=\"front left\",state=\"CLOSED\"}", 1.0),
    ] {
        assert_eq!(value(metrics, sample), Some(expected), "{sample}: {metrics}");
    }
}

#[test]
fn page_has_a_tile_and_the_way_from_the_wire_for_each_report() {
    let feed = |ms| serde_json::to_value(GatewayView::of(&snapshot_at(ms))).unwrap();
    let parked = feed(PARKED_MS);
    let tiles = |feed: &Value| -> Vec<(Value, Value)> {
        let reports = feed["reports"].as_array().unwrap();
        reports.iter().map(|report| (report["title"].clone(), report["reported"]["text"].clone())).collect()
    };
    let expected = [
        ("Velocity", "0.00 m/s, 0.00°/s"),
        ("Steering", "0.00°"),
        ("Gear", "park"),
        ("Control mode", "manual"),
        ("Turn indicators", "off"),
        ("Hazard lights", "off"),
        ("Doors", "front right open, front left opening"),
    ];
    let expected: Vec<_> = expected.iter().map(|(title, value)| (json!(title), json!(value))).collect();
    assert_eq!(tiles(&parked), expected);
    let unknown = feed(UNKNOWN_MS);
    let gear = &unknown["reports"][2];
    assert_eq!((&gear["reported"]["text"], &gear["reported"]["level"]), (&json!("withheld"), &json!("WARN")));
    let steps: Vec<_> = gear["steps"].as_array().unwrap().iter().map(|step| &step["name"]).collect();
    assert_eq!(steps, ["Link", "Controller", "Frames", "Checks", "Age", "Value", "Report"]);
    assert_eq!(gear["commanded"], Value::Null);
}

#[test]
fn terminal_shows_the_status_beside_the_car() {
    for (name, ms) in [("status_driving", DRIVING_MS), ("status_unknown", UNKNOWN_MS)] {
        let mut model = Model { title: "run · Bench".to_owned(), has_color: true, ..Model::default() };
        model.show(GatewayView::of(&snapshot_at(ms)));
        let shown = check_model(name, &model);
        assert!(shown.contains("mode"), "{shown}");
    }
}
