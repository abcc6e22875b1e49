//! What a configuration means, checked against its DBCs: everything the daemon and the replay need.

use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;

use toml::Spanned;

use super::command::{CommandConfig, command};
use super::command_file::SourceFile;
use super::file::{CanFile, Durability, GatewayFile, SourceKind, Stamps};
use super::files::Files;
use super::problem::{Document, Problem, Refused};
use super::sections::Checks;
use super::traffic_lights::{LightTopics, traffic_lights};
use super::turn_signal::{TurnSignalConfig, turn_signal};
use super::vehicle::{Vehicle, compile};
use super::vehicle_file::VehicleFile;
use crate::core::bus::BusSettings;
use crate::core::command::settings::CommandBinding;
use crate::core::dbc::model::Database;
use crate::core::gateway::GatewaySettings;
use crate::core::simulated_vehicle::plan::{PlanError, VehiclePlan};

/// A configuration that can be used.
#[derive(Debug)]
pub struct Settings {
    /// Name of the vehicle profile, for people.
    pub vehicle: String,
    /// What the gateway needs.
    pub gateway: GatewaySettings,
    /// Where frames come from in `run`.
    pub source: SourceKind,
    /// Kernel receive buffer of each bus, bytes.
    pub receive_buffer_bytes: Vec<usize>,
    /// The DBC of each bus.
    pub dbcs: Vec<LoadedDbc>,
    /// The recording, if one is named.
    pub recording: Option<Recording>,
    /// `DiagnosticStatus.hardware_id`.
    pub hardware_id: String,
    /// Recordings around faults.
    pub black_box: BlackBoxConfig,
    /// ROS 2.
    pub ros: RosConfig,
    /// Topics of the traffic lights; none without them.
    pub light_topics: LightTopics,
    /// Commands to the vehicle, if the configuration wants them.
    pub command: Option<CommandConfig>,
    /// What the vehicle profile binds for commands, heeded or not.
    pub command_binding: CommandBinding,
    /// The turn signal decider, whether it runs or not.
    pub turn_signal: Option<TurnSignalConfig>,
}

impl Settings {
    /// The other end of the buses: what a simulated vehicle of this profile sends and obeys.
    ///
    /// # Errors
    /// The profile has no vehicle that could be simulated.
    pub fn vehicle_plan(&self) -> Result<VehiclePlan, PlanError> {
        let databases: Vec<_> = self.dbcs.iter().map(|dbc| &dbc.database).collect();
        VehiclePlan::new(&self.gateway.lights, &self.command_binding, &self.gateway.buses, &databases)
    }
}

/// What is kept around a change to ERROR, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BlackBoxConfig {
    /// Where recordings go; systemd's `STATE_DIRECTORY` when not given, nowhere without that.
    pub folder: Option<PathBuf>,
    /// Time before the change.
    pub before: Duration,
    /// Time after it.
    pub after: Duration,
    /// Recordings kept.
    pub keep: usize,
}

/// A DBC that was read.
#[derive(Debug)]
pub struct LoadedDbc {
    /// Bus it describes.
    pub bus: String,
    /// Where it stands.
    pub path: PathBuf,
    /// What it says, and what of it was rejected.
    pub database: Database,
}

/// Which recording to play, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Recording in any known format, plain or gzip.
    pub file: PathBuf,
    /// Factor on the original timing.
    pub speed: f64,
    /// Start again at the end.
    pub repeat: bool,
    /// Which time goes into stamps while it plays in real time.
    pub stamps: Stamps,
}

/// What the configuration says of ROS 2.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RosConfig {
    /// Whether to publish at all.
    pub enabled: bool,
    /// Namespace, `/` or `/name`.
    pub namespace: String,
    /// Domain, when the configuration overrides `ROS_DOMAIN_ID`.
    pub domain_id: Option<u16>,
    /// Own addresses to use; all when empty.
    pub only_networks: Vec<IpAddr>,
    /// Durability of the two reports.
    pub durability: Durability,
    /// Topic of `TurnIndicatorsReport`.
    pub turn_indicators_status: String,
    /// Topic of `HazardLightsReport`.
    pub hazard_lights_status: String,
    /// Topic of `DiagnosticArray`.
    pub diagnostics: String,
}

