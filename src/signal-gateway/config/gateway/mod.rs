//! The gateway's file: a source file per section, with its shape, checks and settings. `config/gateway.toml`
//! explains each key.

mod black_box;
mod can;
pub mod command;
mod diagnostics;
mod http;
mod in_effect;
mod mcap;
mod parameters;
mod recording;
pub mod reference;
mod reports;
mod ros;
mod status;
mod top;
pub mod topic_names;
pub mod traffic_lights;
pub mod turn_signal;
mod vehicle_geometry;

use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use black_box::BlackBoxConfig;
pub use can::interface_name;
pub use http::HttpConfig;
pub use mcap::McapConfig;
pub use recording::{Recording, Stamps};
pub use reports::Durability;
use reports::ReportSettings;
pub use ros::{DEFAULT_NODE, RosConfig};
pub use status::StatusConfig;
pub use top::SourceKind;

pub use super::vehicle::LoadedDbc;

use super::built_in::{BuiltIn, display};
use super::file_kind::FileKind;
use super::files::Files;
use super::named_file::{find, find_here};
use super::reading::{
    Checker, Fields, Location, Problem, Refused, SourceLocation, Text, WrittenKey, cannot_read, from_toml,
    remedy_of,
};
use super::ros_names::RosOverrides;
use super::vehicle::{self, SEE, Vehicle};
use crate::process_status::configuration::EffectiveConfiguration;
use ::traffic_lights::flow::LightsFlowSettings;
use can::{CanConfig, cans};
use can_log::standard_input;
use command::CommandConfig;
use gateway_core::command::settings::CommandBinding;
use gateway_core::gateway::GatewaySettings;
use gateway_core::provenance::Provenance;
use gateway_core::vehicle_status::settings::StatusSettings;
use in_effect::{DigestedFiles, in_effect};
use ros_transport::parameters::Parameters;
use top::{PROFILE, SOURCE};
use traffic_lights::{LightTopics, check_ids, traffic_lights};
use turn_signal::{TurnSignalConfig, turn_signal};
use vehicle_bringup::simulated_vehicle::plan::{PlanError, VehiclePlan};
use vehicle_geometry::vehicle_geometry;

const MISSING_CONFIGURATION: &str = "give a configuration with --config FILE, or only a vehicle with --profile NAME: `signal-gateway profiles list` \
     names them, `signal-gateway identify LOG` finds the one that fits a recording";
const MISSING_PROFILE: &str =
    "give the path of a vehicle profile, or a name of `signal-gateway profiles list`";
const MISSING_NAMED_PROFILE: &str =
    "give the profile's path relative to this file, or a name of `signal-gateway profiles list`";

/// A usable configuration.
#[derive(Debug)]
pub struct Settings {
    /// Path of the file: the configuration, or a profile alone.
    pub file: PathBuf,
    /// Name of the vehicle profile, for texts.
    pub vehicle: String,
    /// The table of the vehicle profile; `None` without a vehicle.
    pub profile: Option<SourceLocation>,
    /// The vehicles that the profile describes, and where its facts come from.
    pub provenance: Provenance,
    /// Settings of the gateway: its buses and flows.
    pub gateway: GatewaySettings,
    /// Origin of frames in `run`.
    pub source: SourceKind,
    /// Kernel receive buffer of each bus, bytes.
    pub receive_buffer_bytes: Vec<usize>,
    /// The DBC of each bus, in the order of the buses.
    pub dbcs: Vec<LoadedDbc>,
    /// The recording, if one is named.
    pub recording: Option<Recording>,
    /// Text for `hardware_id` in every `DiagnosticStatus`.
    pub hardware_id: String,
    /// Settings of the recordings around faults.
    pub black_box: BlackBoxConfig,
    /// The socket that serves the current state.
    pub status: StatusConfig,
    /// Settings of the HTTP server.
    pub http: HttpConfig,
    /// The recording of all that is received and published.
    pub mcap: McapConfig,
    /// Node, network and report topics.
    pub ros: RosConfig,
    /// The keys of the file as parameters of the node.
    pub parameters: Parameters,
    /// The value of every key in effect, which a reload compares.
    pub in_effect: EffectiveConfiguration,
    /// Topics of the traffic lights; empty without them.
    pub light_topics: LightTopics,
    /// Commands to the vehicle, if configured.
    pub command: Option<CommandConfig>,
    /// The binding of the vehicle profile for commands, whether they are configured or not.
    pub command_binding: CommandBinding,
    /// The turn-signal decider, whether it runs or not.
    pub turn_signal: Option<TurnSignalConfig>,
}

