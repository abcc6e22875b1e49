//! Commands among the other flows of the gateway: what goes in as inputs comes out as frames and statuses.

use signal_gateway::core::command::sender::SendFailure;
use signal_gateway::core::diagnostics::Level;
use signal_gateway::core::event::{BusIndex, Input, LinkState, Output};
use signal_gateway::core::frame::{CanId, Frame};
use signal_gateway::core::gateway::{Gateway, GatewaySettings};
use signal_gateway::core::time::MonoTime;
use signal_gateway::core::turn_signal::signal::Hazard;
use signal_gateway::core::turn_signal::told::Told;

use crate::bench::{PROFILE, asks, now, settings};

const MS: u64 = 1_000_000;
const BUS: BusIndex = BusIndex(0);
const CMD: CanId = CanId::Standard(304);
const STATE: CanId = CanId::Standard(560);
const AUTONOMOUS: u8 = 1;
const MANUAL: u8 = 4;
const LEFT: u8 = 2;
const ON: u8 = 2;

/// An input and its raw value.
type Word = (fn(u8) -> Input, u8);

/// A gateway, and what it has given out.
struct Desk {
    gateway: Gateway,
    now_ms: u64,
    /// When, what it asks for, whether it said something new.
    sent: Vec<(u64, Frame, bool)>,
    would_send: Vec<(u64, Frame, bool)>,
    /// Every status that was said as news: when, its task, level and words.
    said: Vec<(u64, String, Level, String)>,
    /// Frames for which there is no room until then.
    full_until_ms: u64,
}

impl Desk {
    fn new(settings: GatewaySettings) -> Self {
        let gateway = Gateway::new(settings, LinkState::Up, now(0));
        let (sent, would_send, said) = (Vec::new(), Vec::new(), Vec::new());
        let mut desk = Self { gateway, now_ms: 0, sent, would_send, said, full_until_ms: 0 };
        desk.drain();
        desk
    }

    fn live(command: &str) -> Self {
        Self::new(settings(&format!("tx = \"on\"\n{command}"), PROFILE).gateway)
    }

    fn drain(&mut self) {
        while let Some(output) = self.gateway.poll_output() {
            match output {
                Output::Transmit { frame, .. } if self.now_ms < self.full_until_ms => {
                    self.gateway.not_sent(&frame, SendFailure::QueueFull, now(self.now_ms * MS));
                }
                Output::Transmit { frame, is_news } => {
                    self.sent.push((self.now_ms, *frame.frame(), is_news));
                }
                Output::WouldTransmit { frame, is_news, .. } => {
                    self.would_send.push((self.now_ms, frame, is_news));
                }
                Output::Diagnostics { diagnostics, .. } if !diagnostics.refresh => {
                    for status in diagnostics.statuses {
                        let task = status.name.split(": ").nth(1).unwrap().to_owned();
                        self.said.push((self.now_ms, task, status.level, status.message));
                    }
                }
                Output::Diagnostics { .. }
                | Output::TurnIndicators { .. }
                | Output::HazardLights { .. }
                | Output::WithdrawTurnIndicators
                | Output::WithdrawHazardLights
                | Output::TrafficLights(_)
                | Output::TurnCommand { .. }
                | Output::HazardCommand { .. }
                | Output::Decision(_) => {}
            }
        }
    }

    fn tell(&mut self, input: Input) {
        self.gateway.handle(input, now(self.now_ms * MS));
        self.drain();
    }

    /// `STATE` with this data, commands and mode every 100 ms for a while.
    fn pass(&mut self, ms: u64, state: u8, words: &[Word]) {
        let until = self.now_ms + ms;
        while self.now_ms < until {
            self.tell(frame(STATE, &[state, 0, 0, 0]));
            for (word, raw) in words {
                self.tell(word(*raw));
            }
            let next = self.now_ms + 100;
            loop {
                let at = self.gateway.next_deadline(MonoTime::from_millis(self.now_ms));
                let at_ms = at.as_nanos().div_ceil(MS);
                if at_ms >= next {
                    break;
                }
                self.now_ms = at_ms.max(self.now_ms);
                self.tell(Input::Deadline);
            }
            self.now_ms = next;
        }
    }

