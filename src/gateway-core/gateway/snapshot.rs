//! The present state of the whole gateway in one value, for people and programs that watch it: terminal,
//! page, `status`, metrics. `docs/status.md` describes its JSON.
//!
//! [`Gateway::snapshot`] takes it. It allocates, and is taken on demand or at a fixed rate, never for each
//! frame.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Gateway;
use super::configuration::ConfigurationState;
use super::network::{NetworkFailure, NetworkState, ZenohLinks};
use super::process_status::{LogState, RecorderState};
use crate::command::snapshot::CommandSnapshot;
use crate::provenance::ProvenanceSummary;
use crate::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use crate::vehicle_report::ReportSnapshot;
use crate::vehicle_status::VehicleStatusSnapshot;
use can_signal::can::BusSnapshot;
use can_signal::validation::snapshot::{MessageSnapshot, SignalSnapshot};
use gateway_base::diagnostics::{Level, Status};
use gateway_base::time::{Now, millis};
use traffic_lights::snapshot::TrafficLightsSnapshot;
use turn_signal::flow::snapshot::DeciderSnapshot;

/// Version of the JSON: it grows when a field changes its meaning or goes. New fields leave it as it is.
pub const SCHEMA: u32 = 2;

/// The present state of the gateway.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Snapshot {
    /// Version of this form.
    pub schema: u32,
    /// ROS node name, which begins each diagnostic name.
    pub node: String,
    /// When it was taken, nanoseconds since 1970; in a replay the time of the recording.
    pub stamp_ns: i64,
    /// The worst level of all diagnostics.
    pub level: Level,
    /// The process; `None` in a replay and in a simulation.
    pub process: Option<ProcessSnapshot>,
    /// Report on turn indicators; `None` when the profile leaves it out.
    pub turn_indicators: Option<ReportSnapshot<TurnIndicators>>,
    /// Report on hazard lights, with the fields of `turn_indicators`, where `published` is `DISABLE` or
    /// `ENABLE`. `None` when the profile leaves it out.
    pub hazard_lights: Option<ReportSnapshot<HazardLights>>,
    /// Steering, gear, control mode and doors, as far as the profile describes them.
    pub vehicle_status: VehicleStatusSnapshot,
    /// Commands to the vehicle; `None` unless configured.
    pub commands: Option<CommandSnapshot>,
    /// The buses, in the order of the vehicle profile.
    pub buses: Vec<BusSnapshot>,
    /// All signals that are received, by flow.
    pub signals: Vec<SignalSnapshot>,
    /// All messages that are received, by flow.
    pub messages: Vec<MessageSnapshot>,
    /// Traffic lights; `None` unless configured.
    pub traffic_lights: Option<TrafficLightsSnapshot>,
    /// Turn signal decider; `None` unless it runs.
    pub decider: Option<DeciderSnapshot>,
    /// All diagnostic statuses, in the order in which they are published.
    pub diagnostics: Vec<StatusSnapshot>,
}

/// The process that the gateway runs in.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ProcessSnapshot {
    /// Name of the vehicle profile.
    pub vehicle: String,
    /// How many facts of the vehicle profile have been verified, and which have not.
    pub provenance: ProvenanceSummary,
    /// Id of the process.
    pub pid: u32,
    /// Time since its start, ms.
    pub uptime_ms: u64,
    /// Version and origin of the binary.
    pub build: Build,
    /// The configuration; `None` where it cannot be reloaded.
    pub configuration: Option<ConfigurationState>,
    /// Black-box files; `None` without a folder for them.
    pub black_box: Option<RecorderState>,
    /// Number of the next change of the history; a greater one than before means that there are new changes.
    #[serde(default)]
    pub next_change: u64,
    /// Log; `None` without one.
    pub log: Option<LogState>,
    /// ROS 2; `None` while it is off.
    pub ros: Option<RosSnapshot>,
}

/// The origin of a binary.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Build {
    /// Version of the package.
    pub version: String,
    /// Commit that it was built of; `None` where the build did not know it.
    pub commit: Option<String>,
    /// ROS 2 distribution; `None` in a build without ROS 2.
    pub distribution: Option<String>,
}

/// The connection to ROS 2.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct RosSnapshot {
    /// Number of the domain, `ROS_DOMAIN_ID`.
    pub domain_id: u16,
    /// True while the network side has joined the network and answers.
    pub is_up: bool,
    /// Times since start that the network side was replaced.
    pub restarts: u64,
    /// Why it ended the last time; `None` if it has not.
    pub last_failure: Option<NetworkFailure>,
    /// Time since it joined the network, ms; `None` while it is not up.
    pub joined_ms: Option<u64>,
    /// Memory in use by its process, bytes; `None` where that is not known.
    pub memory_bytes: Option<u64>,
    /// Topics that are written.
    pub written: Vec<TopicSnapshot>,
    /// Topics that are read.
    pub read: Vec<TopicSnapshot>,
    /// Connections of Zenoh; `None` with DDS, which has none.
    pub links: Option<ZenohLinks>,
    /// Participants whose lease ran out, until a new participant has found them.
    pub missing_peers: u64,
    /// Samples since start that could not be written.
    pub write_errors: u64,
}

