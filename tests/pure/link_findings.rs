//! Diagnostics of a bus with a problem of its controller, its link or its silence, on virtual time.

use std::io;

use can_log::Log;
use can_signal::can::controller::ControllerReport;
use can_signal::can::error_frame::{ControllerState, ErrorCounters, ErrorFrame};
use can_signal::can::frame::CanId;
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::diagnostics::Level;
use gateway_core::gateway::GatewaySettings;
use gateway_core::gateway::event::Output;
use signal_gateway::replay::{Replay, Routes};

use crate::support::files::MemoryFiles;
use crate::support::virtual_gateway::VirtualGateway;

const BUS: BusIndex = BusIndex(0);
const TURN: CanId = CanId::Standard(0x100);
const HAZARD: CanId = CanId::Standard(0x101);
const ALIVE: CanId = CanId::Standard(0x102);

const PROFILE: &str = r#"
name = "car"
[bus.body]
dbc = "car.dbc"
heartbeat_messages = ["ALIVE"]
[message.TURN]
timeout_ms = 500
[message.HAZARD]
timeout_ms = 1200
[turn]
signal = "TURN.CODE"
off = [0]
left = [1]
right = [2]
[hazard]
from = "signal"
signal = "HAZARD.ON"
off = [0]
on = [1]
"#;

const DBC: &str = "\
BO_ 256 TURN: 1 X
 SG_ CODE : 0|2@1+ (1,0) [0|3] \"\" X
BO_ 257 HAZARD: 1 X
 SG_ ON : 0|1@1+ (1,0) [0|1] \"\" X
BO_ 258 ALIVE: 1 X
";

fn settings(may_sleep: bool) -> GatewaySettings {
    let sleep = if may_sleep { "may_sleep = true\nheartbeat_messages" } else { "heartbeat_messages" };
    MemoryFiles::vehicle(&PROFILE.replace("heartbeat_messages", sleep), DBC).settings().gateway
}

/// A gateway on a bus that is up, without the status changes of its start.
fn gateway_on_bus(may_sleep: bool) -> VirtualGateway {
    let mut desk = VirtualGateway::new(settings(may_sleep));
    desk.changes.clear();
    desk
}

/// A gateway that has received all messages for so long, without the status changes until then.
fn receiving_gateway(may_sleep: bool, ms: u64) -> VirtualGateway {
    let mut desk = gateway_on_bus(may_sleep);
    desk.send_all(ms);
    desk.changes.clear();
    desk
}

/// Events on the bus, and the status changes that follow.
impl VirtualGateway {
    /// All messages, each 100 ms, for so long.
    fn send_all(&mut self, ms: u64) {
        for _ in 0..ms / 100 {
            for id in [ALIVE, TURN, HAZARD] {
                self.receive(id, &[1]);
            }
            self.pass(100);
        }
    }

    fn error(&mut self, class: u32, data: &[u8]) {
        self.handle(CanInput::ErrorFrame { bus: BUS, error: ErrorFrame::new(class, data) });
    }

    fn controller(&mut self, state: ControllerState, restart_ms: u32) {
        let counters = Some(ErrorCounters { tx: 0, rx: 7 });
        let report = ControllerReport { state, counters, restart_ms: Some(restart_ms) };
        self.handle(CanInput::Controller { bus: BUS, report });
    }

    /// The status changes of a task since the last call, as `LEVEL message`.
    fn new_statuses(&mut self, task: &str) -> Vec<String> {
        let changes = self.changes.extract_if(.., |change| change.task == task);
        changes.map(|change| format!("{} {}", change.level, change.message)).collect()
    }
}

const STALE: &str = "ERROR unknown: TURN is stale, silent for more than 500 ms";

#[test]
fn a_sleeping_bus_is_one_finding_however_long_it_sleeps_and_returns_cleanly() {
    let mut desk = receiving_gateway(true, 1000);
    desk.pass(3_600_000);
    assert_eq!(desk.new_statuses("can0"), ["OK asleep"]);
    // TURN was stale before the bus could be called asleep, HAZARD not. Neither is a failure.
    let asleep = |message| format!("WARN asleep: no frame of {message} since bus can0 fell asleep");
    let quiet = "WARN asleep: no frame of TURN, as nothing on can0".to_owned();
    assert_eq!(desk.new_statuses("turn_indicators"), [quiet, asleep("TURN")]);
    assert_eq!(desk.new_statuses("hazard_lights"), [asleep("HAZARD")]);
    assert_eq!(desk.value("turn_indicators", "unknown_count"), "0");
    desk.send_all(2000);
    assert_eq!(desk.new_statuses("can0"), ["OK receiving"]);
    assert_eq!(desk.new_statuses("turn_indicators"), ["OK publishing"]);
    assert_eq!(desk.new_statuses("hazard_lights"), ["OK publishing"]);
}

