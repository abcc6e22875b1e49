//! The control mode of the vehicle's own signals: what it grants, and when it does not count any more.

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_core::command::output::CommandOutput;
use gateway_core::gateway::event::Output;
use proptest::prelude::*;

use crate::pure::command_model::bench::{self, settings};
use crate::support::clock::at_ms;
use crate::support::command_vehicle::{MODE, PROFILE, request_text};
use crate::support::virtual_gateway::VirtualGateway;

const STATE: CanId = CanId::Standard(560);
const SIGNALS: &str = "tx = \"on\"\ncontrol_mode = \"signal\"";
/// Of the message with the mode.
const TIMEOUT_MS: u64 = 500;
/// The mode's bits of it.
const AUTONOMOUS: u8 = 1;
const VELOCITY_ONLY: u8 = 2;

fn live(keys: &str, mode: &str) -> VirtualGateway {
    VirtualGateway::new(settings(keys, &format!("{PROFILE}{mode}")).gateway)
}

impl VirtualGateway {
    /// Left, hazard lights off, and a mode of the topic, which does not count.
    fn command_left(&mut self) {
        for input in [bench::turn(2, at_ms(0).wall), bench::hazard(1, at_ms(0).wall)] {
            self.handle(input);
        }
        self.handle(bench::mode(AUTONOMOUS, at_ms(0).wall));
    }

    /// The mode's frame, if there is one, and commands, each 100 ms.
    fn pass_with(&mut self, ms: u64, mode: Option<u8>) {
        for _ in 0..ms / 100 {
            if let Some(mode) = mode {
                self.receive(STATE, &[mode << 5, 0, 0, 0]);
            }
            self.command_left();
            self.pass_without_end(100);
        }
    }

    fn last_request(&self) -> &'static str {
        self.sent().last().map_or("no frame", |(_, frame, _)| request_text(frame.data()))
    }

    fn transmission(&self) -> String {
        self.status_text("command_transmission")
    }
}

#[test]
fn a_signalled_mode_grants_commands_whether_or_not_its_topic_is_published() {
    for topics in ["", "\n[ros.topics]\ncontrol_mode_status = \"\""] {
        let mut desk = live(&format!("{SIGNALS}{topics}"), MODE);
        desk.pass_with(300, Some(AUTONOMOUS));
        assert_eq!((desk.last_request(), desk.transmission()), ("left", "OK control mode AUTONOMOUS".into()));
        desk.pass_with(300, Some(VELOCITY_ONLY));
        assert_eq!(desk.last_request(), "any turn");
        desk.pass_with(300, Some(0));
        assert_eq!((desk.last_request(), desk.transmission()), ("-", "OK control mode MANUAL".into()));
    }
}

#[test]
fn an_unusable_mode_takes_the_permission_and_diagnostics_give_its_reason() {
    let unknown = |level, reason| {
        format!("{level} control mode unknown: nothing is requested of the vehicle ({reason})")
    };
    let mut desk = live(SIGNALS, MODE);
    assert_eq!(
        desk.transmission(),
        unknown("WARN", "waiting for the first frame of STATE (230) on can0, at most 2 s")
    );
    desk.pass_with(300, Some(AUTONOMOUS));
    let undefined = unknown("ERROR", "STATE.MODE = 3 is not a defined value");
    for count in ["1", "2"] {
        desk.pass_with(300, Some(3));
        assert_eq!((desk.last_request(), desk.transmission()), ("-", undefined.clone()));
        assert_eq!(desk.value("command_transmission", "control_mode"), "undefined (3)");
        assert_eq!(desk.value("command_transmission", "undefined_control_modes"), count);
        desk.pass_with(300, Some(AUTONOMOUS));
        assert_eq!(desk.last_request(), "left");
    }
    // As long as its timeout it holds, and not a frame longer.
    desk.pass_with(400, None);
    assert_eq!(desk.last_request(), "left");
    desk.pass_with(300, None);
    assert_eq!(desk.last_request(), "-");
    assert!(
        desk.transmission().starts_with("WARN control mode unknown: nothing is requested of the vehicle (")
    );
    for (key, text) in [
        ("fault", unknown("ERROR", "STATE.MODE = 3 means fault")),
        ("not_available", unknown("WARN", "STATE.MODE = 3 means not available")),
    ] {
        let mut desk = live(SIGNALS, &format!("{MODE}{key} = [3]\n"));
        desk.pass_with(300, Some(3));
        assert_eq!((desk.last_request(), desk.transmission()), ("-", text));
    }
}