/// What the command line puts in place of the file's word.
#[derive(Debug, Clone, Default)]
pub struct Overrides {
    /// Another vehicle profile; relative to the working directory.
    pub profile: Option<PathBuf>,
}

const DEFAULT_NODE: &str = "signal_gateway";

/// Reads a configuration and everything it names.
///
/// # Errors
/// Every problem found.
pub fn load(files: &dyn Files, path: &Path, overrides: &Overrides) -> Result<Settings, Refused> {
    let document = read(files, path).map_err(|problem| Refused(vec![problem]))?;
    let mut file: GatewayFile = document.parse().map_err(|problem| Refused(vec![problem]))?;
    if let Some(profile) = &overrides.profile {
        let chosen = std::path::absolute(profile).unwrap_or_else(|_| profile.clone());
        file.vehicle = None;
        file.profile = Some(Spanned::new(0..0, chosen.display().to_string()));
    }
    resolve(files, &document, &file)
}

/// Settings for a profile alone: its buses on `can0`, `can1`… in the order of their names, all
/// else default. For replaying a log of a vehicle without writing a configuration.
///
/// # Errors
/// Every problem found.
pub fn load_profile(files: &dyn Files, profile: &Path) -> Result<Settings, Refused> {
    let document = Document::new(profile, Vec::new()).map_err(|problem| Refused(vec![problem]))?;
    let profile = profile.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let mut file = GatewayFile { profile: Some(Spanned::new(0..0, profile)), ..GatewayFile::default() };
    let (_, vehicle) = vehicle(files, &document, &file).map_err(Refused)?;
    for (index, bus) in vehicle.buses.iter().enumerate() {
        let interface = Spanned::new(0..0, format!("can{index}"));
        let can = CanFile { interface, receive_buffer_bytes: None };
        file.can.insert(Spanned::new(0..0, bus.name.clone()), can);
    }
    resolve(files, &document, &file)
}

fn read(files: &dyn Files, path: &Path) -> Result<Document, Problem> {
    let bytes = files.read(path).map_err(|error| Problem {
        file: path.to_owned(),
        position: None,
        key: String::new(),
        reason: format!("cannot read it: {error}"),
        remedy: "give the path of a configuration with --config".to_owned(),
    })?;
    Document::new(path, bytes)
}

/// The profile and the document it stands in.
fn vehicle(
    files: &dyn Files,
    document: &Document,
    file: &GatewayFile,
) -> Result<(Document, Vehicle), Vec<Problem>> {
    match (&file.profile, &file.vehicle) {
        (None, Some(inline)) => Ok((document.clone(), compile(document, inline, files)?)),
        (Some(profile), None) => {
            let path = document.path().parent().unwrap_or(Path::new("")).join(profile.get_ref());
            let not_there = |problem: Problem| {
                vec![if problem.position.is_none() {
                    let reason = format!("{}: {}", path.display(), problem.reason);
                    document.problem(profile.span(), reason, "give the profile's path relative to this file")
                } else {
                    problem
                }]
            };
            let profile = read(files, &path).map_err(not_there)?;
            let parsed: VehicleFile = profile.parse().map_err(|problem| vec![problem])?;
            let vehicle = compile(&profile, &parsed, files)?;
            Ok((profile, vehicle))
        }
        (Some(profile), Some(_)) => Err(vec![document.problem(
            profile.span(),
            "both a profile and a [vehicle] are given",
            "keep one of them",
        )]),
        (None, None) if file.traffic_lights.is_some() || file.turn_signal.is_some() => {
            Ok((document.clone(), Vehicle::none()))
        }
        (None, None) => {
            let remedy = "name one with profile = \"vehicles/….toml\"";
            Err(vec![document.problem(0..0, "no vehicle profile is given", remedy)])
        }
    }
}