impl Settings {
    /// Returns the name of the gateway among those of a user, which another one may also have.
    pub fn instance_name(&self) -> String {
        status::instance_name(&self.hardware_id, &self.file)
    }

    /// Records into `folder` instead of the folder of the file.
    pub fn record_to(&mut self, folder: &Path) {
        let value = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned()).display().to_string();
        self.in_effect.fixed.insert("[mcap] folder".to_owned(), value);
        self.mcap.folder = Some(folder.to_owned());
    }

    /// Returns the plan of a simulated vehicle of this profile: the other end of the buses.
    ///
    /// # Errors
    /// Fails if the profile has nothing to simulate.
    pub fn vehicle_plan(&self) -> Result<VehiclePlan, PlanError> {
        let databases: Vec<_> = self.dbcs.iter().map(|dbc| &dbc.database).collect();
        let GatewaySettings { lights, status, status_settings, buses, .. } = &self.gateway;
        let status = (status, &status_settings.geometry);
        VehiclePlan::new(lights, status, &self.command_binding, buses, &databases)
    }
}

/// Settings of the command line that replace settings of the file.
#[derive(Debug, Clone, Default)]
pub struct Overrides {
    /// Another vehicle profile, by its path relative to the working directory, or the name of a built-in one.
    pub profile: Option<PathBuf>,
    /// ROS 2 settings of the command line.
    pub ros: RosOverrides,
}

/// Reads a configuration and everything it names.
///
/// # Errors
/// Every problem found.
pub fn load(files: &dyn Files, path: &Path, overrides: &Overrides) -> Result<Settings, Refused> {
    let text = FileKind::Gateway.read(files, path, MISSING_CONFIGURATION)?;
    let profile = overrides.profile.as_ref().map(|given| {
        let is_path = !standard_input::is_named(given);
        let path = std::path::absolute(given).ok().filter(|_| is_path).unwrap_or_else(|| given.clone());
        find(BuiltIn::Profile, files, &given.to_string_lossy(), path)
    });
    let profile = profile.as_deref().map_or(ProfileChoice::Named, ProfileChoice::Chosen);
    resolve(files, &text, profile, &overrides.ros)
}

/// Returns settings for a profile alone, by path or built-in name: its buses on `can0`, `can1`… in the order
/// of their names, and defaults for everything else. Used to replay a log of a vehicle without a
/// configuration.
///
/// # Errors
/// Every problem found.
pub fn load_profile(files: &dyn Files, profile: &Path) -> Result<Settings, Refused> {
    load_profile_for_node(files, profile, &RosOverrides::default())
}

/// Like [`load_profile`], for a node with its own names.
///
/// # Errors
/// Every problem found.
pub fn load_profile_for_node(
    files: &dyn Files,
    profile: &Path,
    overrides: &RosOverrides,
) -> Result<Settings, Refused> {
    let profile = find_here(BuiltIn::Profile, files, profile);
    resolve(files, &Text::new(&profile, Vec::new())?, ProfileChoice::Alone(&profile), overrides)
}