#[test]
fn a_message_missing_after_the_bus_woke_up_is_still_reported_missing() {
    let mut desk = gateway_on_bus(true);
    desk.send_all(1000);
    desk.pass(10_000);
    desk.changes.clear();
    for _ in 0..50 {
        desk.receive(ALIVE, &[1]);
        desk.pass(100);
    }
    assert_eq!(desk.new_statuses("can0"), ["OK receiving"]);
    let hazard = "ERROR unknown: HAZARD is stale, silent for more than 1200 ms";
    assert_eq!(desk.new_statuses("hazard_lights"), [hazard], "asleep no longer");
    assert_eq!(desk.new_statuses("turn_indicators"), [STALE], "asleep no longer");
    assert!(desk.changes.is_empty(), "nothing else: {:?}", desk.changes);
    desk.receive(TURN, &[1]);
    assert_eq!(desk.new_statuses("turn_indicators"), ["OK publishing"]);
    for _ in 0..6 {
        desk.pass(100);
        desk.receive(ALIVE, &[1]);
    }
    assert_eq!(desk.new_statuses("turn_indicators"), [STALE], "awake, and stale for its own reasons");
}

#[test]
fn a_normal_sleep_is_no_error_at_any_time_from_falling_asleep_to_waking_up() {
    let mut desk = receiving_gateway(true, 1000);
    for _ in 0..3 {
        desk.pass(600_000);
        // The slowest message comes last.
        for _ in 0..11 {
            desk.receive(ALIVE, &[1]);
            desk.pass(100);
        }
        desk.send_all(2000);
    }
    let errors: Vec<_> = desk.changes.iter().filter(|change| change.level == Level::Error).collect();
    assert!(errors.is_empty(), "{errors:?}");
    assert_eq!(desk.status_text("turn_indicators"), "OK publishing");
}

#[test]
fn a_message_that_fails_while_others_are_received_is_an_error_also_where_the_bus_may_sleep() {
    let mut desk = receiving_gateway(true, 1000);
    for _ in 0..10 {
        desk.receive(ALIVE, &[1]);
        desk.pass(100);
    }
    assert_eq!(desk.new_statuses("turn_indicators"), [STALE]);
}

#[test]
fn a_bus_that_may_not_sleep_or_dies_is_silent_and_not_asleep() {
    let silent = "WARN up, but no frame of the vehicle profile for more than 1000 ms";
    let mut desk = receiving_gateway(false, 1000);
    desk.pass(10_000);
    assert_eq!(desk.new_statuses("can0"), [silent]);
    assert_eq!(desk.new_statuses("turn_indicators"), [STALE]);

    let mut desk = gateway_on_bus(true);
    desk.send_all(1000);
    desk.error(0x88, &[0, 0, 0x04]); // a plug that is being pulled
    desk.changes.clear();
    desk.pass(30_000);
    assert_eq!(desk.new_statuses("can0"), [silent]);
    assert_eq!(desk.new_statuses("turn_indicators"), [STALE]);

    let mut desk = receiving_gateway(true, 1000);
    desk.handle(CanInput::Link { bus: BUS, state: LinkState::Down });
    desk.pass(10_000);
    assert_eq!(desk.new_statuses("can0"), ["ERROR can0 is down"]);
    assert_eq!(desk.new_statuses("turn_indicators"), ["ERROR unknown: can0 is down"]);
}

#[test]
fn bus_off_is_named_as_the_cause_with_how_it_ends() {
    for (restart_ms, how) in [
        (Some(0), "receives nothing, needs a manual restart: ip link set can0 type can restart"),
        (Some(100), "receives nothing, restarts by itself after 100 ms"),
        (None, "receives nothing until it is restarted"),
    ] {
        let mut desk = gateway_on_bus(true);
        if let Some(ms) = restart_ms {
            desk.controller(ControllerState::ErrorActive, ms);
        }
        desk.send_all(1000);
        assert_eq!(desk.new_statuses("can0"), ["OK receiving"]);
        desk.changes.clear();
        desk.error(0x40, &[]);
        desk.pass(60_000);
        assert_eq!(desk.new_statuses("can0"), [format!("ERROR bus-off: {how}")]);
        assert_eq!(
            desk.new_statuses("turn_indicators"),
            ["ERROR unknown: TURN is not received, can0 is bus-off"]
        );
        assert_eq!(desk.value("can0", "controller"), "bus-off");
        assert_eq!(desk.value("can0", "controller_state_s"), "60");
        desk.error(0x100, &[]);
        desk.send_all(1000);
        let expected = [
            "WARN restarted after bus-off; up, but no frame of the vehicle profile for more than 1000 ms",
            "OK receiving",
        ];
        assert_eq!(desk.new_statuses("can0"), expected, "back at once with the first frame");
        assert_eq!(desk.new_statuses("turn_indicators").last().unwrap(), "OK publishing");
        assert_eq!(desk.value("can0", "bus_off_count"), "1");
        assert_eq!(desk.value("can0", "last_error"), "bus-off (61 s ago)");
    }
}

