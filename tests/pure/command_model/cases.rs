//! The cases of docs/spec/vehicle-interface.md, "Arbitration of commands",
//! that need no bus, on a vehicle that follows after 150 ms.

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::diagnostics::Level;
use gateway_core::command::input::CommandInput;
use gateway_core::command::{Reported, Turn};
use signal_gateway::config::gateway::command::CommandConfig;

use crate::pure::command_model::bench::{Bench, config};
use crate::support::clock::{MS, at_ms};
use crate::support::command_vehicle::{PROFILE, request_text};

/// The senders' rhythm.
const CYCLE_MS: u64 = 100;
/// What the vehicle takes from a frame to its report.
const LAG_MS: u64 = 150;

/// Something that changes from a time on; commands and mode are sent every 100 ms.
#[derive(Clone, Copy)]
enum Do {
    Turn(u8),
    TurnOnce(u8),
    NoTurn,
    Hazard(u8),
    NoHazard,
    Mode(u8),
    NoMode,
    /// The driver's stalk, where the vehicle lets it through.
    Stalk(Turn),
    HazardButton(bool),
    Override(bool),
    /// The vehicle's lights do nothing any more.
    Dead,
    /// The report is withheld.
    NoReport,
    Link(LinkState),
    Stop,
}

/// What must hold at a time: the last request, and a part of the texts of turn and hazard status.
type Must = (u64, &'static str, ExpectedStatus, ExpectedStatus);
type ExpectedStatus = (Level, &'static str);

struct Case {
    id: &'static str,
    section: &'static str,
    does: &'static [(u64, Do)],
    must: &'static [Must],
}

const OK: Level = Level::Ok;
const WARN: Level = Level::Warn;
const ERROR: Level = Level::Error;

#[rustfmt::skip]
const CASES: &[Case] = &[
    Case { id: "hazard during turn, then off", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(1)), (1000, Do::Hazard(2)), (3000, Do::Hazard(1))],
        must: &[(10, "left", (OK, "left sent, the vehicle reports off"), (OK, "off, as commanded")),
                (900, "left", (OK, "left, as commanded"), (OK, "off, as commanded")),
                (1010, "hazard", (OK, "off, hazard lights come first"), (OK, "on sent, the vehicle reports off")),
                (2900, "hazard", (OK, "off, hazard lights come first"), (OK, "on, as commanded")),
                (3010, "left", (OK, "left"), (OK, "off")), (3900, "left", (OK, "left"), (OK, "off"))] },
    Case { id: "turn commanded during hazard comes up afterwards", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(1)), (0, Do::Hazard(2)), (1000, Do::Turn(3)), (2000, Do::Hazard(1))],
        must: &[(1900, "hazard", (OK, "hazard lights come first"), (OK, "on")), (2010, "right", (OK, "right"), (OK, "off"))] },
    Case { id: "NO_COMMAND at 10 Hz, never engaged", section: "",
        does: &[(0, Do::Mode(4)), (0, Do::Turn(0)), (0, Do::Hazard(0))],
        must: &[(100, "-", (OK, "not allowed"), (OK, "not allowed")), (20_000, "-", (OK, "not allowed"), (OK, "not allowed"))] },
    Case { id: "NO_COMMAND at 10 Hz in AUTONOMOUS", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(0)), (0, Do::Hazard(0))],
        must: &[(100, "-", (OK, "nothing requested"), (OK, "nothing requested")), (20_000, "-", (OK, "nothing requested"), (OK, "nothing requested"))] },
    Case { id: "emergency of the command gate: turn NO_COMMAND, hazard ENABLE", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(1)), (1000, Do::Turn(0)), (1000, Do::Hazard(2))],
        must: &[(1010, "hazard", (OK, "hazard lights come first"), (OK, "on")),
                (4000, "hazard, any turn", (OK, "nothing requested"), (OK, "on"))] },
    Case { id: "command value 7", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(1)), (1000, Do::TurnOnce(7)), (3500, Do::TurnOnce(255))],
        must: &[(1050, "left", (ERROR, "undefined command 7 is ignored"), (OK, "off")),
                (1900, "left", (ERROR, "undefined command 7"), (OK, "")), (2100, "left", (OK, "left"), (OK, "off")),
                (3550, "left", (ERROR, "undefined command 255"), (OK, "off"))] },
    Case { id: "turn command silent for the limit", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(1)), (1000, Do::NoTurn)],
        must: &[(1850, "left", (OK, "left"), (OK, "off")), (2000, "off", (ERROR, "timed out: off"), (OK, "off"))] },
    Case { id: "turn command silent, hold", section: "on_turn_timeout = \"hold\"\nturn_timeout_ms = 500",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(1)), (1000, Do::NoTurn)],
        must: &[(5000, "left", (ERROR, "timed out: left"), (OK, "off"))] },
    Case { id: "turn command silent, hazard", section: "on_turn_timeout = \"hazard\"",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(1)), (1000, Do::NoTurn), (4000, Do::Turn(2))],
        must: &[(3000, "hazard", (ERROR, ""), (OK, "on, the command has timed out")), (4050, "left", (OK, ""), (OK, "off"))] },
    Case { id: "hazard command silent while on stays on", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(2)), (1000, Do::NoHazard)],
        must: &[(5000, "hazard", (OK, ""), (ERROR, "timed out: on"))] },
    Case { id: "MANUAL", section: "",
        does: &[(0, Do::Mode(4)), (0, Do::Turn(2)), (0, Do::Hazard(2)), (1000, Do::Mode(1)), (2000, Do::Mode(4))],
        must: &[(900, "-", (OK, "not allowed"), (OK, "not allowed")), (1050, "hazard", (OK, ""), (OK, "on")),
                (2000, "-", (OK, "not allowed"), (OK, "not allowed"))] },
    Case { id: "modes without a rule, and no mode", section: "",
        does: &[(0, Do::Turn(2)), (0, Do::Hazard(2)), (1000, Do::Mode(5)), (2000, Do::Mode(6)), (3000, Do::Mode(0)),
                (4000, Do::Mode(9)), (5000, Do::Mode(2)), (6000, Do::NoMode)],
        must: &[(900, "-", (OK, "not allowed"), (OK, "")), (1900, "-", (OK, ""), (OK, "")), (2900, "-", (OK, ""), (OK, "")),
                (3900, "-", (OK, ""), (OK, "")), (4900, "-", (OK, ""), (OK, "")), (5900, "hazard", (OK, ""), (OK, "on")),
                (6850, "hazard", (OK, ""), (OK, "on")), (7000, "-", (OK, "not allowed"), (OK, ""))] },
    Case { id: "AUTONOMOUS_VELOCITY_ONLY", section: "",
        does: &[(0, Do::Mode(3)), (0, Do::Turn(2)), (0, Do::Hazard(1)), (1000, Do::Hazard(2))],
        must: &[(900, "any turn", (OK, "not allowed"), (OK, "off")), (1010, "hazard, any turn", (OK, "not allowed"), (OK, "on"))] },
    Case { id: "link down and up again", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(3)), (0, Do::Hazard(1)), (1000, Do::Link(LinkState::Missing)), (3000, Do::Link(LinkState::Up))],
        must: &[(1200, "right", (WARN, "right commanded, not sent: no frame can be sent"), (WARN, "off commanded, not sent")), (3500, "right", (OK, ""), (OK, ""))] },
    Case { id: "the vehicle does not follow", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(1)), (1000, Do::Dead), (2000, Do::Turn(3))],
        must: &[(900, "left", (OK, ""), (OK, "")), (3400, "right", (OK, ""), (OK, "")),
                (3700, "right", (WARN, "commanded right, but the vehicle still reports left"), (OK, "")),
                (5200, "right", (ERROR, "commanded right, but the vehicle reports left"), (OK, "off"))] },
    Case { id: "no report to hold it against", section: "",
        does: &[(0, Do::NoReport), (0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(1))],
        must: &[(1400, "left, any hazard", (OK, ""), (OK, "")), (9000, "left, any hazard", (WARN, "no report shows it"), (WARN, "no report shows it"))] },
    Case { id: "hazard lights that may be the driver's, for all that is known", section: "",
        does: &[(0, Do::NoReport), (0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(1)), (2000, Do::Hazard(2)), (4000, Do::Hazard(1))],
        must: &[(100, "left, any hazard", (OK, ""), (OK, "no report shows whether they are on")),
                (2010, "hazard", (OK, ""), (OK, "on")), (4010, "left", (OK, ""), (OK, "off"))] },
    Case { id: "the driver's hazard lights, then no report", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::HazardButton(true)), (0, Do::Turn(1)), (0, Do::Hazard(1)), (3000, Do::NoReport)],
        must: &[(2900, "off, any hazard", (OK, ""), (WARN, "left to the driver: on")),
                (9000, "off, any hazard", (WARN, "no report"), (WARN, "left to the driver: nothing"))] },
    Case { id: "the driver's stalk, then no report", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Stalk(Turn::Left)), (0, Do::Turn(1)), (0, Do::Hazard(1)), (3000, Do::NoReport)],
        must: &[(2900, "any turn", (WARN, "left to the driver: left"), (OK, "off")),
                (9000, "-", (WARN, "left to the driver: nothing"), (WARN, "no report"))] },
    Case { id: "the driver has taken over, and switches hazard lights on", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(1)), (1000, Do::Override(true)), (2000, Do::HazardButton(true)), (4000, Do::HazardButton(false))],
        must: &[(1900, "any turn", (WARN, "left to the driver"), (OK, "off")),
                (2500, "-", (WARN, "left to the driver"), (WARN, "left to the driver: on")),
                (5000, "any turn", (WARN, "left to the driver"), (OK, "off"))] },
    Case { id: "NO_COMMAND, then silence: nothing comes back", section: "on_turn_timeout = \"hold\"",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(2)), (1000, Do::Turn(0)), (1000, Do::Hazard(0)),
                (4000, Do::NoTurn), (4000, Do::NoHazard)],
        must: &[(3900, "-", (OK, "nothing requested"), (OK, "nothing requested")),
                (5100, "-", (ERROR, "timed out: left to the vehicle"), (ERROR, "timed out: left to the vehicle"))] },
    Case { id: "lights on for less than the vehicle takes to show it are not taken for the driver's", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(1)), (0, Do::Hazard(1)), (1000, Do::Hazard(2)), (1100, Do::Hazard(1)),
                (2000, Do::Turn(2)), (2100, Do::Turn(1))],
        must: &[(1090, "hazard", (OK, ""), (OK, "on")), (1200, "off", (OK, "off"), (OK, "off sent, the vehicle reports on")),
                (1990, "off", (OK, "off"), (OK, "off")), (2090, "left", (OK, "left"), (OK, "")),
                (2200, "off", (OK, "off sent, the vehicle reports left"), (OK, "off")), (2900, "off", (OK, "off"), (OK, "off"))] },
    Case { id: "twice on within what the vehicle takes to show it", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(1)), (0, Do::Hazard(1)), (1000, Do::Hazard(2)), (1100, Do::Hazard(1)),
                (1200, Do::Hazard(2)), (1300, Do::Hazard(1)), (3000, Do::HazardButton(true))],
        must: &[(1290, "hazard", (OK, ""), (OK, "on")), (1360, "off", (OK, ""), (OK, "off sent, the vehicle reports on")),
                (1500, "off", (OK, ""), (OK, "off, as commanded")), (3500, "off, any hazard", (OK, ""), (WARN, "left to the driver: on"))] },
    Case { id: "the driver's stalk before any request for a side", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Stalk(Turn::Left)), (0, Do::Turn(1)), (0, Do::Hazard(1)), (3000, Do::Stalk(Turn::Off))],
        must: &[(1000, "any turn", (WARN, "commanded off, left to the driver: left"), (OK, "off")), (4000, "off", (OK, "off"), (OK, "off"))] },
    Case { id: "the driver indicates to the other side, and stops", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(1)), (3000, Do::Stalk(Turn::Right)), (6000, Do::Stalk(Turn::Off))],
        must: &[(2900, "left", (OK, ""), (OK, "")), (4000, "any turn", (WARN, "commanded left, left to the driver: right"), (OK, "")),
                (5900, "any turn", (WARN, "left to the driver"), (OK, "")), (7000, "left", (OK, "left"), (OK, ""))] },
    Case { id: "the vehicle signals that the driver has taken over", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(1)), (1000, Do::Override(true)), (2000, Do::Override(false))],
        must: &[(1200, "any turn", (WARN, "left to the driver"), (OK, "")), (2300, "left", (OK, ""), (OK, ""))] },
    Case { id: "the driver's hazard lights are not switched off", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::HazardButton(true)), (0, Do::Turn(2)), (0, Do::Hazard(1)), (3000, Do::Hazard(2)),
                (4000, Do::Hazard(1)), (6000, Do::HazardButton(false))],
        must: &[(1000, "left, any hazard", (OK, ""), (WARN, "commanded off, left to the driver: on")), (3900, "hazard", (OK, ""), (OK, "on")),
                (5000, "left, any hazard", (OK, ""), (WARN, "left to the driver: on")), (7000, "left", (OK, ""), (OK, "off"))] },
    Case { id: "nothing commanded yet", section: "",
        does: &[(0, Do::Mode(1))],
        must: &[(0, "-", (WARN, "no command"), (WARN, "no command")), (5000, "-", (WARN, "no command received"), (WARN, "no command"))] },
    Case { id: "stop releases", section: "",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(2)), (1000, Do::Stop)],
        must: &[(1200, "-", (OK, "the gateway ends"), (OK, "the gateway ends"))] },
    Case { id: "stop with hazard lights", section: "on_shutdown = \"hazard\"",
        does: &[(0, Do::Mode(1)), (0, Do::Turn(2)), (0, Do::Hazard(1)), (1000, Do::Stop)],
        must: &[(1200, "hazard", (OK, ""), (OK, "on, the gateway ends"))] },
    Case { id: "stop with lights off, in MANUAL nothing", section: "on_shutdown = \"off\"",
        does: &[(0, Do::Mode(4)), (0, Do::Turn(2)), (0, Do::Hazard(1)), (1000, Do::Stop)],
        must: &[(1200, "-", (OK, ""), (OK, ""))] },
];