    fn asked(&self) -> &'static str {
        self.sent.last().map_or("no frame", |(_, frame, _)| asks(frame.data()))
    }

    /// What was said of a task as news.
    fn news(&self, task: &str) -> Vec<(Level, &str)> {
        let of_task = self.said.iter().filter(|(_, name, ..)| name == task);
        of_task.map(|(_, _, level, message)| (*level, message.as_str())).collect()
    }

    fn value(&self, task: &str, key: &str) -> String {
        let statuses = self.gateway.statuses(MonoTime::from_millis(self.now_ms));
        let status = statuses.iter().find(|status| status.name.ends_with(task)).unwrap();
        status.values.iter().find(|(name, _)| *name == key).unwrap().1.clone()
    }
}

fn frame(id: CanId, data: &[u8]) -> Input {
    Input::Frame { bus: BUS, frame: Frame::classic(id, data).unwrap(), stamp: now(0).wall }
}

fn turn(raw: u8) -> Input {
    Input::TurnCommand { raw, stamp: now(0).wall }
}

fn hazard(raw: u8) -> Input {
    Input::HazardCommand { raw, stamp: now(0).wall }
}

fn mode(raw: u8) -> Input {
    Input::ControlMode { raw, stamp: now(0).wall }
}

#[test]
fn what_is_received_for_commands_passes_the_kernels_filters() {
    let mut settings = settings("", PROFILE).gateway;
    assert_eq!(settings.relevant_ids(BUS), [CMD, STATE]);
    settings.lights.table.messages.clear();
    assert_eq!(settings.relevant_ids(BUS), [CMD, STATE], "the driver's signs and the mode");
    settings.command = None;
    assert_eq!(settings.relevant_ids(BUS), []);
}

#[test]
fn a_command_is_a_frame_at_once_and_the_report_proves_it() {
    let mut desk = Desk::live("");
    desk.pass(500, 0, &[(mode, AUTONOMOUS), (turn, 1), (hazard, 1)]);
    assert_eq!(desk.asked(), "off");
    let before = desk.sent.len();
    desk.tell(turn(LEFT));
    let (at, _, is_news) = desk.sent[before];
    assert_eq!((desk.asked(), at, is_news), ("left", 500, true));
    let words: &[Word] = &[(mode, AUTONOMOUS), (turn, LEFT), (hazard, 1)];
    desk.pass(200, 0, words);
    desk.pass(1_000, 1, words);
    assert!(desk.sent[before + 1..].iter().all(|(_, _, is_news)| !is_news));
    assert_eq!(desk.value("turn_indicators_command", "reported"), "left");
    // The lamps go out though left is commanded: both values, as soon as each limit is over.
    let dark = desk.now_ms;
    desk.pass(4_000, 0, words);
    let said = desk.said.iter().filter(|(at, task, ..)| *at > dark && task == "turn_indicators_command");
    let said: Vec<_> = said.map(|(at, _, level, text)| (at - dark, *level, text.as_str())).collect();
    let late = (1_501, Level::Warn, "commanded left, but the vehicle reports off still");
    let never = (3_001, Level::Error, "commanded left, but the vehicle reports off");
    assert_eq!(said, [late, never]);
}

#[test]
fn in_manual_mode_and_on_a_lost_link_nothing_has_authority() {
    let mut desk = Desk::live("");
    desk.pass(500, 0, &[(mode, MANUAL), (turn, LEFT), (hazard, ON)]);
    assert!(desk.sent.len() > 4 && desk.sent.iter().all(|(_, frame, _)| asks(frame.data()) == "-"));
    desk.pass(500, 0, &[(mode, AUTONOMOUS), (turn, LEFT), (hazard, ON)]);
    assert_eq!(desk.asked(), "hazard");
    let before = desk.sent.len();
    desk.tell(Input::Link { bus: BUS, state: LinkState::Down });
    desk.pass(500, 0, &[(mode, AUTONOMOUS), (turn, LEFT), (hazard, ON)]);
    assert_eq!(desk.sent.len(), before);
    assert!(desk.news("command_transmission").contains(&(Level::Error, "nothing can be sent on body")));
    desk.tell(Input::Link { bus: BUS, state: LinkState::Up });
    assert_eq!((desk.sent.len(), desk.asked()), (before + 1, "hazard"), "at once");
}

#[test]
fn frames_with_our_identifier_are_not_the_vehicles() {
    let mut desk = Desk::live("");
    desk.tell(mode(AUTONOMOUS));
    let own = desk.sent.last().unwrap().1;
    for _ in 0..2 {
        desk.tell(Input::Frame { bus: BUS, frame: own, stamp: now(0).wall });
    }
    assert_eq!(desk.value("command_transmission", "echoed"), "CMD 1");
    assert_eq!(desk.value("command_transmission", "foreign"), "CMD 1");
    assert!(desk.news("command_transmission").contains(&(Level::Error, "somebody else sends CMD as well")));
    // Neither is a sign of life of the bus.
    assert_eq!(desk.value("can0", "frames"), "0");
}

