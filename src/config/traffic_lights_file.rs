//! What `[traffic_lights]` of the gateway's file says, as it stands there.

use serde::Deserialize;
use toml::Spanned;

/// `[traffic_lights]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrafficLightsFile {
    /// Scenario, relative to this file.
    pub scenario: Option<Spanned<String>>,
    /// Lanelet2 map, relative to this file.
    pub map: Option<Spanned<String>>,
    /// Whose behaviour.
    #[serde(default)]
    pub compat: CompatFile,
    /// Generation of Autoware, `awf/universe/<yyyymmdd>`.
    pub architecture: Option<Spanned<String>>,
    /// Evaluation and camera topic, Hz.
    pub frame_rate_hz: Option<Spanned<f64>>,
    /// Ground-truth topic and markers, Hz.
    pub ground_truth_rate_hz: Option<Spanned<f64>>,
    /// V2I topics, Hz.
    pub v2i_rate_hz: Option<Spanned<f64>>,
    /// Enabling a head for V2I copies what it shows.
    pub copy_on_enable: Option<bool>,
    /// A group is sent once for each lit head.
    pub one_group_per_head: Option<bool>,
    /// Limit of V2I states that come over ROS 2 and are not renewed, ms.
    pub v2i_timeout_ms: Option<Spanned<u64>>,
    /// Lamps of heads whose lamps the map does not draw.
    #[serde(default)]
    pub infer_lamps: bool,
    /// Names of the topics that are written.
    #[serde(default)]
    pub topics: LightTopicsFile,
    /// Topics that are read.
    #[serde(default)]
    pub inputs: LightInputsFile,
    /// The arbiter's view.
    pub arbiter: Option<ArbiterFile>,
    /// Faults on purpose.
    #[serde(default)]
    pub faults: ChannelFaultsFile,
}

/// `compat = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CompatFile {
    /// Ours.
    #[default]
    Improved,
    /// The simulator's.
    Upstream,
}

/// `[traffic_lights.topics]`; an empty name = not published.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightTopicsFile {
    /// `TrafficLightArrayV1`
    pub ground_truth: Option<Spanned<String>>,
    /// By architecture.
    pub camera: Option<Spanned<String>>,
    /// By architecture.
    pub v2i: Option<Spanned<String>>,
    /// The older name of the same.
    pub v2i_legacy: Option<Spanned<String>>,
    /// `TrafficLightGroupArray`
    pub arbiter: Option<Spanned<String>>,
    /// `MarkerArray`
    pub markers: Option<Spanned<String>>,
}

/// `[traffic_lights.inputs]`; absent = not read.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightInputsFile {
    /// `TrafficLightGroupArray` for a store.
    pub conventional: Option<Spanned<String>>,
    /// Likewise.
    pub conventional_detected: Option<Spanned<String>>,
    /// Likewise.
    pub v2i: Option<Spanned<String>>,
    /// Likewise.
    pub v2i_detected: Option<Spanned<String>>,
    /// `std_msgs/String`: actions.
    pub command: Option<Spanned<String>>,
}

/// `[traffic_lights.arbiter]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArbiterFile {
    /// Seconds.
    pub external_delay_tolerance_s: Option<Spanned<f64>>,
    /// Seconds.
    pub external_time_tolerance_s: Option<Spanned<f64>>,
    /// Seconds.
    pub perception_time_tolerance_s: Option<Spanned<f64>>,
    /// `confidence`, `external` or `perception`.
    pub source_priority: Option<Spanned<String>>,
    /// Only what both sides say counts.
    #[serde(default)]
    pub enable_signal_matching: bool,
}

/// `[traffic_lights.faults]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelFaultsFile {
    /// On the camera topic.
    pub camera: Option<Spanned<FaultsFile>>,
    /// On the V2I topics.
    pub v2i: Option<Spanned<FaultsFile>>,
}

/// `[traffic_lights.faults.<channel>]`; every key is off by default.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaultsFile {
    /// Another seed, other faults.
    #[serde(default)]
    pub seed: u64,
    /// Mean latency, ms.
    #[serde(default)]
    pub latency_ms: u64,
    /// Most that it varies, ms.
    #[serde(default)]
    pub jitter_ms: u64,
    /// Probability that a message is lost.
    #[serde(default)]
    pub loss: f64,
    /// Probability that the sender freezes.
    #[serde(default)]
    pub freeze: f64,
    /// For how many messages, on average.
    pub freeze_messages: Option<f64>,
    /// Added to the stamp, ms.
    #[serde(default)]
    pub stamp_offset_ms: i64,
    /// Probability that a group is missing.
    #[serde(default)]
    pub miss: f64,
    /// For how many messages, on average.
    pub miss_messages: Option<f64>,
    /// Probability that a group is unknown.
    #[serde(default)]
    pub unknown: f64,
    /// Colours taken for others.
    #[serde(default)]
    pub confusion: Vec<ConfusionFile>,
    /// Mean confidence.
    pub confidence: Option<f64>,
    /// Its standard deviation.
    #[serde(default)]
    pub confidence_spread: f64,
}

/// One entry of `confusion`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConfusionFile {
    /// What it is.
    pub from: Spanned<String>,
    /// What it is taken for.
    pub to: Spanned<String>,
    /// How often.
    pub probability: f64,
}
