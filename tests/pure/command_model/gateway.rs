//! Commands among the other flows of the gateway: what goes in as inputs comes out as frames and statuses.

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::id_match::IdMatch;
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::diagnostics::Level;
use gateway_base::time::MonoTime;
use gateway_core::command::input::CommandInput;
use gateway_core::command::output::CommandOutput;
use gateway_core::gateway::Gateway;
use gateway_core::gateway::event::Output;
use turn_signal::light_command::HazardCommand;
use turn_signal::planner_input::PlannerInput;

use crate::pure::command_model::bench::{self, settings};
use crate::pure::turn_signal_cases::bench::route;
use crate::support::clock::{MS, at_ms};
use crate::support::command_vehicle::{PROFILE, request_text};
use crate::support::virtual_gateway::VirtualGateway;

const BUS: BusIndex = BusIndex(0);
const CMD: CanId = CanId::Standard(304);
const STATE: CanId = CanId::Standard(560);
const AUTONOMOUS: u8 = 1;
const MANUAL: u8 = 4;
const LEFT: u8 = 2;
const ON: u8 = 2;

/// An input and its raw value.
type CommandValue = (fn(u8) -> CommandInput, u8);

fn live(command: &str) -> VirtualGateway {
    VirtualGateway::new(settings(&format!("tx = \"on\"\n{command}"), PROFILE).gateway)
}

/// Commands and the vehicle's state in, frames out.
impl VirtualGateway {
    /// `STATE` with this data, commands and mode every 100 ms for a while.
    fn drive(&mut self, ms: u64, state: u8, words: &[CommandValue]) {
        for _ in 0..ms / 100 {
            self.receive(STATE, &[state, 0, 0, 0]);
            for (word, raw) in words {
                self.handle(word(*raw));
            }
            self.pass_without_end(100);
        }
    }

    /// Time and frame, and whether its contents are new.
    pub(crate) fn sent(&self) -> Vec<(u64, Frame, bool)> {
        let sent = self.select(|output| {
            if let Output::Command(CommandOutput::Transmit { frame, is_news }) = output {
                Some((*frame.frame(), *is_news))
            } else {
                None
            }
        });
        sent.into_iter().map(|(at, (frame, is_news))| (at, frame, is_news)).collect()
    }

    /// Likewise of a dry run.
    fn would_send(&self) -> Vec<(Frame, bool)> {
        let frames = self.select(|output| {
            if let Output::Command(CommandOutput::WouldTransmit { frame, is_news, .. }) = output {
                Some((*frame, *is_news))
            } else {
                None
            }
        });
        frames.into_iter().map(|(_, frame)| frame).collect()
    }

    fn requested(&self) -> &'static str {
        self.sent().last().map_or("no frame", |(_, frame, _)| request_text(frame.data()))
    }

    /// Changes of the status of a task.
    fn news(&self, task: &str) -> Vec<(Level, &str)> {
        self.changes_of(task).map(|change| (change.level, change.message.as_str())).collect()
    }
}

fn turn(raw: u8) -> CommandInput {
    bench::turn(raw, at_ms(0).wall)
}

fn hazard(raw: u8) -> CommandInput {
    bench::hazard(raw, at_ms(0).wall)
}

fn mode(raw: u8) -> CommandInput {
    bench::mode(raw, at_ms(0).wall)
}

#[test]
fn what_is_received_for_commands_passes_the_kernels_filters() {
    let mut settings = settings("", PROFILE).gateway;
    assert_eq!(settings.relevant_ids(BUS), [CMD, STATE].map(IdMatch::from));
    settings.lights.table.messages.clear();
    assert_eq!(settings.relevant_ids(BUS), [CMD, STATE].map(IdMatch::from), "the driver's signs");
    settings.command = None;
    assert_eq!(settings.relevant_ids(BUS), []);
}

