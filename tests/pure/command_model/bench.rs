//! A configuration with an invented vehicle, and its command flow on virtual time.

use std::time::Duration;

use can_signal::can::bus::{Bus, BusSettings};
use can_signal::can::frame::Frame;
use can_signal::can::link::LinkState;
use can_signal::validation::table::SignalTable;
use gateway_base::diagnostics::Level;
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::command::Reported;
use gateway_core::command::allow_list::CommandFrame;
use gateway_core::command::flow::CommandFlow;
use gateway_core::command::input::CommandInput;
use gateway_core::command::output::CommandOutput;
use signal_gateway::config::Settings;
use signal_gateway::config::gateway::command::CommandConfig;

use crate::support::clock::at_ns;
use crate::support::command_vehicle::{DBC, next_origin, next_sample, request_text};
use crate::support::files::MemoryFiles;
use crate::support::two_lanes;

/// `TurnIndicatorsCommand` of the topic, with this number.
pub(crate) fn turn(number: u8, stamp: WallStamp) -> CommandInput {
    CommandInput::Turn { origin: next_origin(), command: number.into(), stamp }
}

/// `HazardLightsCommand` of the topic, with this number.
pub(crate) fn hazard(number: u8, stamp: WallStamp) -> CommandInput {
    CommandInput::Hazard { origin: next_origin(), command: number.into(), stamp }
}

/// `ControlModeReport` with this number.
pub(crate) fn mode(number: u8, stamp: WallStamp) -> CommandInput {
    CommandInput::ControlMode { sample: next_sample(), mode: number.into(), stamp }
}

/// The configuration with these lines in its `[command]`.
pub(crate) fn config(command: &str, profile: &str) -> CommandConfig {
    settings(command, profile).command.unwrap()
}

/// Likewise, all of it. `map.osm` is there for a `[turn_signal]` that may follow.
pub(crate) fn settings(command: &str, profile: &str) -> Settings {
    let gateway = format!("profile = \"bench.toml\"\ncan.body.interface = \"can0\"\n[command]\n{command}\n");
    let files = MemoryFiles::new([("bench.dbc", DBC), ("bench.toml", profile)]);
    files.with("gateway.toml", gateway).with("map.osm", two_lanes::osm([0, 60, 80, 200])).settings()
}

/// A flow on its bus, and all frames it has sent.
pub(crate) struct Bench {
    pub(crate) flow: CommandFlow,
    pub(crate) buses: Vec<Bus>,
    pub(crate) now_ns: u64,
    /// How far the clock of this host is ahead, in ns.
    pub(crate) clock_ahead_ns: i64,
    /// When, and what.
    pub(crate) sent: Vec<(u64, Frame)>,
    pub(crate) would_send: Vec<Frame>,
}

impl Bench {
    pub(crate) fn new(config: CommandConfig) -> Self {
        let bus = BusSettings {
            name: "body".to_owned(),
            interface: "can0".to_owned(),
            heartbeat_messages: Vec::new(),
            alive_timeout: Duration::from_secs(1),
            wake_up_timeout: Duration::from_secs(1),
            start_timeout: Duration::from_secs(2),
            may_sleep: false,
        };
        let flow = CommandFlow::new(config.settings, config.binding, at_ns(0));
        let buses = vec![Bus::new(bus, LinkState::Up)];
        Self { flow, buses, now_ns: 0, clock_ahead_ns: 0, sent: Vec::new(), would_send: Vec::new() }
    }

    pub(crate) fn now(&self) -> Now {
        let now = at_ns(self.now_ns);
        Now { wall: WallStamp::from_nanos(now.wall.as_nanos().saturating_add(self.clock_ahead_ns)), ..now }
    }

    /// Settles and takes the frames that come of it.
    pub(crate) fn settle(&mut self) -> Vec<CommandFrame> {
        self.flow.settle(&self.buses, self.now());
        let mut given = Vec::new();
        while let Some(outgoing) = self.flow.poll_output() {
            match outgoing {
                CommandOutput::Transmit { frame, .. } => {
                    self.sent.push((self.now_ns, *frame.frame()));
                    given.push(frame);
                }
                CommandOutput::WouldTransmit { frame, .. } => self.would_send.push(frame),
            }
        }
        given
    }

    /// Lets time go by, and settles at each deadline of the flow.
    pub(crate) fn pass_until(&mut self, until_ns: u64) {
        while let Some(at) = self.flow.next_deadline().map(MonoTime::as_nanos) {
            assert!(at > self.now_ns, "a deadline that does not move");
            if at > until_ns {
                break;
            }
            self.now_ns = at;
            self.settle();
        }
        self.now_ns = until_ns;
    }

    pub(crate) fn turn(&mut self, raw: u8) {
        self.take(turn(raw, self.now().wall));
    }

    pub(crate) fn hazard(&mut self, raw: u8) {
        self.take(hazard(raw, self.now().wall));
    }

    pub(crate) fn mode(&mut self, raw: u8) {
        self.take(mode(raw, self.now().wall));
    }

    pub(crate) fn take(&mut self, input: CommandInput) {
        self.flow.handle_input(input, self.now());
    }

    pub(crate) fn report(&mut self, reported: Reported) {
        self.flow.handle_report(reported);
    }

    /// The request of the newest frame.
    pub(crate) fn requested(&self) -> &'static str {
        self.sent.last().map_or("no frame", |(_, frame)| request_text(frame.data()))
    }

    /// A key of a task's status, by the position of the task.
    pub(crate) fn value(&self, task: usize, key: &str) -> String {
        let status =
            self.flow.statuses(&SignalTable::default(), &self.buses, self.now().mono).swap_remove(task);
        status.values.into_iter().find(|(name, _)| *name == key).unwrap().1
    }

    /// Level and message of each task, in order.
    pub(crate) fn status_texts(&self) -> Vec<(Level, String)> {
        let statuses = self.flow.statuses(&SignalTable::default(), &self.buses, self.now().mono);
        statuses.into_iter().map(|status| (status.level, status.message)).collect()
    }
}
