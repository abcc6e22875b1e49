//! A vehicle made of a few lines of profile, driven on virtual time.

use std::io;
use std::path::Path;

use signal_gateway::config::files::Files;
use signal_gateway::config::{Overrides, Settings, load};
use signal_gateway::core::diagnostics::Level;
use signal_gateway::core::event::{BusIndex, Input, LinkState, Output};
use signal_gateway::core::frame::{CanId, Frame};
use signal_gateway::core::gateway::Gateway;
use signal_gateway::core::time::{MonoTime, Now, WallStamp};

/// One byte each; `LAMPS` has two bits a side: 0 dark, 1 lit, 2 fault, 3 not available.
pub(crate) const DBC: &str = "\
BO_ 256 LAMPS: 1 X
 SG_ LEFT : 0|2@1+ (1,0) [0|3] \"\" X
 SG_ RIGHT : 2|2@1+ (1,0) [0|3] \"\" X
BO_ 257 STALK: 1 X
 SG_ POSITION : 0|3@1+ (1,0) [0|7] \"\" X
BO_ 258 BODY: 1 X
 SG_ STATE : 0|3@1+ (1,0) [0|7] \"\" X
BO_ 259 PANEL: 1 X
 SG_ BUTTON : 0|2@1+ (1,0) [0|3] \"\" X
BO_ 260 ALIVE: 1 X
";
pub(crate) const LAMPS: u16 = 256;
pub(crate) const STALK: u16 = 257;
pub(crate) const BODY: u16 = 258;
pub(crate) const PANEL: u16 = 259;
pub(crate) const ALIVE: u16 = 260;

pub(crate) const DARK: u8 = 0;
pub(crate) const LEFT: u8 = 0b0001;
pub(crate) const RIGHT: u8 = 0b0100;
pub(crate) const BOTH: u8 = 0b0101;

/// Keys of the lamps in `LAMPS`.
pub(crate) fn lamp_keys(both_on: &str, lamp: &str) -> String {
    let side = |name: &str| {
        format!("{{ signal = \"LAMPS.{name}\", on = [1], off = [0], fault = [2], not_available = [3] }}")
    };
    let (left, right) = (side("LEFT"), side("RIGHT"));
    format!(
        "kind = \"lamp\"\nleft_signal = {left}\nright_signal = {right}\nboth_on = \"{both_on}\"\n\
         lamp = {{ {lamp} }}\n"
    )
}

/// Keys of the stalk in `STALK`.
pub(crate) const STALK_KEYS: &str = "\
kind = \"stalk\"
signal = \"STALK.POSITION\"
idle = [0]
left_half = [1]
left_full = [2]
right_half = [3]
right_full = [4]
not_available = [5]
";
/// Keys of the state in `BODY`.
pub(crate) const STATE_KEYS: &str = "\
signal = \"BODY.STATE\"
off = [0]
left = [1]
right = [2]
not_available = [7]
";
pub(crate) const UNBOUND: &str = "[hazard]\nfrom = \"unbound\"\n";

/// A whole profile: `lights` are `[turn]`, `[hazard]` and `[message.*]`.
pub(crate) fn profile(lights: &str) -> String {
    format!("name = \"car\"\n[bus.body]\ndbc = \"car.dbc\"\nalive_by = [\"ALIVE\"]\n{lights}")
}

pub(crate) const GATEWAY: &str =
    "profile = \"profile.toml\"\n[reports]\npublish = \"on_change\"\n[can.body]\ninterface = \"can0\"\n";

struct Texts(String);

impl Files for Texts {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        match path.to_str() {
            Some("gateway.toml") => Ok(GATEWAY.into()),
            Some("profile.toml") => Ok(self.0.clone().into()),
            Some("car.dbc") => Ok(DBC.into()),
            _ => Err(io::ErrorKind::NotFound.into()),
        }
    }
}

pub(crate) fn settings(lights: &str) -> Settings {
    let texts = Texts(profile(lights));
    load(&texts, Path::new("gateway.toml"), &Overrides::default())
        .unwrap_or_else(|refused| panic!("{refused}\n{}", texts.0))
}