/// The vehicle profile to read.
#[derive(Clone, Copy)]
enum ProfileChoice<'p> {
    /// The profile that the configuration names or contains.
    Named,
    /// A different profile, from the command line.
    Chosen(&'p Path),
    /// This profile, without a configuration.
    Alone(&'p Path),
}

fn resolve(
    files: &dyn Files,
    text: &Text,
    profile: ProfileChoice<'_>,
    overrides: &RosOverrides,
) -> Result<Settings, Refused> {
    let root = from_toml(text, SEE)?;
    let checker = Checker::new(&text.file, SEE);
    let files = DigestedFiles::new(files);
    let read = Fields::of(&checker, &root).and_then(|top| settings(&files, top, profile, overrides));
    let settings = read.map(|(settings, profile_keys)| {
        let recorded = checker.recorded();
        let parameters = parameters::parameters(&root);
        let in_effect =
            in_effect(recorded, &files, &settings.gateway, &settings.ros.remappings, profile_keys);
        Settings { file: text.file.to_path_buf(), parameters, in_effect, ..settings }
    });
    checker.finish(settings).map_err(Refused)
}

/// Reads the vehicle of `profile`; if there was a problem, returns the names of its buses as far as they are
/// known.
fn vehicle(
    files: &DigestedFiles<'_>,
    top: &Fields<'_>,
    profile: ProfileChoice<'_>,
) -> Result<Vehicle, Option<Vec<String>>> {
    let (named, inline) = (top.given(&PROFILE), top.table("vehicle"));
    if let ProfileChoice::Chosen(path) | ProfileChoice::Alone(path) = profile {
        let missing = BuiltIn::Profile.did_you_mean(path, MISSING_PROFILE);
        top.record(&PROFILE, display(path));
        let bytes = files.plain().read(path).map_err(|error| {
            top.checker.adopt(vec![Problem::unreadable(path, &error, &missing)]);
            None
        })?;
        return vehicle::read(files, path, bytes, |problems| top.checker.adopt(problems));
    }
    match (named, inline) {
        (None, Some(inline)) => {
            let buses = vehicle::bus_names(&inline);
            vehicle::compile(files, inline).ok_or(Some(buses))
        }
        (Some(named), None) => {
            let path = find(BuiltIn::Profile, files, &named, top.checker.beside(&named));
            read_profile(files, top.checker, &path, top.at(PROFILE.name))
        }
        (Some(_), Some(_)) => {
            top.refuse("profile", "both a profile and a [vehicle] are given", "keep one of them");
            Err(None)
        }
        (None, None) if top.has("profile") || top.has("vehicle") => Err(None),
        (None, None) if top.has("traffic_lights") || top.has("turn_signal") => Ok(Vehicle::none()),
        (None, None) => {
            let remedy = "give a path, or a name of `signal-gateway profiles list`, with profile = \"…\"";
            top.refuse("profile", "no vehicle profile is given", remedy);
            Err(None)
        }
    }
}

fn read_profile(
    files: &DigestedFiles<'_>,
    checker: &Checker,
    path: &Path,
    at: &Location,
) -> Result<Vehicle, Option<Vec<String>>> {
    let bytes = files.plain().read(path).map_err(|error| {
        let missing = BuiltIn::Profile.did_you_mean(path, MISSING_NAMED_PROFILE);
        let reason = format!("{}: {}", display(path), cannot_read(&error));
        checker.refused(at, reason, remedy_of(&error, &missing))
    });
    vehicle::read(files, path, bytes?, |problems| checker.adopt(problems))
}

/// Reads the traffic lights, and compares the ids of a V2X unit with their map.
fn lights(
    files: &DigestedFiles<'_>,
    top: &Fields<'_>,
    overrides: &RosOverrides,
    vehicle: Option<&Vehicle>,
) -> Option<(LightsFlowSettings, LightTopics)> {
    let lights = traffic_lights(files, top.table("traffic_lights")?, overrides.use_sim_time);
    if let (Some((flow, _)), Some(vehicle)) = (&lights, vehicle) {
        top.checker.adopt(check_ids(&vehicle.v2i_ids, &vehicle.v2i, &flow.lights.map));
    }
    lights
}

/// Reads the interfaces of the vehicle's buses.
fn interfaces(
    top: &Fields<'_>,
    vehicle: &Result<Vehicle, Option<Vec<String>>>,
    profile: ProfileChoice<'_>,
) -> Vec<CanConfig> {
    match (vehicle, profile) {
        (Ok(vehicle), ProfileChoice::Alone(_)) => (0..vehicle.buses.len()).map(CanConfig::numbered).collect(),
        (Err(_), ProfileChoice::Alone(_)) => Vec::new(),
        (Ok(vehicle), ProfileChoice::Named | ProfileChoice::Chosen(_)) => {
            let buses: Vec<_> = vehicle.buses.iter().map(|bus| bus.name.clone()).collect();
            cans(top, Some(&buses))
        }
        // Even a refused profile has names for its buses.
        (Err(buses), ProfileChoice::Named | ProfileChoice::Chosen(_)) => cans(top, buses.as_deref()),
    }
}

/// Reads the recording, which `source` may need.
fn read_recording(top: &Fields<'_>, source: SourceKind) -> Option<Recording> {
    if source == SourceKind::Recording && !top.has("recording") {
        let reason = "source = \"recording\" without a recording";
        top.checker.refuse(top.location(), reason, "add [recording] file = \"….log\"");
    }
    top.read_table("recording", recording::recording)
}

/// Reads the settings, and the keys of the vehicle profile.
fn settings(
    files: &DigestedFiles<'_>,
    top: Fields<'_>,
    profile: ProfileChoice<'_>,
    overrides: &RosOverrides,
) -> Option<(Settings, Vec<WrittenKey>)> {
    let mut vehicle = vehicle(files, &top, profile);
    let source = top.read(&SOURCE);
    let (hazard, gear) = match &mut vehicle {
        Ok(vehicle) => (Some(&mut vehicle.lights.hazard), vehicle.status.gear.as_ref()),
        Err(_) => (None, None),
    };
    let ReportSettings { publish, durability, min_period, gear_source } =
        top.section("reports").read_all(|section| reports::reports(section, hazard, gear));
    let profile_file = vehicle.as_ref().ok().and_then(|vehicle| vehicle.profile.as_ref());
    let profile_file = profile_file.map(|location| Arc::clone(&location.file));
    let dimensions = top
        .section("vehicle_geometry")
        .read_all(|section| vehicle_geometry(files, section, profile_file.as_deref()));
    let (diagnostics_period, hardware_id) = top.section("diagnostics").read_all(diagnostics::diagnostics);
    let (node, ros) =
        top.section("ros").read_all(|section| ros::ros(files.plain(), section, durability, overrides));
    let black_box = top.section("black_box").read_all(black_box::black_box);
    let status = top.section("status").read_all(status::status);
    let http = top.section("http").read_all(http::http);
    let mcap = top.section("mcap").read_all(mcap::mcap);
    let recording = read_recording(&top, source);
    let known = vehicle.as_ref().ok();
    let lights = lights(files, &top, overrides, known);
    let decides = top.table("turn_signal").is_some_and(|section| section.flag("enabled") == Some(true));
    let decider = top.table("turn_signal").and_then(|section| {
        let runs = ["enabled", "shadow"].iter().any(|key| section.is(key, "true"));
        // Files of a decider that does not run are not in effect.
        turn_signal(if runs { files } else { files.plain() }, section, dimensions.outline, known)
    });
    let command = top.read_table("command", |section| {
        command::command(section, known, decides, ros.topics.name("control_mode_status"))
    });
    let cans = interfaces(&top, &vehicle, profile);
    top.done();
    let mut vehicle = vehicle.ok()?;
    for (bus, can) in vehicle.buses.iter_mut().zip(&cans) {
        bus.interface.clone_from(&can.interface);
    }
    let (flow, light_topics) = lights.unzip();
    let gateway = GatewaySettings {
        node,
        buses: vehicle.buses,
        lights: vehicle.lights,
        status: vehicle.status,
        status_settings: StatusSettings { gear_source, min_period, geometry: dimensions.geometry },
        v2i: vehicle.v2i,
        traffic_lights: flow,
        turn_signal: decider.as_ref().filter(|decider| decider.runs).map(|decider| decider.flow.clone()),
        command: command.as_ref().map(|command| (command.settings.clone(), command.binding.clone())),
        publish,
        diagnostics_period,
    };
    let settings = Settings {
        file: PathBuf::new(),
        vehicle: vehicle.name,
        profile: vehicle.profile,
        provenance: vehicle.provenance,
        gateway,
        source,
        receive_buffer_bytes: cans.iter().map(|can| can.receive_buffer).collect(),
        dbcs: vehicle.dbcs,
        recording,
        hardware_id,
        black_box,
        status,
        http,
        mcap,
        ros,
        parameters: Parameters::default(),
        in_effect: EffectiveConfiguration::default(),
        light_topics: light_topics.unwrap_or_default(),
        command,
        command_binding: vehicle.command,
        turn_signal: decider,
    };
    Some((settings, vehicle.keys))
}
