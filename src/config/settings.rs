//! What a configuration means, checked against its DBCs: everything the daemon and the replay need.

use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;

use toml::Spanned;

use super::file::{
    BlackBoxFile, CanFile, Durability, GatewayFile, PublishFile, RecordingFile, SourceKind, Stamps,
};
use super::files::Files;
use super::problem::{Document, Problem, Refused};
use super::traffic_lights::{LightTopics, traffic_lights};
use super::turn_signal::{TurnSignalConfig, turn_signal};
use super::vehicle::{Vehicle, compile};
use super::vehicle_file::VehicleFile;
use crate::core::bus::BusSettings;
use crate::core::dbc::model::Database;
use crate::core::gateway::GatewaySettings;
use crate::core::vehicle_lights::report::Publish;

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
    /// The turn signal decider, whether it runs or not.
    pub turn_signal: Option<TurnSignalConfig>,
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
const DEFAULT_RATE_HZ: f64 = 10.0;
const DEFAULT_DIAGNOSTICS_MS: u64 = 250;
const DEFAULT_RECEIVE_BUFFER: usize = 4 << 20;

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
    let decider = file
        .turn_signal
        .as_ref()
        .and_then(|section| turn_signal(files, document, section, &mut checks.problems));
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
        turn_signal: decider,
    })
}

struct Checks<'a> {
    document: &'a Document,
    problems: Vec<Problem>,
}