/// A vehicle that does what frames with authority request, else what its driver does.
struct Vehicle {
    stalk: Turn,
    button: bool,
    dead: Option<Reported>,
    reports: bool,
    overridden: bool,
}

impl Vehicle {
    /// Its report now: the request of `LAG_MS` ago. The stalk beats a side, and the button an "off".
    fn report(&self, bench: &Bench, ms: u64) -> Reported {
        if !self.reports {
            return Reported::default();
        }
        if let Some(frozen) = self.dead {
            return frozen;
        }
        let seen = bench.sent.iter().rev().find(|(at, _)| at / MS + LAG_MS <= ms);
        let requested = seen.map_or("-", |(_, frame)| request_text(frame.data()));
        let hazard = requested.starts_with("hazard") || self.button;
        let side = match requested.split(',').next() {
            Some("left") => Turn::Left,
            Some("right") => Turn::Right,
            _ => Turn::Off,
        };
        let turn = if self.stalk == Turn::Off { side } else { self.stalk };
        Reported { turn: Some(if hazard { Turn::Off } else { turn }), hazard: Some(hazard) }
    }
}

fn play(case: &Case) -> Vec<String> {
    let mut bench = Bench::new(config(&format!("tx = \"on\"\n{}", case.section), PROFILE));
    let mut vehicle =
        Vehicle { stalk: Turn::Off, button: false, dead: None, reports: true, overridden: false };
    let (mut turn, mut hazard, mut mode) = (None, None, None);
    let mut wrong = Vec::new();
    let last = case.must.iter().map(|must| must.0).max().unwrap();
    assert!(case.must.iter().all(|must| must.0 % 10 == 0), "{}: looked at every 10 ms", case.id);
    for ms in (0..=last).step_by(10) {
        bench.pass_until(ms * MS);
        for (_, change) in case.does.iter().filter(|(at, _)| *at == ms) {
            match *change {
                Do::Turn(raw) => turn = Some(raw),
                Do::TurnOnce(raw) => bench.turn(raw),
                Do::NoTurn => turn = None,
                Do::Hazard(raw) => hazard = Some(raw),
                Do::NoHazard => hazard = None,
                Do::Mode(raw) => mode = Some(raw),
                Do::NoMode => mode = None,
                Do::Stalk(side) => vehicle.stalk = side,
                Do::HazardButton(on) => vehicle.button = on,
                Do::Override(on) => vehicle.overridden = on,
                Do::Dead => vehicle.dead = Some(vehicle.report(&bench, ms)),
                Do::NoReport => vehicle.reports = false,
                Do::Link(state) => {
                    bench.buses[0].set_link(state);
                }
                Do::Stop => bench.take(CommandInput::Stop),
            }
        }
        if ms % CYCLE_MS == 0 {
            if let Some(raw) = turn {
                bench.turn(raw);
            }
            if let Some(raw) = hazard {
                bench.hazard(raw);
            }
            if let Some(raw) = mode {
                bench.mode(raw);
            }
            let state = Frame::classic(CanId::Standard(560), &[u8::from(vehicle.overridden) << 4, 0, 0, 0]);
            let now = bench.now();
            bench.buses[0].frame_arrived(now.mono);
            bench.flow.handle_frame(BusIndex(0), &state.unwrap(), now.wall, now);
        }
        let report = vehicle.report(&bench, ms);
        bench.report(report);
        bench.settle();
        for (_, wire, turn, hazard) in case.must.iter().filter(|must| must.0 == ms) {
            let statuses = bench.status_texts();
            let fits = |index: usize, must: &ExpectedStatus| {
                statuses[index].0 == must.0 && statuses[index].1.contains(must.1)
            };
            if bench.requested() != *wire || !fits(0, turn) || !fits(1, hazard) {
                wrong.push(format!(
                    "{} at {ms}: {} {statuses:?}, not {wire} {turn:?} {hazard:?}",
                    case.id,
                    bench.requested()
                ));
            }
        }
    }
    wrong
}

