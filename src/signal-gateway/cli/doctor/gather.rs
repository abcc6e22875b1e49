//! Gathers the facts of a set-up. Nothing is changed and nothing is sent on a bus.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::thread::{self, JoinHandle, sleep};
use std::time::Duration;

use super::super::against_running::plan_for;
use super::super::arguments::{DEFAULT_CONFIG, settings_in};
use super::super::failure::Failure;
use super::super::progress::ProgressDisplay;
use super::super::running::likely_socket;
use super::arguments::DoctorArgs;
use crate::check::doctor::facts::{
    ConfigurationFacts, ConfigurationProblem, Facts, FolderFacts, InterfaceFacts, Known, PermissionFacts,
    Reach, RosFacts, RunningFacts, VARIABLES,
};
use crate::check::hiding_folder;
use crate::config::files::ListedDisk;
use crate::config::ros_names::RosOverrides;
use crate::config::{Refused, Settings};
use crate::daemon::bus_survey;
use crate::daemon::publisher::ros_settings;
use crate::io::can::check_can_sockets;
use crate::io::can::interface_settings::interface_state;
use crate::io::can::interfaces::can_interfaces;
use crate::io::can::sender_lock::is_locked;
use crate::io::clock_state::ClockWatch;
use crate::io::folder_access::check_writable;
use crate::io::ros::own_topics::own_topics;
use crate::io::ros::settings::RosSettings;
use crate::io::service_state::service_state;
use crate::io::service_user::unreadable_for_service;
use crate::io::snapshots::client::{ClientError, StatusClient};
use crate::process_status::configuration::ReloadPlan;
use can_signal::can::bus_survey::BusSurvey;
use can_signal::can::interface_state::{InterfaceKind, InterfaceState};
use can_signal::can::{BusIndex, IdMatch};
use gateway_base::time::millis;
use ros_transport::settings::Transport;
use ros_transport::survey::DomainSurvey;
use ros_transport::survey_domain;

/// An interface to examine, before querying the kernel.
struct Examined {
    name: String,
    bus: String,
    sends: Option<bool>,
    /// Identifiers that the vehicle profile uses.
    profile: Option<Vec<IdMatch>>,
}

/// Gathers all facts, for as long as the user wants to listen; `None` if a signal ended it early.
pub(super) fn gather(args: &DoctorArgs) -> Result<Option<Facts>, Failure> {
    let files = ListedDisk::default();
    let (configuration, settings) = configuration(args, &files);
    let settings = settings.as_ref();
    let environment: BTreeMap<_, _> =
        VARIABLES.into_iter().filter_map(|name| Some((name.to_owned(), std::env::var(name).ok()?))).collect();
    let examined = examined(args, settings);
    let (mut ros, surveys) = ros(settings, &environment, args.seconds);
    let clock = ClockWatch::start();
    let _progress = ProgressDisplay::spinner("listening");
    let Some(heard) = listen(&examined, args.seconds)? else { return Ok(None) };
    if let (Some(ros), Some([own, shell])) = (&mut ros, surveys) {
        let survey = own.map_or_else(|| Err("this shell has no domain".to_owned()), joined);
        ros.survey = survey.map_or_else(Known::No, Known::Yes);
        ros.shell_survey = shell.and_then(|shell| joined(shell).ok());
    }
    let clock = clock.state();
    let running = running(args, settings);
    let permissions = permissions(settings, configuration.as_ref(), &files, &examined);
    let interfaces = examined.into_iter().zip(heard).map(|(examined, survey)| InterfaceFacts {
        // Queried again, since the state may have changed while listening.
        state: interface_state(&examined.name),
        bus: examined.bus,
        sends: examined.sends,
        survey,
    });
    Ok(Some(Facts {
        listened_ms: millis(args.seconds),
        configuration,
        interfaces: interfaces.collect(),
        known_interfaces: can_interfaces(),
        environment,
        ros,
        service: service_state().map_or_else(|error| Known::No(error.to_string()), Known::Yes),
        running,
        permissions,
        clock,
    }))
}

/// Reads the configuration, unless only interfaces are examined.
fn configuration(args: &DoctorArgs, files: &ListedDisk) -> (Option<ConfigurationFacts>, Option<Settings>) {
    let is_given = args.config.config.is_some() || args.config.profile.is_some();
    let default = Path::new(DEFAULT_CONFIG);
    if !args.interface.is_empty() || !is_given && !is_there(default) {
        return (None, None);
    }
    let named = args.config.config.as_deref().or(args.config.profile.as_deref());
    let path = named.unwrap_or(default);
    let facts = ConfigurationFacts { path: path.display().to_string(), ..ConfigurationFacts::default() };
    match settings_in(files, &args.config, &RosOverrides::default()) {
        Ok(settings) => {
            (Some(ConfigurationFacts { vehicle: settings.vehicle.clone(), ..facts }), Some(settings))
        }
        Err(failure) => {
            let problem = match File::open(path).map_err(|error| error.kind()) {
                Err(io::ErrorKind::NotFound) if args.config.config.is_some() => ConfigurationProblem::Missing,
                Err(io::ErrorKind::PermissionDenied) => ConfigurationProblem::Denied,
                Ok(_) | Err(_) => ConfigurationProblem::Refused(first_reason(&failure)),
            };
            (Some(ConfigurationFacts { problem: Some(problem), ..facts }), None)
        }
    }
}

