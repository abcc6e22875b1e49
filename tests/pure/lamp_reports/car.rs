//! A vehicle made of a few lines of profile, driven on virtual time.

use can_signal::can::frame::CanId;
use gateway_base::diagnostics::Level;
use gateway_core::gateway::GatewaySettings;

use crate::support::files::MemoryFiles;
use crate::support::virtual_gateway::{StatusChange, VirtualGateway};

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
BO_ 261 BANKS: 1 X
 SG_ LEFT : 0|1@1+ (1,0) [0|1] \"\" X
 SG_ RIGHT : 2|1@1+ (1,0) [0|1] \"\" X
 SG_ ALT_LEFT : 4|1@1+ (1,0) [0|1] \"\" X
 SG_ ALT_RIGHT : 6|1@1+ (1,0) [0|1] \"\" X
BO_ 262 FLAG: 1 X
 SG_ ALT : 0|2@1+ (1,0) [0|3] \"\" X
";
pub(crate) const LAMPS: u16 = 256;
pub(crate) const STALK: u16 = 257;
pub(crate) const BODY: u16 = 258;
pub(crate) const PANEL: u16 = 259;
pub(crate) const ALIVE: u16 = 260;
pub(crate) const BANKS: u16 = 261;
pub(crate) const FLAG: u16 = 262;

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
pub(crate) const NOT_VISIBLE: &str = "[hazard]\nfrom = \"not_visible\"\n";

/// A whole profile: `lights` are `[turn]`, `[hazard]` and `[message.*]`.
pub(crate) fn profile(lights: &str) -> String {
    format!("name = \"car\"\n[bus.body]\ndbc = \"car.dbc\"\nheartbeat_messages = [\"ALIVE\"]\n{lights}")
}

pub(crate) const GATEWAY: &str =
    "profile = \"profile.toml\"\n[reports]\npublish = \"on_change\"\n[can.body]\ninterface = \"can0\"\n";

pub(crate) fn settings(lights: &str) -> GatewaySettings {
    let files = MemoryFiles::new([("gateway.toml", GATEWAY), ("car.dbc", DBC)]);
    files.with("profile.toml", profile(lights)).settings().gateway
}

/// The gateway in that vehicle.
pub(crate) fn car(lights: &str) -> VirtualGateway {
    VirtualGateway::new(settings(lights))
}

/// Messages of one byte, and the statuses of the reports.
impl VirtualGateway {
    /// Receives a frame at `ms`.
    pub(crate) fn frame(&mut self, id: u16, byte: u8, ms: u64) {
        self.pass_until(ms);
        self.receive(CanId::Standard(id), &[byte]);
    }

    /// A frame every `period` ms with the value of `byte` at that time.
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

    /// Changes of the statuses of the reports to a warning, without those of the start.
    pub(crate) fn warnings(&self) -> impl Iterator<Item = &StatusChange> {
        let is_warning =
            |change: &&StatusChange| change.level == Level::Warn && !change.message.starts_with("starting: ");
        self.report_changes().filter(is_warning)
    }

    /// Changes of the statuses of the reports.
    pub(crate) fn report_changes(&self) -> impl Iterator<Item = &StatusChange> {
        self.changes
            .iter()
            .filter(|change| ["turn_indicators", "hazard_lights"].contains(&change.task.as_str()))
    }

    /// Level and message of the status of the turn report, as `WARN message`.
    pub(crate) fn turn_status(&self) -> String {
        self.status_text("turn_indicators")
    }

    /// Level and message of the status of the hazard report.
    pub(crate) fn hazard_status(&self) -> String {
        self.status_text("hazard_lights")
    }

    /// True if a status with this level and message was ever sent.
    pub(crate) fn was_reported(&self, task: &str, level: Level, message: &str) -> bool {
        self.changes_of(task).any(|change| change.level == level && change.message == message)
    }
}
