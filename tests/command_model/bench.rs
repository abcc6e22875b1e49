//! A configuration with an invented vehicle, and its command flow on virtual time.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::time::Duration;

use signal_gateway::config::command::CommandConfig;
use signal_gateway::config::files::Files;
use signal_gateway::config::{Overrides, Settings, load};
use signal_gateway::core::bus::{Bus, BusSettings};
use signal_gateway::core::command::Reported;
use signal_gateway::core::command::allow_list::CommandFrame;
use signal_gateway::core::command::flow::{CommandFlow, Outgoing};
use signal_gateway::core::diagnostics::Level;
use signal_gateway::core::event::LinkState;
use signal_gateway::core::frame::Frame;
use signal_gateway::core::time::{MonoTime, Now, WallStamp};

/// Sent every 100 ms, three times 20 ms apart after a change, never closer than 10 ms.
pub(crate) const PROFILE: &str = r#"name = "Bench"
bus.body.dbc = "bench.dbc"
message.STATE.timeout_ms = 500
[turn]
signal = "STATE.TURN"
off = [0]
left = [1]
right = [2]
[hazard]
from = "signal"
signal = "STATE.HAZARD"
on = [1]
off = [0]
[[command.message]]
name = "CMD"
period_ms = 100
burst = 3
burst_gap_ms = 20
unused_bits = 1
constants = { DOOR = 2 }
enable = { on = { ENABLE = 1 }, off = { ENABLE = 0 } }
turn.none = { TURN_REQ = 7 }
turn.off = { TURN_REQ = 0 }
turn.left = { TURN_REQ = 1 }
turn.right = { TURN_REQ = 2 }
hazard.none = { HAZARD_REQ = -1 }
hazard.off = { HAZARD_REQ = 0 }
hazard.on = { HAZARD_REQ = 1 }
counter = { signal = "COUNT" }
checksum = { kind = "j1850", signal = "CRC" }
[[command.driver]]
signal = "STATE.OVERRIDE"
on = [1]
off = [0]
takes = "turn"
[command.control_mode]
signal = "STATE.MODE"
autonomous = [1]
velocity_only = [2]
manual = [0]
"#;

pub(crate) const DBC: &str = r#"BO_ 304 CMD: 8 X
 SG_ ENABLE : 0|1@1+ (1,0) [0|1] "" X
 SG_ DOOR : 1|2@1+ (1,0) [0|3] "" X
 SG_ TURN_REQ : 10|3@0+ (1,0) [0|7] "" X
 SG_ HAZARD_REQ : 12|2@1- (1,0) [-2|1] "" X
 SG_ COUNT : 48|4@1+ (1,0) [0|15] "" X
 SG_ CRC : 56|8@1+ (1,0) [0|255] "" X
BO_ 560 STATE: 4 X
 SG_ TURN : 0|2@1+ (1,0) [0|3] "" X
 SG_ HAZARD : 2|2@1+ (1,0) [0|3] "" X
 SG_ OVERRIDE : 4|1@1+ (1,0) [0|1] "" X
 SG_ MODE : 5|2@1+ (1,0) [0|3] "" X
BO_ 305 BUTTON: 1 X
 SG_ PRESSED : 0|1@1+ (1,0) [0|1] "" X
BO_ 307 SEALED: 8 X
 SG_ SEALED_CRC : 0|8@1+ (1,0) [0|255] "" X
 SG_ SEALED_COUNT : 8|4@1+ (1,0) [0|15] "" X
 SG_ SEALED_REQ : 16|3@1+ (1,0) [0|7] "" X
BO_ 306 TURN_ONLY: 1 X
 SG_ TURN_ONLY_REQ : 0|2@1+ (1,0) [0|3] "" X
"#;

#[derive(Debug)]
pub(crate) struct Texts(pub(crate) BTreeMap<&'static str, String>);

impl Files for Texts {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let text = self.0.get(path.display().to_string().as_str());
        text.map(|text| text.clone().into_bytes()).ok_or_else(|| io::ErrorKind::NotFound.into())
    }
}

/// The configuration with these lines in its `[command]`.
pub(crate) fn config(command: &str, profile: &str) -> CommandConfig {
    settings(command, profile).command.unwrap()
}