/// A topic, and who is on its other end.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct TopicSnapshot {
    /// Absolute name of the topic.
    pub name: String,
    /// Readers of a topic that is written, writers of one that is read.
    pub peers: u64,
    /// Writers of other nodes on a topic that is written; 0 for one that is read.
    pub other_writers: u64,
}

/// A diagnostic status, as it is published.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct StatusSnapshot {
    /// Name of the task, without the name of the node.
    pub task: String,
    /// How severe the status is.
    pub level: Level,
    /// Text that says what is wrong.
    pub message: String,
    /// What to do; `None` while the status is OK.
    pub remedy: Option<String>,
    /// Where the status is documented: a file of the project and an anchor in it; `None` while the status is
    /// OK.
    pub document: Option<String>,
    /// Details in a fixed order.
    pub values: Vec<KeyValue>,
}

/// One detail of a status.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct KeyValue {
    /// Name, which ends in its unit. A name may come more than once.
    pub key: String,
    /// The value, as text.
    pub value: String,
}

impl Gateway {
    /// Returns the present state. `now` is not before the last call of the gateway.
    pub fn snapshot(&self, now: Now) -> Snapshot {
        let (perception, mono) = (&self.perception, now.mono);
        let (lights, buses) = (&perception.lights, &perception.buses);
        let mut received =
            vec![lights.received_snapshot(buses, mono), perception.status.received_snapshot(buses, mono)];
        received.extend(self.commands.as_ref().map(|flow| flow.received_snapshot(buses, mono)));
        let traffic_lights = perception.traffic_lights.as_ref();
        received.extend(traffic_lights.map(|lights| lights.reception.received_snapshot(buses, mono)));
        let (signals, messages): (Vec<_>, Vec<_>) = received.into_iter().unzip();
        let snapshot = Snapshot {
            schema: SCHEMA,
            node: perception.node.clone(),
            stamp_ns: now.wall.as_nanos(),
            level: Level::Ok,
            process: None,
            turn_indicators: lights.turn_snapshot(buses, mono),
            hazard_lights: lights.hazard_snapshot(buses, mono),
            vehicle_status: perception.status.snapshot(buses, mono),
            commands: self.commands.as_ref().map(|flow| flow.snapshot(buses, mono)),
            buses: perception.bus_snapshots(mono).collect(),
            signals: signals.into_iter().flatten().collect(),
            messages: messages.into_iter().flatten().collect(),
            traffic_lights: traffic_lights.map(|lights| lights.flow.snapshot()),
            decider: perception.turn_signal.as_ref().map(|flow| flow.snapshot(mono)),
            diagnostics: Vec::new(),
        };
        snapshot.with_statuses(&self.statuses(mono))
    }
}

impl Snapshot {
    /// Returns what to do about a status, by its task; `None` while it is OK.
    pub fn remedy(&self, task: &str) -> Option<&str> {
        self.diagnostics.iter().find(|status| status.task == task)?.remedy.as_deref()
    }

    /// Adds the process, and its statuses to the statuses of the gateway.
    #[must_use]
    pub fn with_process(self, process: ProcessSnapshot, statuses: &[Status]) -> Self {
        Self { process: Some(process), ..self }.with_statuses(statuses)
    }

    fn with_statuses(mut self, statuses: &[Status]) -> Self {
        self.level = statuses.iter().map(|status| status.level).fold(self.level, Level::max);
        self.diagnostics.extend(statuses.iter().map(|status| {
            StatusSnapshot {
                task: status.task.clone(),
                level: status.level,
                message: status.message.clone(),
                remedy: (!status.remedy.is_empty()).then(|| status.remedy.clone()),
                document: status.document(),
                values: status
                    .values
                    .iter()
                    .map(|(key, value)| KeyValue { key: (*key).to_owned(), value: value.clone() })
                    .collect(),
            }
        }));
        self
    }
}

impl RosSnapshot {
    /// The part of it that its network side gives.
    pub fn of(network: &NetworkState) -> Self {
        Self {
            is_up: network.is_up,
            restarts: network.restarts,
            last_failure: network.last_failure.clone(),
            joined_ms: network.age.map(millis),
            memory_bytes: network.memory_bytes,
            links: network.links.clone(),
            ..Self::default()
        }
    }
}