/// Returns true if the path exists, even if it may not be read.
fn is_there(path: &Path) -> bool {
    !matches!(path.symlink_metadata(), Err(error) if error.kind() == io::ErrorKind::NotFound)
}

#[allow(clippy::wildcard_enum_match_arm)] // other failures are one reason
fn first_reason(failure: &Failure) -> String {
    match failure {
        Failure::Refused(Refused(problems)) => match problems.as_slice() {
            [] => "no reason was given".to_owned(),
            [only] => only.to_string(),
            [first, rest @ ..] => format!("{first} (and {} more)", rest.len()),
        },
        other => other.to_string(),
    }
}

fn examined(args: &DoctorArgs, settings: Option<&Settings>) -> Vec<Examined> {
    let Some(settings) = settings else {
        let names = if args.interface.is_empty() { can_interfaces() } else { args.interface.clone() };
        let examined = |name| Examined { name, bus: String::new(), sends: None, profile: None };
        return names.into_iter().map(examined).collect();
    };
    let gateway = &settings.gateway;
    let sending = gateway.command_interfaces();
    let buses = (0..=u8::MAX).map(BusIndex).zip(&gateway.buses);
    let examined = buses.map(|(index, bus)| Examined {
        name: bus.interface.clone(),
        bus: bus.name.clone(),
        sends: Some(sending.contains(bus.interface.as_str())),
        profile: Some(gateway.relevant_ids(index)),
    });
    examined.collect()
}

/// Listens on the interfaces that are up; returns `None` if a signal ended it.
fn listen(examined: &[Examined], time: Duration) -> Result<Option<Vec<Known<BusSurvey>>>, Failure> {
    let states: Vec<_> = examined.iter().map(|examined| interface_state(&examined.name)).collect();
    let is_heard = |state: &InterfaceState| state.kind == InterfaceKind::Can && state.is_up;
    let pairs = || examined.iter().zip(&states);
    let heard = pairs().filter(|(_, state)| is_heard(state)).map(|(examined, _)| examined);
    let heard: Vec<_> = heard.map(|examined| (examined.name.clone(), examined.profile.clone())).collect();
    if heard.is_empty() {
        // The domain is still observed for this time.
        sleep(time);
        return Ok(Some(states.iter().map(not_heard).collect()));
    }
    let Some(surveys) = bus_survey::survey(heard, time)? else { return Ok(None) };
    let mut surveys = surveys.into_iter();
    let survey = |(_, state): (_, &InterfaceState)| {
        let survey = is_heard(state).then(|| surveys.next()).flatten();
        survey.map_or(not_heard(state), Known::Yes)
    };
    Ok(Some(pairs().map(survey).collect()))
}

fn not_heard(state: &InterfaceState) -> Known<BusSurvey> {
    let is_down = state.kind == InterfaceKind::Can && !state.is_up;
    Known::No(if is_down { "it is down" } else { "it cannot be used" }.to_owned())
}

type Survey = JoinHandle<Result<DomainSurvey, String>>;

fn joined(survey: Survey) -> Result<DomainSurvey, String> {
    survey.join().unwrap_or_else(|_panic| Err("the survey of the domain has failed".to_owned()))
}

/// Returns the ROS 2 side of the configuration, and starts surveys of its domain and the shell's domain.
fn ros(
    settings: Option<&Settings>,
    environment: &BTreeMap<String, String>,
    time: Duration,
) -> (Option<RosFacts>, Option<[Option<Survey>; 2]>) {
    let Some(settings) = settings else { return (None, None) };
    let (enabled, is_domain_configured) = (settings.ros.enabled, settings.ros.domain_id.is_some());
    let facts = RosFacts { enabled, is_domain_configured, ..RosFacts::default() };
    let ros = match ros_settings(settings) {
        Ok(ros) => ros,
        Err(error) => return (Some(RosFacts { problem: Some(error.to_string()), ..facts }), None),
    };
    let (written, read) = own_topics(&ros);
    let is_zenoh = ros.transport != Transport::Dds;
    let not_surveyed =
        if is_zenoh { "with Zenoh there is no discovery by DDS" } else { "the domain was not joined" };
    let facts = RosFacts {
        is_zenoh,
        domain_id: ros.domain_id,
        only_networks: ros.only_networks.iter().map(ToString::to_string).collect(),
        written,
        read,
        survey: Known::No(not_surveyed.to_owned()),
        ..facts
    };
    if !facts.enabled || is_zenoh {
        return (Some(facts), None);
    }
    let shell = environment.get("ROS_DOMAIN_ID").map_or(Some(0), |text| text.parse().ok());
    let shell = shell.filter(|shell| *shell != ros.domain_id && *shell <= 232);
    let surveys =
        [Some(ros.domain_id), shell].map(|domain| domain.map(|domain| start(domain, &ros, &facts, time)));
    (Some(facts), Some(surveys))
}