/// Likewise, all of it. `map.osm` is there for a `[turn_signal]` that may follow.
pub(crate) fn settings(command: &str, profile: &str) -> Settings {
    let gateway = format!("profile = \"bench.toml\"\ncan.body.interface = \"can0\"\n[command]\n{command}\n");
    let map = include_str!("../maps/crossroads.osm").to_owned();
    let (profile, dbc) = (profile.to_owned(), DBC.to_owned());
    let files = [("gateway.toml", gateway), ("bench.toml", profile), ("bench.dbc", dbc), ("map.osm", map)];
    let settings = load(&Texts(files.into()), Path::new("gateway.toml"), &Overrides::default());
    settings.unwrap_or_else(|refused| panic!("{refused}"))
}

pub(crate) fn now(ns: u64) -> Now {
    let wall = 1_700_000_000_000_000_000 + i64::try_from(ns).unwrap();
    Now { mono: MonoTime::from_nanos(ns), wall: WallStamp::from_nanos(wall) }
}

/// What a frame of `CMD` asks for, read by hand: `-` = it has no authority.
pub(crate) fn asks(data: &[u8]) -> &'static str {
    assert_eq!((data[0] & 0xFE, data[2], data[6] >> 4), (0xFC, 0xFF, 0xF), "background and constants");
    match (data[0] & 1, data[1] & 7, data[1] >> 4 & 3) {
        (0, 7, 3) => "-",
        (1, 0, 1) => "hazard",
        (1, 7, 1) => "hazard, any turn",
        (1, 0, 0) => "off",
        (1, 1, 0) => "left",
        (1, 2, 0) => "right",
        (1, 7, 0) => "any turn",
        (1, 0, 3) => "off, any hazard",
        (1, 1, 3) => "left, any hazard",
        (1, 2, 3) => "right, any hazard",
        other => panic!("{other:?}"),
    }
}

/// A flow on its bus, and all frames it has sent.
pub(crate) struct Bench {
    pub(crate) flow: CommandFlow,
    pub(crate) buses: Vec<Bus>,
    pub(crate) now_ns: u64,
    /// When, and what.
    pub(crate) sent: Vec<(u64, Frame)>,
    pub(crate) would_send: Vec<Frame>,
}

impl Bench {
    pub(crate) fn new(config: CommandConfig) -> Self {
        let bus = BusSettings {
            name: "body".to_owned(),
            interface: "can0".to_owned(),
            alive_by: Vec::new(),
            alive_timeout: Duration::from_secs(1),
            may_sleep: false,
        };
        let flow = CommandFlow::new(config.settings, config.binding, now(0));
        let buses = vec![Bus::new(bus, LinkState::Up)];
        Self { flow, buses, now_ns: 0, sent: Vec::new(), would_send: Vec::new() }
    }

    pub(crate) fn now(&self) -> Now {
        now(self.now_ns)
    }

    /// Settles and takes the frames that come of it.
    pub(crate) fn settle(&mut self) -> Vec<CommandFrame> {
        self.flow.settle(&self.buses, self.now());
        let mut given = Vec::new();
        while let Some(outgoing) = self.flow.poll_output() {
            match outgoing {
                Outgoing::Send { frame, .. } => {
                    self.sent.push((self.now_ns, *frame.frame()));
                    given.push(frame);
                }
                Outgoing::WouldSend { frame, .. } => self.would_send.push(frame),
            }
        }
        given
    }

    /// Lets time go by, and settles whenever the flow wants it.
    pub(crate) fn pass_until(&mut self, until_ns: u64) {
        while let Some(at) = self.flow.next_deadline(self.now().mono).map(MonoTime::as_nanos) {
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
        let now = self.now();
        self.flow.turn_command(raw, now.wall, now);
    }

    pub(crate) fn hazard(&mut self, raw: u8) {
        let now = self.now();
        self.flow.hazard_command(raw, now.wall, now);
    }

    pub(crate) fn mode(&mut self, raw: u8) {
        let now = self.now();
        self.flow.control_mode(raw, now.wall, now);
    }

    pub(crate) fn report(&mut self, reported: Reported) {
        self.flow.report(reported);
    }

    /// What the newest frame asks for.
    pub(crate) fn asked(&self) -> &'static str {
        self.sent.last().map_or("no frame", |(_, frame)| asks(frame.data()))
    }

    /// Level and message of each task, in order.
    pub(crate) fn said(&self) -> Vec<(Level, String)> {
        let statuses = self.flow.statuses("gateway", &self.buses, self.now().mono);
        statuses.into_iter().map(|status| (status.level, status.message)).collect()
    }
}