#[test]
fn a_command_is_a_frame_at_once_and_the_report_proves_it() {
    let mut desk = live("");
    desk.drive(500, 0, &[(mode, AUTONOMOUS), (turn, 1), (hazard, 1)]);
    assert_eq!(desk.requested(), "off");
    let before = desk.sent().len();
    desk.handle(turn(LEFT));
    let (at, _, is_news) = desk.sent()[before];
    assert_eq!((desk.requested(), at, is_news), ("left", 500, true));
    let words: &[CommandValue] = &[(mode, AUTONOMOUS), (turn, LEFT), (hazard, 1)];
    desk.drive(200, 0, words);
    desk.drive(1_000, 1, words);
    assert!(desk.sent()[before + 1..].iter().all(|(_, _, is_news)| !is_news));
    assert_eq!(desk.value("turn_indicators_command", "reported"), "left");
    // The lamps go out though left is commanded: both values, as soon as each limit is over.
    let dark = desk.now.mono;
    desk.drive(4_000, 0, words);
    let changes = desk.changes_of("turn_indicators_command").filter(|change| change.at > dark);
    let after = |at: MonoTime| at.since(dark).as_nanos().div_ceil(MS.into());
    let changes: Vec<_> =
        changes.map(|change| (after(change.at), change.level, change.message.as_str())).collect();
    let late = (1_501, Level::Warn, "commanded left, but the vehicle still reports off");
    let never = (3_001, Level::Error, "commanded left, but the vehicle reports off");
    assert_eq!(changes, [late, never]);
}

#[test]
fn in_manual_mode_and_on_a_lost_link_nothing_has_authority() {
    let mut desk = live("");
    desk.drive(500, 0, &[(mode, MANUAL), (turn, LEFT), (hazard, ON)]);
    assert!(
        desk.sent().len() > 4 && desk.sent().iter().all(|(_, frame, _)| request_text(frame.data()) == "-")
    );
    desk.drive(500, 0, &[(mode, AUTONOMOUS), (turn, LEFT), (hazard, ON)]);
    assert_eq!(desk.requested(), "hazard");
    let before = desk.sent().len();
    desk.handle(CanInput::Link { bus: BUS, state: LinkState::Down });
    desk.drive(500, 0, &[(mode, AUTONOMOUS), (turn, LEFT), (hazard, ON)]);
    assert_eq!(desk.sent().len(), before);
    assert!(desk.news("command_transmission").contains(&(Level::Error, "nothing can be sent on body")));
    desk.handle(CanInput::Link { bus: BUS, state: LinkState::Up });
    assert_eq!((desk.sent().len(), desk.requested()), (before + 1, "hazard"), "at once");
}

#[test]
fn frames_with_our_identifier_are_not_the_vehicles() {
    let mut desk = live("");
    desk.handle(mode(AUTONOMOUS));
    let own = desk.sent().last().unwrap().1;
    for _ in 0..2 {
        desk.handle(CanInput::Frame { bus: BUS, frame: own, stamp: at_ms(0).wall });
    }
    assert_eq!(desk.value("command_transmission", "echoed"), "CMD 1");
    assert_eq!(desk.value("command_transmission", "foreign"), "CMD 1");
    assert!(desk.news("command_transmission").contains(&(Level::Error, "conflicting sender of CMD")));
    // Neither is a sign of life of the bus.
    assert_eq!(desk.value("can0", "frames"), "0");
}

#[test]
fn frames_without_room_leave_no_gap_in_the_counter() {
    let mut desk = live("");
    let words: &[CommandValue] = &[(mode, AUTONOMOUS), (turn, LEFT), (hazard, 1)];
    desk.drive(500, 1, words);
    desk.queue_full_until = MonoTime::from_millis(590);
    desk.drive(500, 1, words);
    let counters: Vec<_> = desk.sent().iter().map(|(_, frame, _)| frame.data()[6] & 15).collect();
    assert!(counters.windows(2).all(|pair| pair[1] == (pair[0] + 1) % 16), "{counters:?}");
    assert!(desk.news("command_transmission").contains(&(Level::Warn, "frames are delayed")));
    assert_ne!(desk.value("command_transmission", "queue_full"), "CMD 0");
}

#[test]
fn a_stop_is_one_last_frame_with_the_state_for_it() {
    for (on_shutdown, last) in [("release", "-"), ("off", "off"), ("hazard", "hazard")] {
        let mut desk = live(&format!("on_shutdown = \"{on_shutdown}\""));
        let words: &[CommandValue] = &[(mode, AUTONOMOUS), (turn, LEFT), (hazard, 1)];
        desk.drive(200, 0, words);
        desk.drive(300, 1, words);
        let before = desk.sent().len();
        assert!(!desk.gateway.is_finished());
        desk.handle(CommandInput::Stop);
        desk.drive(500, 1, words);
        assert_eq!((desk.sent().len(), desk.requested()), (before + 1, last), "{on_shutdown}");
        assert!(desk.gateway.is_finished());
    }
    let mut without = settings("", PROFILE).gateway;
    without.command = None;
    assert!(Gateway::new(without, LinkState::Up, at_ms(0)).is_finished());
}