#[test]
fn every_case_of_the_specification() {
    let wrong: Vec<String> = CASES.iter().flat_map(play).collect();
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn while_the_link_is_down_nothing_is_sent_and_it_is_an_error() {
    let mut bench = Bench::new(config("tx = \"on\"", PROFILE));
    bench.mode(1);
    bench.turn(2);
    bench.settle();
    bench.buses[0].set_link(LinkState::Down);
    bench.settle();
    let before = bench.sent.len();
    bench.pass_until(900 * MS);
    assert_eq!(bench.sent.len(), before);
    assert_eq!(bench.status_texts()[2], (Level::Error, "nothing can be sent on body".to_owned()));
    bench.buses[0].set_link(LinkState::Up);
    bench.settle();
    assert_eq!(bench.sent.len(), before + 1, "the present state goes out at once");
    bench.pass_until(990 * MS);
    assert_eq!(bench.sent.len(), before + 3, "and its burst");
}

#[test]
fn after_the_last_frame_there_is_none() {
    let mut bench = Bench::new(config("tx = \"on\"\non_shutdown = \"off\"", PROFILE));
    bench.report(Reported { turn: Some(Turn::Off), hazard: Some(false) });
    bench.mode(1);
    bench.turn(2);
    bench.settle();
    bench.pass_until(300 * MS);
    bench.take(CommandInput::Stop);
    bench.settle();
    let left = bench.sent.len();
    bench.pass_until(900 * MS);
    assert!(bench.flow.is_finished());
    assert_eq!((bench.sent.len(), bench.requested()), (left, "off"));
    assert!(bench.flow.next_deadline().is_none_or(|at| at > bench.now().mono));
}

#[test]
fn a_dry_run_shows_everything_and_sends_nothing() {
    let mut bench = Bench::new(config("control_mode_timeout_ms = 60000", PROFILE));
    bench.mode(1);
    bench.turn(2);
    bench.settle();
    bench.pass_until(5_000 * MS);
    assert!(bench.sent.is_empty());
    assert_eq!(request_text(bench.would_send[0].data()), "left, any hazard");
    assert!(bench.would_send.len() > 40);
    assert!(bench.status_texts()[0].1.contains("timed out"), "{:?}", bench.status_texts());
    let frame = bench.would_send[3];
    let now = bench.now();
    let origin = bench.flow.classify_frame(BusIndex(0), &frame, now);
    assert_eq!(origin, gateway_core::command::sender::FrameOrigin::Foreign, "it cannot be ours");
}

#[test]
fn statuses_show_requests_reasons_and_the_control_mode() {
    let mut bench = Bench::new(config("tx = \"on\"", PROFILE));
    bench.mode(3);
    bench.turn(2);
    bench.hazard(2);
    bench.settle();
    let value = |task, key| bench.value(task, key);
    assert_eq!(value(0, "requested"), "left to the vehicle");
    assert_eq!(value(0, "reason"), "not allowed in this control mode");
    assert_eq!(value(1, "requested"), "on");
    assert_eq!(value(1, "reason"), "as commanded");
    assert_eq!(value(2, "control_mode"), "AUTONOMOUS_VELOCITY_ONLY");
}

/// The vehicle of the cases, but one signal requests everything. It can request nothing by `none` alone.
fn one_signal(none: &str) -> CommandConfig {
    let part = "turn.off = { TURN_ONLY_REQ = 0 }\nturn.left = { TURN_ONLY_REQ = 1 }\n\
                turn.right = { TURN_ONLY_REQ = 2 }\nturn.hazard = { TURN_ONLY_REQ = 3 }\n";
    let (head, tail) = PROFILE.split_once("[[command.message]]").unwrap();
    let (_, driver) = tail.split_once("[[command.driver]]").unwrap();
    let message = format!("[[command.message]]\nname = \"TURN_ONLY\"\nperiod_ms = 100\n{part}{none}");
    config("tx = \"on\"", &format!("{head}{message}[[command.driver]]{driver}"))
}

#[test]
fn without_a_report_a_side_that_was_requested_is_ended() {
    let mut bench = Bench::new(one_signal(""));
    bench.mode(1);
    let mut wire = Vec::new();
    for turn in [1, 2, 1] {
        bench.turn(turn);
        bench.hazard(1);
        bench.settle();
        bench.pass_until(bench.now_ns + 200 * MS);
        wire.push(bench.sent.last().map(|(_, frame)| frame.data()[0]));
    }
    assert_eq!(wire, [None, Some(1), Some(0)], "hazard lights may be on at first");
}

#[test]
fn a_side_does_not_end_the_drivers_hazard_lights_where_one_signal_requests_both() {
    let mut bench = Bench::new(one_signal("turn.none = { TURN_ONLY_REQ = 0 }\n"));
    let mut wire = Vec::new();
    // Left is commanded throughout; the driver presses the button twice, then hazard lights are commanded.
    for (hazard_command, reported) in
        [(1, false), (1, true), (0, true), (1, false), (2, false), (2, true), (1, true)]
    {
        for _ in 0..20 {
            bench.pass_until(bench.now_ns + 100 * MS);
            bench.mode(1);
            bench.turn(2);
            bench.hazard(hazard_command);
            let turn = if reported { Turn::Off } else { Turn::Left };
            bench.report(Reported { turn: Some(turn), hazard: Some(reported) });
            bench.settle();
        }
        wire.push(bench.sent.last().unwrap().1.data()[0]);
    }
    assert_eq!(wire, [1, 0, 0, 1, 3, 3, 1]);
}

#[test]
fn frames_keep_their_distance_from_when_they_really_went_out() {
    let mut bench = Bench::new(config("tx = \"on\"", PROFILE));
    bench.pass_until(1_000 * MS);
    bench.mode(1);
    bench.turn(2);
    let frame = bench.settle().pop().unwrap();
    // The machine was busy: it went out 30 ms late, and the second frame of the burst is due already.
    bench.flow.handle_input(CommandInput::Sent(frame), at_ms(1_030));
    let before = bench.sent.len();
    bench.pass_until(1_039 * MS);
    assert_eq!(bench.sent.len(), before);
    bench.pass_until(1_040 * MS);
    assert_eq!(bench.sent.len(), before + 1);
}

#[test]
fn a_driver_override_lasts_until_the_vehicle_signals_its_end() {
    let mut bench = Bench::new(config("tx = \"on\"", PROFILE));
    let mut wire = Vec::new();
    for sign in [Some(0), Some(1), None, Some(0)] {
        for _ in 0..10 {
            bench.pass_until(bench.now_ns + 100 * MS);
            bench.mode(1);
            bench.turn(2);
            let frame = sign.map(|sign| Frame::classic(CanId::Standard(560), &[sign << 4, 0, 0, 0]).unwrap());
            let now = bench.now();
            bench.buses[0].frame_arrived(now.mono);
            if let Some(frame) = frame {
                bench.flow.handle_frame(BusIndex(0), &frame, now.wall, now);
            }
            bench.settle();
        }
        wire.push(bench.requested());
    }
    assert_eq!(wire, ["left, any hazard", "-", "-", "left, any hazard"]);
}