#[test]
fn frames_without_room_leave_no_gap_in_the_counter() {
    let mut desk = Desk::live("");
    let words: &[Word] = &[(mode, AUTONOMOUS), (turn, LEFT), (hazard, 1)];
    desk.pass(500, 1, words);
    desk.full_until_ms = 590;
    desk.pass(500, 1, words);
    let counters: Vec<_> = desk.sent.iter().map(|(_, frame, _)| frame.data()[6] & 15).collect();
    assert!(counters.windows(2).all(|pair| pair[1] == (pair[0] + 1) % 16), "{counters:?}");
    assert!(desk.news("command_transmission").contains(&(Level::Warn, "frames are delayed")));
    assert_ne!(desk.value("command_transmission", "queue_full"), "CMD 0");
}

#[test]
fn a_stop_is_one_last_frame_with_the_state_for_it() {
    for (at_stop, last) in [("release", "-"), ("off", "off"), ("hazard", "hazard")] {
        let mut desk = Desk::live(&format!("at_stop = \"{at_stop}\""));
        let words: &[Word] = &[(mode, AUTONOMOUS), (turn, LEFT), (hazard, 1)];
        desk.pass(200, 0, words);
        desk.pass(300, 1, words);
        let before = desk.sent.len();
        assert!(!desk.gateway.is_finished());
        desk.tell(Input::Stop);
        desk.pass(500, 1, words);
        assert_eq!((desk.sent.len(), desk.asked()), (before + 1, last), "{at_stop}");
        assert!(desk.gateway.is_finished());
    }
    let mut without = settings("", PROFILE).gateway;
    without.command = None;
    assert!(Gateway::new(without, LinkState::Up, now(0)).is_finished());
}

#[test]
fn a_dry_run_tells_and_sends_nothing_whatever_the_configuration_says() {
    let wanted = settings("tx = \"on\"", PROFILE).gateway;
    for dry in [settings("", PROFILE).gateway, wanted.clone().dry()] {
        let mut desk = Desk::new(dry);
        desk.pass(500, 0, &[(mode, AUTONOMOUS), (turn, LEFT), (hazard, 1)]);
        assert!(desk.sent.is_empty());
        let told: Vec<_> = desk.would_send.iter().filter(|(_, _, is_news)| *is_news).collect();
        let told: Vec<_> = told.into_iter().map(|(_, frame, _)| asks(frame.data())).collect();
        assert_eq!(told.last(), Some(&"left"));
        assert!(desk.would_send.len() > told.len());
    }
    let mut live = Desk::new(wanted);
    live.pass(500, 0, &[(mode, AUTONOMOUS), (turn, LEFT), (hazard, 1)]);
    assert!(live.would_send.is_empty() && !live.sent.is_empty());
}

#[test]
fn where_the_decider_is_the_source_it_alone_commands_the_turn_and_may_ask_for_hazard_lights() {
    let keys = "tx = \"on\"\nsource = \"decider\"\n[turn_signal]\nenabled = true\nmap = \"map.osm\"";
    let mut desk = Desk::new(settings(keys, PROFILE).gateway);
    // It has nothing to go by, so it says NO_COMMAND ten times a second; the topic is not listened to.
    desk.pass(500, 0, &[(mode, AUTONOMOUS), (turn, LEFT)]);
    assert_eq!(desk.asked(), "-");
    let value = |desk: &Desk, key| desk.value("turn_indicators_command", key);
    assert_eq!((value(&desk, "commands"), value(&desk, "no_command")), ("5".to_owned(), "5".to_owned()));
    desk.tell(Input::Told(Told::HazardRequest(Hazard::Enable)));
    desk.pass(200, 0, &[(mode, AUTONOMOUS)]);
    assert_eq!(desk.asked(), "hazard, any turn");
    // Off on the topic does not beat on of the decider, on of either is on.
    desk.pass(200, 0, &[(mode, AUTONOMOUS), (hazard, 1)]);
    assert_eq!(desk.asked(), "hazard, any turn");
    desk.pass(2_500, 0, &[(mode, AUTONOMOUS), (hazard, 1)]);
    assert_eq!(desk.asked(), "any turn");
    desk.pass(200, 0, &[(mode, AUTONOMOUS), (hazard, ON)]);
    assert_eq!(desk.asked(), "hazard, any turn");
}
