//! Every shipped vehicle, simulated on a real interface: what `status` exits with when all is well.

use std::cell::Cell;
use std::fmt::Write as _;
use std::process::Command;

use can_signal::validation::meaning::Meaning;
use gateway_core::vehicle_lights::binding::HazardBinding;
use gateway_core::vehicle_status::gear::GearCode;
use serde_json::Value;
use signal_gateway::config::built_in::BuiltIn;
use signal_gateway::config::files::Disk;
use signal_gateway::config::{Settings, load_profile};

use crate::support::prerequisite::{Missing, require};
use crate::support::process::{Folder, Process};
use crate::support::vcan::Vcan;
use crate::support::waiting::{described, wait_until};

const OK: i32 = 0;
const WARN: i32 = 4;
const ERROR: i32 = 7;
const NOT_VISIBLE: &str = "hazard_lights: not visible: no signal shows the hazard lights";

const GEAR_NOT_VISIBLE: &str = "gear: not visible: ";

/// What is wrong for ever with a car whose profile has a speed, and nothing that tells the heading rate.
const NO_HEADING_RATE: &str = "velocity: heading rate: unknown: the profile describes no source of it";
const WITHOUT_HEADING_RATE: &str = "tesla_model_s_powertrain";

/// A car's dimensions, without which reports are withheld.
const DIMENSIONS: &str = "[vehicle_geometry]\nwheel_base_m = 2.7\nwheel_tread_m = 1.6\nwheel_radius_m = 0.33\nsteering_ratio = 15.0\n";

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

/// A simulated vehicle, and a gateway with its profile.
struct Car {
    folder: Folder,
    simulated: Process,
    gateway: Process,
}

impl Car {
    fn start(profile: &str, vehicle: &Settings, buses: &Buses) -> Self {
        let mut keys = format!(
            "profile = {profile:?}\n[ros]\nenabled = false\n[status]\nsocket = \"status.sock\"\n{DIMENSIONS}"
        );
        for (bus, interface) in buses.of(vehicle) {
            write!(keys, "[can.{bus}]\ninterface = {interface:?}\n").unwrap();
        }
        let folder = Folder::with_configuration(&keys);
        // Some messages are sent on a change only.
        let acts = (1..30).map(|round| {
            let [left, off, on, end] = [0, 1, 2, 3].map(|step| 4 * round + step);
            format!("{left} stalk left\n{off} stalk off\n{on} hazard on\n{end} hazard off\n")
        });
        folder.write("acts.txt", &acts.collect::<String>());
        let simulated = Process::start(folder.path(), |command| {
            command.args(["vehicle", "--json", "--script", "acts.txt", "--profile", profile]);
            for (bus, interface) in buses.of(vehicle) {
                command.args(["--interface", &format!("{bus}={interface}")]);
            }
        });
        let gateway = Process::run(&folder);
        Self { folder, simulated, gateway }
    }

    /// Waits until `status` exits with a code while these statuses alone are not OK, by the beginnings of
    /// their texts.
    fn wait_for(&self, code: i32, abnormal: &[&str]) {
        let last = Cell::default();
        let lacks =
            described(|| format!("{code} {abnormal:?}, not {:?}\n{:?}", last.take(), self.simulated.log()));
        wait_until(lacks, || {
            let (exit_code, texts) = status(&self.folder);
            let begins = |(text, begin): (&String, &&str)| text.starts_with(begin);
            let is_it =
                exit_code == code && texts.len() == abnormal.len() && texts.iter().zip(abnormal).all(begins);
            last.set((exit_code, texts));
            is_it
        });
    }
}

/// Runs a simulated vehicle and a gateway until all is well, by the exit code of `status`. Returns true if
/// the vehicle shows its hazard lights.
fn drive(profile: &str, buses: &Buses) -> bool {
    let vehicle = load_profile(&Disk, profile.as_ref()).unwrap();
    let car = Car::start(profile, &vehicle, buses);
    let is_visible = !matches!(vehicle.gateway.lights.hazard, HazardBinding::NotVisible { .. });
    let gear = (!shows_gears(&vehicle)).then_some(GEAR_NOT_VISIBLE);
    let heading_rate = (profile == WITHOUT_HEADING_RATE).then_some(NO_HEADING_RATE);
    let lasting: Vec<_> = [heading_rate, gear].into_iter().flatten().collect();
    let code = |others| if heading_rate.is_some() { ERROR } else { others };
    if !is_visible {
        car.wait_for(code(WARN), &[&[NOT_VISIBLE], lasting.as_slice()].concat());
        car.folder.append("gateway.toml", "[reports]\nhazard_not_visible = \"acknowledged\"\n");
        car.gateway.signal("HUP");
    }
    car.wait_for(code(if gear.is_some() { WARN } else { OK }), &lasting);
    is_visible
}

/// False for a vehicle whose signals tell reverse gear from all others, and no more.
fn shows_gears(vehicle: &Settings) -> bool {
    let sources = vehicle.gateway.status.gear.as_ref().map(|gear| gear.sources.as_slice());
    let is_forward = |meaning: &Meaning<GearCode>| matches!(meaning, Meaning::Defined(GearCode::Engaged(gear)) if gear.direction() != Some(-1.0));
    sources.is_none_or(|sources| {
        let mut meanings = sources.iter().flat_map(|source| source.role.values.entries());
        meanings.any(|(_, meaning)| is_forward(meaning))
    })
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

    use super::{BuiltIn, Buses, Car, ERROR, GEAR_NOT_VISIBLE, Process, WARN, drive, require};

    #[test]
    #[ignore = "slow: tests/run --full"]
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

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn a_car_of_another_variant_is_refused_by_name_until_a_restart() {
        let buses = require!(Buses::new(["vcanship8", "vcanship9"]));
        let vehicle = load_profile(&Disk, "psa_aee2010".as_ref()).unwrap();
        let mut car = Car::start("psa_aee2010", &vehicle, &buses);
        car.wait_for(WARN, &[GEAR_NOT_VISIBLE]);
        buses.0[0].send(0x612, [0; 8]);
        let reason = "unknown: the profile is for another vehicle: HS2_DAT7_BSI_612 (612) is received, which belongs to a car \
                      such as the Peugeot 208";
        let lights = ["turn_indicators", "hazard_lights"].map(|task| format!("{task}: {reason}"));
        let reports = vehicle.gateway.status.reports();
        let reports =
            reports.map(|report| format!("{}: unknown: the profile is for another vehicle", report.name()));
        let refused: Vec<_> = lights.into_iter().chain(reports).collect();
        let refused: Vec<_> = refused.iter().map(String::as_str).collect();
        car.wait_for(ERROR, &refused);
        car.folder.append("gateway.toml", "[reports]\nrate_hz = 50.0\n");
        car.gateway.signal("HUP");
        car.gateway.wait_for_log("configuration reloaded: [reports] rate_hz");
        car.wait_for(ERROR, &refused);
        car.gateway.stop("TERM");
        car.gateway = Process::run(&car.folder);
        car.wait_for(WARN, &[GEAR_NOT_VISIBLE]);
    }
}