/// The mode is believed for 500 ms, and the link was lost for 100 ms.
#[test]
fn a_mode_from_before_the_link_was_lost_gives_no_authority() {
    let mut desk = live(SIGNALS, MODE);
    desk.pass_with(500, Some(AUTONOMOUS));
    assert_eq!(desk.last_request(), "left");
    let link = |state| CanInput::Link { bus: BusIndex(0), state };
    desk.handle(link(LinkState::Down));
    desk.pass_without_end(100);
    desk.handle(link(LinkState::Up));
    assert_eq!(desk.last_request(), "-");
    desk.pass_with(100, Some(AUTONOMOUS));
    assert_eq!(desk.last_request(), "left");
}

/// Commands keep real time: perception has not come so far when the mode is too old for them.
#[test]
fn a_late_mode_takes_the_permission_before_perception_has_found_it() {
    let mut desk = live(SIGNALS, MODE);
    desk.pass_with(500, Some(AUTONOMOUS));
    let last_received = desk.ms() - 100;
    for (age, request) in [(TIMEOUT_MS, "left"), (TIMEOUT_MS + 50, "-")] {
        let now = at_ms(last_received + age);
        desk.gateway.settle_commands(now);
        let frames: Vec<_> = std::iter::from_fn(|| desk.gateway.poll_output()).filter_map(frame_of).collect();
        assert_eq!(frames.last().map(|frame| request_text(frame.data())), Some(request), "{age} ms");
    }
}

fn frame_of(output: Output) -> Option<Frame> {
    let Output::Command(CommandOutput::Transmit { frame, .. }) = output else { return None };
    Some(*frame.frame())
}

/// The accelerator by wire is bit 0, the brake bit 1, and the steering either of them.
#[test]
fn half_of_an_axis_grants_nothing() {
    let axes = "[control_mode]\nsteering = { signal = \"STATE.MODE\", on = [\"1..=3\"], off = [0] }\n\
        accelerator = { signal = \"STATE.MODE\", on = [1, 3], off = [0, 2] }\n\
        brake = { signal = \"STATE.MODE\", on = [2, 3], off = [0, 1] }\n";
    for (bits, mode, request) in
        [(0, "MANUAL", "-"), (1, "NOT_READY", "-"), (2, "NOT_READY", "-"), (3, "AUTONOMOUS", "left")]
    {
        for on_unknown in ["withhold", "not_ready"] {
            let mut desk = live(SIGNALS, &format!("{axes}on_unknown = \"{on_unknown}\"\n"));
            desk.pass_with(300, Some(bits));
            let expected = (request, format!("OK control mode {mode}"));
            assert_eq!((desk.last_request(), desk.transmission()), expected, "{bits}");
            desk.pass_with(700, None);
            assert_eq!(desk.last_request(), "-", "{on_unknown}");
        }
    }
}

proptest! {
    /// Each frame has the authority that the last frame of the mode gives, as long as that is not too old.
    #[test]
    fn authority_follows_the_signalled_mode(steps in prop::collection::vec((0_u8..7, 1_u64..9), 1..40)) {
        let mut desk = live(SIGNALS, MODE);
        desk.pass_with(200, None);
        let mut modes = Vec::new();
        for (mode, tenths) in steps {
            if mode < 4 {
                modes.push((desk.ms(), mode));
                desk.pass_with(100, Some(mode));
            }
            desk.pass_with((tenths - 1) * 100, None);
        }
        let expected = |at: u64| {
            let last = modes.iter().rfind(|(received, _)| *received <= at);
            match last.filter(|(received, _)| at - received <= TIMEOUT_MS) {
                Some((_, AUTONOMOUS)) => "left",
                Some((_, VELOCITY_ONLY)) => "any turn",
                Some(_) | None => "-",
            }
        };
        let sent = desk.sent();
        prop_assert!(sent.len() as u64 >= desk.ms() / 100);
        for (at, frame, _) in sent {
            // The millisecond in which a mode becomes too old has frames of both.
            let request = request_text(frame.data());
            prop_assert!([expected(at), expected(at + 1)].contains(&request), "{} at {}", request, at);
        }
    }
}