fn resolve(files: &dyn Files, document: &Document, file: &GatewayFile) -> Result<Settings, Refused> {
    let mut checks = Checks { document, problems: Vec::new() };
    let vehicle = match vehicle(files, document, file) {
        Ok((_, vehicle)) => Some(vehicle),
        Err(problems) => {
            checks.problems.extend(problems);
            None
        }
    };
    let node = checks.name(file.ros.node.as_ref(), DEFAULT_NODE);
    let publish = checks.publish(file);
    let diagnostics_period = checks.diagnostics_period(file);
    let hardware_id = match &file.diagnostics.hardware_id {
        Some(id) if id.get_ref().is_empty() => {
            checks.refuse(
                id,
                "an empty hardware_id draws a warning from ROS tools",
                "use \"none\" or leave it out",
            );
            String::new()
        }
        id => id.as_ref().map_or("none".to_owned(), |id| id.get_ref().clone()),
    };
    let ros = checks.ros(file);
    let black_box = checks.black_box(&file.black_box);
    let recording = file.recording.as_ref().map(|recording| checks.recording(recording));
    if file.source == SourceKind::Recording && recording.is_none() {
        checks.refuse_at(
            0..0,
            "source = \"recording\" without a recording",
            "add [recording] file = \"….log\"",
        );
    }
    let lights = file
        .traffic_lights
        .as_ref()
        .and_then(|section| traffic_lights(files, document, section, &mut checks.problems));
    let binding = vehicle.as_ref().map(|vehicle| &vehicle.command);
    let command =
        file.command.as_ref().and_then(|section| command(document, section, binding, &mut checks.problems));
    let decider = file
        .turn_signal
        .as_ref()
        .and_then(|section| turn_signal(files, document, section, &mut checks.problems));
    let decides = file.turn_signal.as_ref().is_some_and(|section| section.enabled);
    let source = file.command.as_ref().and_then(|section| section.get_ref().source.as_ref());
    if let Some(source) = source.filter(|source| *source.get_ref() == SourceFile::Decider && !decides) {
        let remedy = "add [turn_signal] enabled = true, or use \"topic\"";
        checks.refuse(source, "there is no decider that commands", remedy);
    }
    let cans = vehicle.as_ref().map(|vehicle| checks.cans(file, vehicle)).unwrap_or_default();
    let (Some(vehicle), true) = (vehicle, checks.problems.is_empty()) else {
        return Err(Refused(checks.problems));
    };
    let mut buses = Vec::new();
    let mut dbcs = Vec::new();
    for (bus, (interface, _)) in vehicle.buses.into_iter().zip(&cans) {
        dbcs.push(LoadedDbc { bus: bus.name.clone(), path: bus.dbc_path, database: bus.database });
        buses.push(BusSettings {
            name: bus.name,
            interface: interface.clone(),
            alive_by: bus.alive_by,
            alive_timeout: bus.alive_timeout,
            may_sleep: bus.may_sleep,
        });
    }
    let (flow, light_topics) = lights.unzip();
    let gateway = GatewaySettings {
        node,
        buses,
        lights: vehicle.lights,
        v2i: vehicle.v2i,
        traffic_lights: flow,
        turn_signal: decider.as_ref().filter(|decider| decider.runs).map(|decider| decider.flow.clone()),
        command: command.as_ref().map(|command| (command.settings.clone(), command.binding.clone())),
        publish,
        diagnostics_period,
    };
    Ok(Settings {
        vehicle: vehicle.name,
        gateway,
        source: file.source,
        receive_buffer_bytes: cans.iter().map(|(_, buffer)| *buffer).collect(),
        dbcs,
        recording,
        hardware_id,
        black_box,
        ros,
        light_topics: light_topics.unwrap_or_default(),
        command,
        command_binding: vehicle.command,
        turn_signal: decider,
    })
}
