//! What the gateway's TOML file says, as it stands there. `config/gateway.toml` explains each key.

use std::collections::BTreeMap;
use std::net::IpAddr;

use serde::Deserialize;
use toml::Spanned;

use super::command_file::CommandFile;
use super::traffic_lights_file::TrafficLightsFile;
use super::turn_signal_file::TurnSignalFile;
use super::vehicle_file::VehicleFile;

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
    pub can: BTreeMap<Spanned<String>, CanFile>,
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

/// `[can.<bus>]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CanFile {
    /// SocketCAN interface; also the name in recordings.
    pub interface: Spanned<String>,
    /// Kernel receive buffer to ask for, bytes.
    pub receive_buffer_bytes: Option<Spanned<usize>>,
}

/// `[recording]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingFile {
    /// Recording in any known format, plain or gzip, relative to this file.
    pub file: Spanned<String>,
    /// Factor on the original timing.
    pub speed: Option<Spanned<f64>>,
    /// Start again at the end.
    #[serde(default)]
    pub repeat: bool,
    /// Which time goes into message stamps.
    #[serde(default)]
    pub stamps: Stamps,
}

/// `stamps = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stamps {
    /// Those of the recording.
    #[default]
    Recorded,
    /// Moved by a constant so that playback starts now.
    Now,
}

/// `[reports]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReportsFile {
    /// Rhythm.
    #[serde(default)]
    pub publish: PublishFile,
    /// Rate of periodic publishing, Hz.
    pub rate_hz: Option<Spanned<f64>>,
    /// What late joiners get.
    #[serde(default)]
    pub durability: Durability,
}

/// `publish = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PublishFile {
    /// At `rate_hz`, and at once on a change.
    #[default]
    Periodic,
    /// On a change only.
    OnChange,
}

/// `durability = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Durability {
    /// A late joiner gets the report that is current.
    #[default]
    TransientLocal,
    /// A late joiner waits for the next one.
    Volatile,
}

/// `[diagnostics]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DiagnosticsFile {
    /// Refresh period, ms.
    pub period_ms: Option<Spanned<u64>>,
    /// `DiagnosticStatus.hardware_id`.
    pub hardware_id: Option<Spanned<String>>,
}

/// `[black_box]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlackBoxFile {
    /// Where recordings go, relative to this file.
    pub folder: Option<Spanned<String>>,
    /// Time kept before a change to ERROR, s.
    pub before_s: Option<Spanned<u64>>,
    /// Time kept after it, s.
    pub after_s: Option<Spanned<u64>>,
    /// Recordings kept.
    pub keep: Option<Spanned<usize>>,
}

/// `[ros]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RosFile {
    /// Whether `run` and `demo` publish at all.
    pub enabled: Option<bool>,
    /// Node name.
    pub node: Option<Spanned<String>>,
    /// Namespace.
    pub namespace: Option<Spanned<String>>,
    /// Overrides `ROS_DOMAIN_ID`.
    pub domain_id: Option<Spanned<u16>>,
    /// Own addresses to use; all when empty.
    #[serde(default)]
    pub only_networks: Vec<IpAddr>,
    /// Topic names.
    #[serde(default)]
    pub topics: TopicsFile,
}

/// `[ros.topics]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TopicsFile {
    /// `TurnIndicatorsReport`
    pub turn_indicators_status: Option<Spanned<String>>,
    /// `HazardLightsReport`
    pub hazard_lights_status: Option<Spanned<String>>,
    /// `DiagnosticArray`
    pub diagnostics: Option<Spanned<String>>,
}
