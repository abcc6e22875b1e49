//! Traffic lights and turn signal decisions end to end: scenarios, and inputs of others over ROS 2, come out
//! of the built binary at a reader of another make.
//!
//! Everything happens on the loopback.

mod arbiter;
mod clock;
pub(crate) mod drive;
mod faults;
mod inputs;
mod joining;
mod launch;
mod light_text;
mod mcap;
mod notes;
mod peer;
mod recording;
mod rosout;
mod scenario;
mod stale;
mod vehicle_status;

use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::Missing;
use crate::support::process::{Folder, Process, ros_in};
use peer::{Reader, TopicToRead, Writer};

const SCENARIO: &str = include_str!("crossing.xosc");
const MAP: &str = include_str!("../../maps/crossroads.osm");

/// A gateway without a vehicle, and a peer.
struct Bench {
    cyclone: Cyclone,
    folder: Folder,
    domain: u16,
}

impl Bench {
    /// `[traffic_lights]` with these keys, the crossroads, and `crossing.xosc` beside.
    fn new(keys: &str) -> Result<Self, Missing> {
        let (cyclone, domain) = (Cyclone::on_loopback()?, domain());
        let folder = folder(&format!("{}[traffic_lights]\n{keys}", ros_in(domain)));
        Ok(Self { cyclone, folder, domain })
    }

    fn run(&self) -> Process {
        Process::run(&self.folder)
    }

    fn reader(&self, topics: &[TopicToRead<'_>]) -> Reader {
        Reader::start(&self.cyclone, self.domain, topics)
    }

    fn writer(&self, topics: &[(&str, &str)]) -> Writer {
        Writer::start(&self.cyclone, self.domain, topics)
    }
}

/// True if the machine held up a gateway for so long that it continued with another participant, or another
/// network process, as its log has it: then some messages come twice, and the histories for late joiners
/// begin anew.
fn stood_still(gateway: &Process) -> bool {
    let signs = ["StoodStill", "has ended (no answer)"];
    gateway.log().iter().any(|line| signs.iter().any(|sign| line.contains(sign)))
}

/// A configuration beside the crossroads and their scenario.
fn folder(configuration: &str) -> Folder {
    let folder = Folder::with_configuration(configuration);
    add_crossing(&folder);
    folder
}

/// The groups of the built-in V2X unit, and one that shares its heads.
const UNIT_GROUPS: &str = "[groups]\n34806 = [34802, 34836]\n120666 = [34836]\n34807 = [34807]\n\
    35101 = [1]\n35102 = [2]\n35201 = [3]\n";

fn add_crossing(folder: &Folder) {
    folder.write("crossroads.osm", MAP);
    folder.write("crossing.xosc", SCENARIO);
}