#[test]
fn a_dry_run_shows_frames_and_sends_none_whatever_the_configuration() {
    let live = settings("tx = \"on\"", PROFILE).gateway;
    for dry in [settings("", PROFILE).gateway, live.clone().dry()] {
        let mut desk = VirtualGateway::new(dry);
        desk.drive(500, 0, &[(mode, AUTONOMOUS), (turn, LEFT), (hazard, 1)]);
        assert!(desk.sent().is_empty());
        let shown: Vec<_> = desk.would_send().into_iter().filter(|(_, is_news)| *is_news).collect();
        let shown: Vec<_> = shown.iter().map(|(frame, _)| request_text(frame.data())).collect();
        assert_eq!(shown.last(), Some(&"left"));
        assert!(desk.would_send().len() > shown.len());
    }
    let mut live = VirtualGateway::new(live);
    live.drive(500, 0, &[(mode, AUTONOMOUS), (turn, LEFT), (hazard, 1)]);
    assert!(live.would_send().is_empty() && !live.sent().is_empty());
}

#[test]
fn where_the_decider_is_the_source_it_alone_commands_the_turn_and_may_request_hazard_lights() {
    let keys = "tx = \"on\"\nsource = \"decider\"\n[turn_signal]\nenabled = true\nmap = \"map.osm\"";
    let mut desk = VirtualGateway::new(settings(keys, PROFILE).gateway);
    // It has no inputs, so it commands NO_COMMAND ten times a second; the topic is not read.
    desk.drive(500, 0, &[(mode, AUTONOMOUS), (turn, LEFT)]);
    assert_eq!(desk.requested(), "-");
    let value = |desk: &VirtualGateway, key| desk.value("turn_indicators_command", key);
    assert_eq!((value(&desk, "commands"), value(&desk, "no_command")), ("5".to_owned(), "5".to_owned()));
    desk.handle(PlannerInput::HazardRequest(HazardCommand::Enable));
    desk.drive(200, 0, &[(mode, AUTONOMOUS)]);
    assert_eq!(desk.requested(), "hazard, any turn");
    // Off on the topic does not beat on of the decider, on of either is on.
    desk.drive(200, 0, &[(mode, AUTONOMOUS), (hazard, 1)]);
    assert_eq!(desk.requested(), "hazard, any turn");
    desk.drive(2_500, 0, &[(mode, AUTONOMOUS), (hazard, 1)]);
    assert_eq!(desk.requested(), "any turn");
    desk.drive(200, 0, &[(mode, AUTONOMOUS), (hazard, ON)]);
    assert_eq!(desk.requested(), "hazard, any turn");
}

/// Twenty metres before a turn to the left; then nothing of the localisation for longer than its limit, but
/// for shorter than the limit of a command, which the last one outlasts.
#[test]
fn a_gap_of_the_odometry_commands_no_off() {
    let keys = "tx = \"on\"\nsource = \"decider\"\n[turn_signal]\nenabled = true\nmap = \"map.osm\"";
    let mut desk = VirtualGateway::new(settings(keys, PROFILE).gateway);
    desk.handle(route(1, &[1, 2, 3]));
    let mut stay = |ms: u64, state: u8, is_located: bool| {
        let before = desk.sent().len();
        for _ in 0..ms / 100 {
            if is_located {
                desk.odometry(36.0, 5.0);
            }
            desk.drive(100, state, &[(mode, AUTONOMOUS), (hazard, 1)]);
        }
        desk.sent()[before..].iter().map(|(_, frame, _)| request_text(frame.data())).collect::<Vec<_>>()
    };
    assert_eq!(stay(300, 0, true).last(), Some(&"left"));
    let mut requests = stay(1_000, 1, true);
    requests.extend(stay(700, 1, false));
    requests.extend(stay(1_000, 1, true));
    requests.dedup();
    assert_eq!(requests, ["left"]);
}
