//! Every shipped vehicle, simulated on a real interface: what `status` exits with when all is well.

use std::cell::Cell;
use std::fmt::Write as _;
use std::process::Command;

use serde_json::Value;
use signal_gateway::config::built_in::BuiltIn;
use signal_gateway::config::files::Disk;
use signal_gateway::config::{Settings, load_profile};
use signal_gateway::core::vehicle_lights::binding::HazardBinding;

use crate::support::prerequisite::{Missing, require};
use crate::support::process::{Folder, Process};
use crate::support::vcan::Vcan;
use crate::support::waiting::{described, wait_for, wait_until};

const OK: i32 = 0;
const WARN: i32 = 4;
const NOT_VISIBLE: &str = "not visible: no signal shows the hazard lights";

/// Interfaces of one vehicle after the other.
struct Buses(Vec<Vcan>);

impl Buses {
    /// Enough for every shipped vehicle.
    fn new(names: [&'static str; 2]) -> Result<Self, Missing> {
        Ok(Self(names.into_iter().map(Vcan::new).collect::<Result<_, _>>()?))
    }

    /// Interface of each bus of a vehicle, as `BUS=INTERFACE`.
    fn of<'a>(&'a self, vehicle: &'a Settings) -> impl Iterator<Item = (&'a str, &'a str)> {
        assert!(vehicle.gateway.buses.len() <= self.0.len(), "{}", vehicle.vehicle);
        vehicle.gateway.buses.iter().zip(&self.0).map(|(bus, vcan)| (bus.name.as_str(), vcan.name))
    }
}

/// Runs a simulated vehicle and a gateway with its profile until all is well, and compares the exit code of `status`. Returns
/// true if the vehicle shows its hazard lights.
fn drive(profile: &str, buses: &Buses) -> bool {
    let vehicle = load_profile(&Disk, profile.as_ref()).unwrap();
    let mut keys =
        format!("profile = {profile:?}\n[ros]\nenabled = false\n[status]\nsocket = \"status.sock\"\n");
    for (bus, interface) in buses.of(&vehicle) {
        write!(keys, "[can.{bus}]\ninterface = {interface:?}\n").unwrap();
    }
    let folder = Folder::with_configuration(&keys);
    // Some messages are sent on a change only.
    let acts = (1..30).map(|time| {
        format!(
            "{} stalk left\n{} stalk off\n{} hazard on\n{} hazard off\n",
            4 * time,
            4 * time + 1,
            4 * time + 2,
            4 * time + 3
        )
    });
    folder.write("acts.txt", &acts.collect::<String>());
    let simulated = Process::start(folder.path(), |command| {
        command.args(["vehicle", "--json", "--script", "acts.txt", "--profile", profile]);
        for (bus, interface) in buses.of(&vehicle) {
            command.args(["--interface", &format!("{bus}={interface}")]);
        }
    });
    let gateway = Process::run(&folder);
    let wait_for_code = |expected: i32| {
        let last = Cell::default();
        let lacks =
            described(|| format!("{profile}: {expected}, not {:?}\n{:?}", last.take(), simulated.log()));
        wait_for(lacks, || {
            let (code, abnormal) = status(&folder);
            last.set(abnormal.clone());
            (code == expected).then_some(abnormal)
        })
    };
    let is_visible = !matches!(vehicle.gateway.lights.hazard, HazardBinding::NotVisible { .. });
    if !is_visible {
        let only = format!("hazard_lights: {NOT_VISIBLE}");
        wait_until(format!("{profile}: {only} alone"), || {
            let abnormal = wait_for_code(WARN);
            matches!(abnormal.as_slice(), [one] if one.starts_with(&only))
        });
        folder.append("gateway.toml", "[reports]\nhazard_not_visible = \"acknowledged\"\n");
        gateway.signal("HUP");
    }
    wait_for_code(OK);
    is_visible
}

/// Exit code of `status`, and the statuses that are not OK.
fn status(folder: &Folder) -> (i32, Vec<String>) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    let output =
        command.args(["status", "--json", "--socket", "status.sock"]).current_dir(folder.path()).output();
    let output = output.unwrap();
    let snapshot: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
    let statuses = snapshot["diagnostics"].as_array().into_iter().flatten();
    let abnormal = statuses.filter(|status| status["level"] != "OK");
    let text = |status: &Value| {
        format!("{}: {}", status["task"].as_str().unwrap(), status["message"].as_str().unwrap())
    };
    (output.status.code().unwrap(), abnormal.map(text).collect())
}

#[test]
fn status_of_a_vehicle_that_shows_its_hazard_lights_is_ok_and_of_another_once_it_is_acknowledged() {
    let buses = require!(Buses::new(["vcanship0", "vcanship1"]));
    assert!(drive("vw_mqb", &buses));
    assert!(!drive("honda_civic_hatchback_2017", &buses));
}

mod slow {
    use std::sync::Mutex;

    use signal_gateway::config::files::Disk;
    use signal_gateway::config::load_profile;

    use super::{BuiltIn, Buses, drive, require};

    #[test]
    fn status_of_each_shipped_vehicle_is_ok_where_all_is_visible_or_acknowledged() {
        let buses = [
            require!(Buses::new(["vcanship2", "vcanship3"])),
            require!(Buses::new(["vcanship4", "vcanship5"])),
            require!(Buses::new(["vcanship6", "vcanship7"])),
        ];

        let sends = |name: &&str| load_profile(&Disk, name.as_ref()).unwrap().vehicle_plan().is_ok();
        let (cars, silent): (Vec<_>, Vec<_>) = BuiltIn::Profile.names().partition(sends);
        assert_eq!(silent, ["v2x_unit"], "profiles without anything to simulate");
        let (waiting, driven) = (Mutex::new(cars.iter()), Mutex::new([0, 0]));
        std::thread::scope(|scope| {
            for buses in &buses {
                scope.spawn(|| {
                    while let Some(name) = { waiting.lock().unwrap().next() } {
                        let is_visible = drive(name, buses);
                        driven.lock().unwrap()[usize::from(is_visible)] += 1;
                    }
                });
            }
        });
        assert_eq!(driven.into_inner().unwrap(), [20, 27]);
    }
}