fn start(domain_id: u16, ros: &RosSettings, facts: &RosFacts, time: Duration) -> Survey {
    let topics: Vec<_> = facts.written.iter().chain(&facts.read).map(|topic| topic.name.clone()).collect();
    let only_networks = ros.only_networks.clone();
    thread::spawn(move || {
        survey_domain(domain_id, &only_networks, &topics, time).map_err(|error| error.to_string())
    })
}

fn running(args: &DoctorArgs, settings: Option<&Settings>) -> RunningFacts {
    let configured = settings.and_then(|settings| settings.status.socket.clone());
    let likely = || likely_socket(settings.map_or(Path::new(DEFAULT_CONFIG), |settings| &settings.file));
    let socket = args.socket.clone().or(configured).unwrap_or_else(likely);
    let facts = RunningFacts { socket: socket.display().to_string(), ..RunningFacts::default() };
    let received = StatusClient::connect(&socket).and_then(|mut client| client.receive());
    let snapshot = match received {
        Ok((snapshot, _)) => snapshot,
        Err(ClientError::Socket(error)) => {
            let is_denied = error.kind() == io::ErrorKind::PermissionDenied;
            return RunningFacts { reach: if is_denied { Reach::Denied } else { Reach::Absent }, ..facts };
        }
        Err(ClientError::Busy | ClientError::NoHistory | ClientError::Unreadable(_)) => {
            return RunningFacts { reach: Reach::Unreadable, ..facts };
        }
    };
    let ros = snapshot.process.as_ref().and_then(|process| process.ros.as_ref());
    let plan = settings.and_then(|settings| plan_for(settings, &snapshot));
    let parts = |plan: ReloadPlan| plan.restart.into_iter().chain(plan.reloadable).map(|change| change.part);
    let differences = plan.map(|plan| parts(plan).collect());
    RunningFacts {
        reach: Reach::Served,
        domain_id: ros.map(|ros| ros.domain_id),
        written: ros.iter().flat_map(|ros| &ros.written).map(|topic| topic.name.clone()).collect(),
        differences,
        ..facts
    }
}

fn permissions(
    settings: Option<&Settings>,
    configuration: Option<&ConfigurationFacts>,
    files: &ListedDisk,
    examined: &[Examined],
) -> PermissionFacts {
    let folders = settings.map_or(Vec::new(), |settings| {
        let keys =
            [("[black_box] folder", &settings.black_box.folder), ("[mcap] folder", &settings.mcap.folder)];
        keys.into_iter().filter_map(|(key, folder)| Some(folder_facts(key, folder.as_ref()?))).collect()
    });
    let is_of_service = configuration.is_some_and(|configuration| configuration.path == DEFAULT_CONFIG);
    let read = if is_of_service { files.paths() } else { Vec::new() };
    let names = examined.iter().map(|examined| &examined.name);
    let shown = |path: &PathBuf| path.display().to_string();
    let (hidden, visible): (Vec<_>, Vec<_>) =
        read.into_iter().partition(|path| hiding_folder(path).is_some());
    let unreadable = if visible.is_empty() { None } else { unreadable_for_service(&visible) };
    PermissionFacts {
        can_socket_errno: check_can_sockets().err().map(|error| error.raw_os_error().unwrap_or(libc::EIO)),
        folders,
        hidden_from_service: hidden.iter().map(shown).collect(),
        unreadable_for_service: unreadable.map(|paths| paths.iter().map(shown).collect()),
        locked_interfaces: names.filter(|name| is_locked(name)).cloned().collect(),
    }
}

#[allow(clippy::wildcard_enum_match_arm)] // there are forty kinds
fn folder_facts(key: &str, folder: &Path) -> FolderFacts {
    let problem = check_writable(folder).err().map(|error| match error.kind() {
        io::ErrorKind::PermissionDenied => "this user may not write there".to_owned(),
        io::ErrorKind::NotADirectory => "it, or what it lies in, is not a folder".to_owned(),
        io::ErrorKind::ReadOnlyFilesystem => "the file system is read-only".to_owned(),
        _ => error.to_string(),
    });
    FolderFacts { key: key.to_owned(), path: folder.display().to_string(), problem }
}