/// The gateway in that vehicle and all it said.
pub(crate) struct Car {
    gateway: Gateway,
    now_ns: u64,
    /// Changes of the reports: ms, and the constant's name or `stops`.
    pub(crate) turn: Vec<(u64, &'static str)>,
    pub(crate) hazard: Vec<(u64, &'static str)>,
    /// Changes of the statuses of the reports: ms, task, level, message.
    pub(crate) said: Vec<(u64, &'static str, Level, String)>,
}

fn now(ns: u64) -> Now {
    let wall = WallStamp::from_nanos(i64::try_from(ns).unwrap());
    Now { mono: MonoTime::from_nanos(ns), wall }
}

impl Car {
    pub(crate) fn new(lights: &str) -> Self {
        let gateway = Gateway::new(settings(lights).gateway, LinkState::Up, now(0));
        let mut car = Self { gateway, now_ns: 0, turn: vec![], hazard: vec![], said: vec![] };
        car.listen();
        car
    }

    /// Lets time pass until `ms`; the gateway is called whenever it asked for it.
    pub(crate) fn wait(&mut self, ms: u64) {
        let until = ms * 1_000_000;
        loop {
            let wanted = self.gateway.next_deadline(MonoTime::from_nanos(self.now_ns)).as_nanos();
            assert!(wanted > self.now_ns, "a deadline that does not move");
            if wanted > until {
                break;
            }
            self.now_ns = wanted;
            self.gateway.handle(Input::Deadline, now(wanted));
            self.listen();
        }
        self.now_ns = until;
    }

    /// A frame at `ms`.
    pub(crate) fn frame(&mut self, id: u16, byte: u8, ms: u64) {
        self.wait(ms);
        let frame = Frame::classic(CanId::Standard(id), &[byte]).unwrap();
        let now = now(self.now_ns);
        self.gateway.handle(Input::Frame { bus: BusIndex(0), frame, stamp: now.wall }, now);
        self.listen();
    }

    /// A frame every `period` ms with what `byte` says at that time.
    pub(crate) fn frames(
        &mut self,
        id: u16,
        period: u64,
        span: std::ops::Range<u64>,
        byte: impl Fn(u64) -> u8,
    ) {
        for ms in span.step_by(usize::try_from(period).unwrap()) {
            self.frame(id, byte(ms), ms);
        }
    }

    /// What was published on the turn topic, in order.
    pub(crate) fn turns(&self) -> Vec<&'static str> {
        self.turn.iter().map(|(_, state)| *state).collect()
    }

    pub(crate) fn hazards(&self) -> Vec<&'static str> {
        self.hazard.iter().map(|(_, state)| *state).collect()
    }

    /// Level and message of a task now.
    pub(crate) fn status(&self, task: &str) -> (Level, String) {
        let statuses = self.gateway.statuses(MonoTime::from_nanos(self.now_ns));
        let status = statuses.into_iter().find(|status| status.name.ends_with(task)).unwrap();
        (status.level, status.message)
    }

    /// A key of a task's status now.
    pub(crate) fn value(&self, task: &str, key: &str) -> String {
        let statuses = self.gateway.statuses(MonoTime::from_nanos(self.now_ns));
        let status = statuses.into_iter().find(|status| status.name.ends_with(task)).unwrap();
        status.values.into_iter().find(|(name, _)| *name == key).unwrap().1
    }

    /// Whether a status with this level and message was ever sent.
    pub(crate) fn was_said(&self, task: &str, level: Level, message: &str) -> bool {
        self.said.iter().any(|(_, of, at, text)| *of == task && *at == level && text == message)
    }

    fn listen(&mut self) {
        let ms = self.now_ns / 1_000_000;
        while let Some(output) = self.gateway.poll_output() {
            match output {
                Output::TurnIndicators { report, .. } => self.turn.push((ms, report.name())),
                Output::HazardLights { report, .. } => self.hazard.push((ms, report.name())),
                Output::WithdrawTurnIndicators => self.turn.push((ms, "stops")),
                Output::WithdrawHazardLights => self.hazard.push((ms, "stops")),
                Output::TrafficLights(_) => panic!("no traffic lights here"),
                Output::TurnCommand { .. } | Output::HazardCommand { .. } => panic!("no decider here"),
                Output::Diagnostics { diagnostics, .. } => {
                    for status in diagnostics.statuses.into_iter().filter(|_| !diagnostics.refresh) {
                        for task in ["turn_indicators", "hazard_lights"] {
                            if status.name.ends_with(task) {
                                self.said.push((ms, task, status.level, status.message.clone()));
                            }
                        }
                    }
                }
            }
        }
    }
}