impl Checks<'_> {
    fn refuse_at(&mut self, at: std::ops::Range<usize>, reason: impl Into<String>, remedy: &str) {
        self.problems.push(self.document.problem(at, reason, remedy));
    }

    fn refuse<T>(&mut self, value: &Spanned<T>, reason: impl Into<String>, remedy: &str) {
        self.refuse_at(value.span(), reason, remedy);
    }

    /// A ROS name: letters, digits and underscores, not beginning with a digit.
    fn name(&mut self, given: Option<&Spanned<String>>, default: &str) -> String {
        if let Some(name) = given.filter(|name| !is_ros_name(name.get_ref())) {
            self.refuse(
                name,
                format!("{:?} is no ROS name", name.get_ref()),
                "use letters, digits and _, no digit first",
            );
        }
        given.map_or(default.to_owned(), |name| name.get_ref().clone())
    }

    /// An absolute topic: `/a/b`.
    fn topic(&mut self, given: Option<&Spanned<String>>, default: &str) -> String {
        if let Some(topic) = given.filter(|topic| !is_topic(topic.get_ref())) {
            self.refuse(topic, format!("{:?} is no absolute topic", topic.get_ref()), "write it as /a/b");
        }
        given.map_or(default.to_owned(), |topic| topic.get_ref().clone())
    }

    fn publish(&mut self, file: &GatewayFile) -> Publish {
        let rate = file.reports.rate_hz.as_ref();
        match file.reports.publish {
            PublishFile::OnChange => {
                if let Some(rate) = rate {
                    self.refuse(rate, "on_change has no rate", "remove it, or use publish = \"periodic\"");
                }
                Publish::OnChange
            }
            PublishFile::Periodic => {
                if let Some(rate) = rate.filter(|rate| !(0.1..=1000.0).contains(rate.get_ref())) {
                    self.refuse(
                        rate,
                        format!("{} Hz cannot be published", rate.get_ref()),
                        "give 0.1 to 1000 Hz",
                    );
                    return Publish::OnChange;
                }
                Publish::Periodic(Duration::from_secs_f64(
                    1.0 / rate.map_or(DEFAULT_RATE_HZ, |rate| *rate.get_ref()),
                ))
            }
        }
    }

    fn diagnostics_period(&mut self, file: &GatewayFile) -> Duration {
        let given = file.diagnostics.period_ms.as_ref();
        if let Some(period) = given.filter(|period| !(20..=500).contains(period.get_ref())) {
            let remedy = "give 20 to 500 ms: aggregators call a status stale after 1 s";
            self.refuse(period, format!("{} ms is no usable refresh period", period.get_ref()), remedy);
        }
        Duration::from_millis(given.map_or(DEFAULT_DIAGNOSTICS_MS, |period| *period.get_ref()))
    }

    fn ros(&mut self, file: &GatewayFile) -> RosConfig {
        let ros = &file.ros;
        let namespace = match &ros.namespace {
            Some(root) if root.get_ref() == "/" => "/".to_owned(),
            namespace => self.topic(namespace.as_ref(), "/"),
        };
        if let Some(domain) = ros.domain_id.as_ref().filter(|domain| *domain.get_ref() > 232) {
            self.refuse(domain, format!("domain {} has no ports", domain.get_ref()), "give 0 to 232");
        }
        let topics = &ros.topics;
        RosConfig {
            enabled: ros.enabled.unwrap_or(true),
            namespace,
            domain_id: ros.domain_id.as_ref().map(|domain| *domain.get_ref()),
            only_networks: ros.only_networks.clone(),
            durability: file.reports.durability,
            turn_indicators_status: self
                .topic(topics.turn_indicators_status.as_ref(), "/vehicle/status/turn_indicators_status"),
            hazard_lights_status: self
                .topic(topics.hazard_lights_status.as_ref(), "/vehicle/status/hazard_lights_status"),
            diagnostics: self.topic(topics.diagnostics.as_ref(), "/diagnostics"),
        }
    }

    fn black_box(&mut self, file: &BlackBoxFile) -> BlackBoxConfig {
        let mut seconds = |given: &Option<Spanned<u64>>, default: u64| {
            if let Some(time) = given.as_ref().filter(|time| !(1..=300).contains(time.get_ref())) {
                self.refuse(time, format!("{} s cannot be kept", time.get_ref()), "give 1 to 300 s");
            }
            Duration::from_secs(given.as_ref().map_or(default, |time| *time.get_ref()))
        };
        let (before, after) = (seconds(&file.before_s, 30), seconds(&file.after_s, 10));
        if let Some(keep) = file.keep.as_ref().filter(|keep| !(1..=1000).contains(keep.get_ref())) {
            self.refuse(keep, format!("{} recordings cannot be kept", keep.get_ref()), "give 1 to 1000");
        }
        let folder = file.folder.as_ref();
        let beside = self.document.path().parent().unwrap_or(Path::new(""));
        BlackBoxConfig {
            folder: folder.map(|folder| beside.join(folder.get_ref())),
            before,
            after,
            keep: file.keep.as_ref().map_or(20, |keep| *keep.get_ref()),
        }
    }

    fn recording(&mut self, file: &RecordingFile) -> Recording {
        if let Some(speed) = file.speed.as_ref().filter(|speed| !(0.01..=1000.0).contains(speed.get_ref())) {
            self.refuse(
                speed,
                format!("{} is no usable speed", speed.get_ref()),
                "give 0.01 to 1000 (1 = original)",
            );
        }
        Recording {
            file: self.document.path().parent().unwrap_or(Path::new("")).join(file.file.get_ref()),
            speed: file.speed.as_ref().map_or(1.0, |speed| *speed.get_ref()),
            repeat: file.repeat,
            stamps: file.stamps,
        }
    }

    /// Interface and receive buffer of each bus of the vehicle, in its order.
    fn cans(&mut self, file: &GatewayFile, vehicle: &Vehicle) -> Vec<(String, usize)> {
        let buses: Vec<_> = vehicle.buses.iter().map(|bus| bus.name.as_str()).collect();
        let known = buses.join(", ");
        for (name, _) in file.can.iter().filter(|(name, _)| !buses.contains(&name.get_ref().as_str())) {
            self.refuse(
                name,
                format!("the vehicle profile has no bus {}", name.get_ref()),
                &format!("it has {known}"),
            );
        }
        let mut taken: Vec<&str> = Vec::new();
        for can in file.can.values() {
            let interface = can.interface.get_ref();
            if !is_interface_name(interface) {
                let remedy = "give 1 to 15 characters without spaces and slashes, e.g. can0";
                self.refuse(&can.interface, format!("{interface:?} is no interface name"), remedy);
            }
            if taken.contains(&interface.as_str()) {
                self.refuse(
                    &can.interface,
                    format!("{interface} serves two buses"),
                    "give each bus its own interface",
                );
            }
            taken.push(interface);
            if let Some(bytes) =
                can.receive_buffer_bytes.as_ref().filter(|bytes| !(4096..=1 << 30).contains(bytes.get_ref()))
            {
                self.refuse(
                    bytes,
                    format!("{} bytes is no usable buffer", bytes.get_ref()),
                    "give 4096 to 1073741824",
                );
            }
        }
        let mut cans = Vec::new();
        for bus in buses {
            match file.can.get(bus) {
                Some(can) => {
                    let buffer = can.receive_buffer_bytes.as_ref();
                    cans.push((
                        can.interface.get_ref().clone(),
                        buffer.map_or(DEFAULT_RECEIVE_BUFFER, |bytes| *bytes.get_ref()),
                    ));
                }
                None => self.refuse_at(
                    0..0,
                    format!("bus {bus} of the vehicle profile has no interface"),
                    &format!("add [can.{bus}] interface = \"can0\""),
                ),
            }
        }
        cans
    }
}

/// An absolute topic: `/a/b`.
pub(super) fn is_topic(topic: &str) -> bool {
    topic.strip_prefix('/').is_some_and(|rest| rest.split('/').all(is_ros_name))
}

fn is_ros_name(name: &str) -> bool {
    name.chars().next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_')
        && name.chars().all(|char| char.is_ascii_alphanumeric() || char == '_')
}

/// As the kernel's `dev_valid_name`.
fn is_interface_name(name: &str) -> bool {
    (1..=15).contains(&name.len())
        && name != "."
        && name != ".."
        && name.chars().all(|char| char.is_ascii_graphic() && char != '/' && char != ':')
}