#[test]
fn a_changed_restart_time_is_news_while_the_controller_is_bus_off() {
    let mut desk = gateway_on_bus(false);
    desk.controller(ControllerState::BusOff, 0);
    desk.controller(ControllerState::BusOff, 50);
    desk.controller(ControllerState::BusOff, 50);
    let statuses = desk.new_statuses("can0");
    assert_eq!(statuses.len(), 2, "{statuses:?}");
    assert_eq!(statuses[1], "ERROR bus-off: receives nothing, restarts by itself after 50 ms");
    assert_eq!(desk.value("can0", "rx_errors"), "7");
}

#[test]
fn a_controller_that_flaps_is_reported_once() {
    let mut desk = receiving_gateway(false, 500);
    for _ in 0..1000 {
        desk.error(0x204, &[0, 0x08, 0, 0, 0, 0, 96, 0]);
        desk.error(0x204, &[0, 0x40, 0, 0, 0, 0, 95, 0]);
        desk.send_all(100);
    }
    assert_eq!(desk.new_statuses("can0"), ["WARN error-warning: the bus is disturbed"]);
    desk.send_all(2000);
    assert_eq!(desk.new_statuses("can0"), ["OK receiving"]);
    assert_eq!(desk.value("can0", "error_frames"), "2000");
}

#[test]
fn a_storm_of_bus_errors_is_counted_and_reported_once() {
    let mut desk = receiving_gateway(false, 500);
    for _ in 0..10_000 {
        desk.error(0x88, &[0, 0, 0x04, 0x0A]);
    }
    assert_eq!(desk.new_statuses("can0"), ["WARN receiving, with recent drops, error frames or bad lines"]);
    assert_eq!(desk.value("can0", "error_classes"), "protocol 10000, bus-error 10000");
    assert_eq!(desk.value("can0", "last_error"), "protocol (stuff error at data), bus-error (0 s ago)");
}

#[test]
fn a_recording_with_error_frames_replays_to_the_same_findings() {
    let log = "(10.0) can0 100#01\n(10.1) can0 20000204#000800000000600C\n(10.2) can0 100#01\n\
               (12.0) can0 20000204#0020000000008010\n(12.1) can0 100#01\n(14.0) can0 20000040#0000000000000000\n\
               (16.0) can0 20000100#0000000000000000\n(16.1) can0 100#01\n(17.5) can0 100#01\n";
    let log = Log::new(Box::new(io::Cursor::new(log))).unwrap();
    let settings = settings(false);
    let routes = Routes::by_interface(&settings);
    let mut replay = Replay::new(settings, log, routes).unwrap();
    let mut messages = Vec::new();
    let mut last = String::new();
    while replay.step().unwrap() {
        while let Some(output) = replay.poll_output() {
            let Output::Diagnostics { diagnostics, .. } = output else { continue };
            for status in diagnostics.statuses.into_iter().filter(|status| status.task == "can0") {
                let text = status.message;
                let is_controllers =
                    ["error-", "bus-off", "restarted"].iter().any(|start| text.starts_with(start));
                if !diagnostics.refresh && is_controllers {
                    messages.push(text);
                }
                let counters = status.values.iter().filter(|(key, _)| key.ends_with("x_errors"));
                last = counters.map(|(_, value)| value.as_str()).collect::<Vec<_>>().join(" ");
            }
        }
    }
    let expected = [
        "error-warning: the bus is disturbed",
        "error-warning: the bus is disturbed; up, but no frame of the vehicle profile for more than 1000 ms",
        "error-passive: the bus is heavily disturbed; up, but no frame of the vehicle profile for more than 1000 ms",
        "error-passive: the bus is heavily disturbed",
        "error-passive: the bus is heavily disturbed; up, but no frame of the vehicle profile for more than 1000 ms",
        "bus-off: receives nothing until it is restarted",
        "restarted after bus-off; up, but no frame of the vehicle profile for more than 1000 ms",
    ];
    assert_eq!(messages, expected);
    assert_eq!(last, "unknown unknown");
}
