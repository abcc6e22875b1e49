//! The start: a report waits for its first frames until they are overdue, and only then is it an error.

use can_signal::can::frame::CanId;
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use can_signal::validation::observation::MissingReason;
use gateway_base::diagnostics::Level;
use gateway_core::gateway::GatewaySettings;
use gateway_core::vehicle_report::ReportState;

use crate::support::files::MemoryFiles;
use crate::support::virtual_gateway::VirtualGateway;

const TURN: CanId = CanId::Standard(0x100);
const GEAR: CanId = CanId::Standard(0x101);
const BUS: BusIndex = BusIndex(0);

const PROFILE: &str = r#"
name = "car"
[bus.body]
dbc = "car.dbc"
[message.TURN]
timeout_ms = 500
[message.GEAR]
timeout_ms = 700
[turn]
signal = "TURN.CODE"
off = [0]
left = [1]
right = [2]
[hazard]
from = "not_fitted"
[gear]
signal = "GEAR.POSITION"
park = [0]
drive = [1]
"#;

const DBC: &str = "\
BO_ 256 TURN: 1 X
 SG_ CODE : 0|2@1+ (1,0) [0|3] \"\" X
BO_ 257 GEAR: 1 X
 SG_ POSITION : 0|2@1+ (1,0) [0|3] \"\" X
";

fn settings(profile: &str) -> GatewaySettings {
    MemoryFiles::vehicle(profile, DBC).settings().gateway
}

/// Level and message of each change of a status, with its time in milliseconds.
fn changes(desk: &VirtualGateway, task: &str) -> Vec<(u64, String)> {
    desk.changes_of(task)
        .map(|change| (change.ms(), format!("{} {}", change.level, change.message)))
        .collect()
}

fn awaited(message: &str, id: u16, seconds: u32) -> String {
    format!("WARN starting: waiting for the first frame of {message} ({id:X}) on can0, at most {seconds} s")
}

#[test]
fn silence_is_an_error_of_each_report_once_the_first_frame_is_overdue() {
    let mut desk = VirtualGateway::new(settings(PROFILE));
    let report = desk.snapshot().turn_indicators.unwrap();
    assert!(report.state == ReportState::Starting && report.failure.is_none() && report.published.is_none());
    assert_eq!(desk.snapshot().signals[0].missing.as_ref().unwrap().reason, MissingReason::Awaited);
    desk.pass(10_000);
    for (task, message, id) in [("turn_indicators", "TURN", 0x100), ("gear", "GEAR", 0x101)] {
        let expected = [
            (0, awaited(message, id, 2)),
            (2000, format!("ERROR unknown: no frame of {message} ({id:X}) on can0 yet")),
        ];
        assert_eq!(changes(&desk, task), expected);
        assert_eq!(desk.value(task, "unknown_count"), "1");
    }
    assert_ne!(desk.snapshot().turn_indicators.unwrap().state, ReportState::Starting);
}

#[test]
fn start_with_frames_has_no_error_and_no_failure() {
    let mut desk = VirtualGateway::new(settings(PROFILE));
    desk.pass(1_900);
    for _ in 0..20 {
        desk.receive(GEAR, &[1]);
        desk.receive(TURN, &[1]);
        desk.pass(100);
    }
    assert!(desk.changes.iter().all(|change| change.level < Level::Error), "{:?}", desk.changes);
    for task in ["turn_indicators", "gear"] {
        assert_eq!(changes(&desk, task)[1..], [(1_900, "OK publishing".to_owned())]);
        assert_eq!(
            (desk.value(task, "unknown_count"), desk.value(task, "last_error")),
            ("0".into(), "none".into())
        );
    }
}

#[test]
fn slowest_message_sets_the_deadline_of_its_bus() {
    let mut desk = VirtualGateway::new(settings(&PROFILE.replace("700", "5000")));
    desk.pass(5_000);
    assert_eq!(changes(&desk, "turn_indicators"), [(0, awaited("TURN", 0x100, 5))]);
    desk.pass(1);
    assert_eq!(desk.status("turn_indicators").level, Level::Error);
}

#[test]
fn frames_are_awaited_from_the_first_link_on_and_not_after_a_lost_one() {
    let mut desk = VirtualGateway::on_link(settings(PROFILE), LinkState::Missing);
    let link = |desk: &mut VirtualGateway, state| desk.handle(CanInput::Link { bus: BUS, state });
    desk.pass(10_000);
    link(&mut desk, LinkState::Up);
    desk.pass(1_000);
    desk.receive(TURN, &[1]);
    desk.pass(100);
    link(&mut desk, LinkState::Down);
    link(&mut desk, LinkState::Up);
    let expected = [
        (0, "ERROR unknown: can0 is missing".to_owned()),
        (10_000, awaited("TURN", 0x100, 2)),
        (11_000, "OK publishing".to_owned()),
        (11_100, "ERROR unknown: can0 is down".to_owned()),
        (11_100, "ERROR unknown: no new frame of TURN (100) on can0 yet".to_owned()),
    ];
    assert_eq!(changes(&desk, "turn_indicators"), expected);
}

#[test]
fn value_that_is_received_at_the_start_is_judged_at_once() {
    let mut desk = VirtualGateway::new(settings(PROFILE));
    desk.receive(TURN, &[3]);
    desk.receive(GEAR, &[]);
    assert_eq!(desk.status_text("turn_indicators"), "ERROR invalid: TURN.CODE = 3 is not a defined value");
    assert_eq!(desk.status_text("gear"), "ERROR unknown: GEAR (101) is received, but too short");
}
