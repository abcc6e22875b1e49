//! The gateway's file: one file per section with its shape, its check and its settings.
//! `config/gateway.toml` explains each key.

mod black_box;
mod can;
pub mod command;
mod diagnostics;
mod recording;
mod reports;
mod ros;
pub mod traffic_lights;
pub mod turn_signal;

use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

pub use black_box::BlackBoxConfig;
pub use recording::{Recording, Stamps};
pub use reports::Durability;
pub use ros::RosConfig;

use super::files::Files;
use super::reading::checker::Checker;
use super::reading::document::Document;
use super::reading::keyword::keywords;
use super::reading::problem::{Problem, Refused};
use super::vehicle::{Vehicle, VehicleFile, compile};
use crate::core::can::bus::BusSettings;
use crate::core::command::settings::{CommandBinding, CommandSource};
use crate::core::compat::Compat;
use crate::core::dbc::model::Database;
use crate::core::gateway::GatewaySettings;
use crate::core::simulated_vehicle::plan::{PlanError, VehiclePlan};
use black_box::BlackBoxFile;
use can::{CanFile, CanFiles, cans};
use command::{CommandConfig, CommandFile, command};
use diagnostics::DiagnosticsFile;
use recording::RecordingFile;
use reports::ReportsFile;
use ros::RosFile;
use traffic_lights::{LightTopics, TrafficLightsFile, traffic_lights};
use turn_signal::{TurnSignalConfig, TurnSignalFile, turn_signal};

keywords!(Compat { "improved" => Compat::Improved, "upstream" => Compat::Upstream });

/// A whole configuration file.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GatewayFile {
    /// Path of the vehicle profile, relative to this file.
    pub profile: Option<Spanned<String>>,
    /// The vehicle profile itself, instead of a path.
    pub vehicle: Option<VehicleFile>,
    /// Where frames come from in `run`.
    #[serde(default)]
    pub source: SourceKind,
    /// Interfaces by bus name.
    #[serde(default)]
    pub can: CanFiles,
    /// The recording.
    pub recording: Option<RecordingFile>,
    /// When and how reports are published.
    #[serde(default)]
    pub reports: ReportsFile,
    /// Diagnostics.
    #[serde(default)]
    pub diagnostics: DiagnosticsFile,
    /// Recordings around faults.
    #[serde(default)]
    pub black_box: BlackBoxFile,
    /// Traffic lights.
    pub traffic_lights: Option<TrafficLightsFile>,
    /// Commands to the vehicle; none without.
    pub command: Option<Spanned<CommandFile>>,
    /// The turn signal decider.
    pub turn_signal: Option<TurnSignalFile>,
    /// ROS 2.
    #[serde(default)]
    pub ros: RosFile,
}

/// `source = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SourceKind {
    /// The configured interfaces.
    #[default]
    Socketcan,
    /// The configured recording.
    Recording,
}

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

/// What the command line puts in place of the file's word.
#[derive(Debug, Clone, Default)]
pub struct Overrides {
    /// Another vehicle profile; relative to the working directory.
    pub profile: Option<PathBuf>,
}

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
    let remedy = "give the path of a configuration with --config";
    let bytes = files.read(path).map_err(|error| Problem::unreadable(path, &error, remedy))?;
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
    let mut checker = Checker::new(document);
    let vehicle = match vehicle(files, document, file) {
        Ok((_, vehicle)) => Some(vehicle),
        Err(problems) => {
            checker.problems.extend(problems);
            None
        }
    };
    let node = ros::node(&mut checker, &file.ros);
    let publish = reports::publish(&mut checker, &file.reports);
    let diagnostics_period = diagnostics::period(&mut checker, &file.diagnostics);
    let hardware_id = diagnostics::hardware_id(&mut checker, &file.diagnostics);
    let ros = ros::ros(&mut checker, &file.ros, file.reports.durability);
    let black_box = black_box::black_box(&mut checker, &file.black_box);
    let recording = file.recording.as_ref().map(|section| recording::recording(&mut checker, section));
    if file.source == SourceKind::Recording && recording.is_none() {
        let reason = "source = \"recording\" without a recording";
        checker.refuse_at(0..0, reason, "add [recording] file = \"….log\"");
    }
    let lights =
        file.traffic_lights.as_ref().and_then(|section| traffic_lights(files, &mut checker, section));
    let binding = vehicle.as_ref().map(|vehicle| &vehicle.command);
    let command = file.command.as_ref().and_then(|section| command(&mut checker, section, binding));
    let decider = file.turn_signal.as_ref().and_then(|section| turn_signal(files, &mut checker, section));
    let decides = file.turn_signal.as_ref().is_some_and(|section| section.enabled);
    let source = file.command.as_ref().and_then(|section| section.get_ref().source.as_ref());
    if let Some(source) = source.filter(|source| source.get_ref().0 == CommandSource::Decider && !decides) {
        let remedy = "add [turn_signal] enabled = true, or use \"topic\"";
        checker.refuse(source, "there is no decider that commands", remedy);
    }
    let cans = vehicle.as_ref().map(|vehicle| cans(&mut checker, &file.can, vehicle)).unwrap_or_default();
    let (Some(vehicle), true) = (vehicle, checker.problems.is_empty()) else {
        return Err(Refused(checker.problems));
    };
    let mut buses = Vec::new();
    let mut dbcs = Vec::new();
    for (bus, (interface, _)) in vehicle.buses.into_iter().zip(&cans) {
        dbcs.push(LoadedDbc { bus: bus.name.clone(), path: bus.dbc_path, database: bus.database });
        buses.push(BusSettings {
            name: bus.name,
            interface: interface.clone(),
            heartbeat_messages: bus.heartbeat_messages,
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
