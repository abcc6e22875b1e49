//! The built binary end to end: frames on a real CAN interface come out at a ROS 2 reader of another
//! make.
//!
//! Everything happens on the loopback. The guest of `tests/with-vcan` has one slow CPU: nothing here depends
//! on how fast something comes.

mod black_box;
mod history;
mod joining;
mod links;
pub(crate) mod reader;
mod reload;
mod values;
mod watchers;

use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::Missing;
use crate::support::process::{self, Folder, Process};
use crate::support::vcan::{Sender, Vcan};
use reader::Reader;

/// `BCM_TurnIndicators` of the demo vehicle and the data of its states.
const TURN: u32 = 0x2A5;
const OFF: [u8; 8] = turn(0);
const LEFT: [u8; 8] = turn(1);
const RIGHT: [u8; 8] = turn(2);
const UNDEFINED: [u8; 8] = turn(3);
const NOT_AVAILABLE: [u8; 8] = turn(7);

/// `BCM_Hazard` likewise.
const HAZARD: u32 = 0x2C1;
const HAZARD_OFF: [u8; 8] = [0; 8];
const HAZARD_ON: [u8; 8] = [0, 1, 0, 0, 0, 0, 0, 0];

/// `TurnIndicatorState` is big-endian: three bits from bit 3 of the third byte down.
const fn turn(raw: u8) -> [u8; 8] {
    [0, 0, raw << 1, 0, 0, 0, 0, 0]
}

/// `TurnIndicatorsReport.report`, and DISABLE of `HazardLightsReport` is 1 as well.
const DISABLE: u8 = 1;
const ENABLE_LEFT: u8 = 2;
const ENABLE_RIGHT: u8 = 3;
const HAZARD_ENABLE: u8 = 2;

/// Everything a test needs.
struct Bench {
    cyclone: Cyclone,
    vcan: Vcan,
    folder: Folder,
    domain: u16,
}

impl Bench {
    /// The demo vehicle on an interface of the test's own. Its messages are valid for as long as a
    /// slow machine may need, and `keys` are further ones of the configuration.
    fn new(interface: &'static str, keys: &str) -> Result<Self, Missing> {
        let vcan = Vcan::new(interface)?;
        let cyclone = Cyclone::on_loopback()?;
        let domain = domain();
        let ros = process::ros_in(domain);
        let folder = Folder::with_demo_vehicle(interface, &format!("{keys}{ros}"));
        folder.append("demo_vehicle.toml", PATIENT);
        Ok(Self { cyclone, vcan, folder, domain })
    }

    fn reader(&self) -> Reader {
        Reader::start(&self.cyclone, self.domain)
    }

    /// A reader of the diagnostics alone.
    fn observer(&self) -> Reader {
        Reader::of_diagnostics(&self.cyclone, self.domain)
    }

    /// A reader, started first so that it receives everything, and the gateway.
    fn start(&self) -> (Reader, Process) {
        (self.reader(), Process::run(&self.folder))
    }
}

const PATIENT: &str = "
[message.BCM_TurnIndicators]
timeout_ms = 60000
[message.BCM_Hazard]
timeout_ms = 60000
";
