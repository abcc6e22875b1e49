//! Current state of the whole gateway in one value, for people and programs that monitor it: terminal, page,
//! `status`, metrics. `docs/status.md` describes its JSON.
//!
//! [`Gateway::snapshot`] creates it. This allocates, so it happens on demand or at a fixed rate, never for
//! each frame. The process around the gateway adds its own state, whose type the gateway does not know.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Gateway;
use super::perception::Perception;
use crate::command::snapshot::CommandSnapshot;
use crate::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use crate::vehicle_report::ReportSnapshot;
use crate::vehicle_status::VehicleStatusSnapshot;
use can_signal::can::BusSnapshot;
use can_signal::validation::snapshot::{MessageSnapshot, SignalSnapshot};
use gateway_base::diagnostics::{Level, Status};
use gateway_base::time::{MonoTime, Now};
use traffic_lights::snapshot::TrafficLightsSnapshot;
use turn_signal::flow::snapshot::DeciderSnapshot;

/// Version of the JSON: incremented when a field is removed or changes its meaning, but not for new fields.
pub const SCHEMA: u32 = 2;

/// The present state of the gateway.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "Snapshot")]
pub struct Snapshot<P> {
    /// Version of this form.
    pub schema: u32,
    /// ROS node name, which begins each diagnostic name.
    pub node: String,
    /// When it was taken, nanoseconds since 1970; in a replay the time of the recording.
    pub stamp_ns: i64,
    /// The worst level of all diagnostics.
    pub level: Level,
    /// The process; `None` in a replay and in a simulation.
    pub process: Option<P>,
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
    /// Returns the raw value of each signal of the lights, followed by those of the status, in the order of
    /// their tables; `None` while it is not valid.
    pub fn raw_values(&self, now: MonoTime) -> Vec<Option<i128>> {
        let Perception { lights, status, buses, .. } = &self.perception;
        let mut values = lights.raw_values(buses, now);
        values.extend(status.raw_values(buses, now));
        values
    }

    /// Returns the current state, without the process. `now` must not precede the last call of the gateway.
    pub fn snapshot<P>(&self, now: Now) -> Snapshot<P> {
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

impl<P> Snapshot<P> {
    /// Returns the remedy for a status, by its task; `None` while the status is OK.
    pub fn remedy(&self, task: &str) -> Option<&str> {
        self.diagnostics.iter().find(|status| status.task == task)?.remedy.as_deref()
    }

    /// Adds the process, and its statuses to the statuses of the gateway.
    #[must_use]
    pub fn with_process(self, process: P, statuses: &[Status]) -> Self {
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
