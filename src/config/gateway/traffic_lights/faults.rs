//! `[traffic_lights.faults]`: faults on purpose.

use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use crate::config::reading::checker::Checker;
use crate::core::traffic_light::bulb::Color;
use crate::core::traffic_light::faults::{Confusion, FaultSettings, Faults, Spells};

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

/// The faults of one channel.
pub(super) fn faults(checker: &mut Checker<'_>, given: Option<&Spanned<FaultsFile>>) -> Option<Faults> {
    let given = given?;
    let file = given.get_ref();
    let spells = |probability: f64, messages: Option<f64>| Spells {
        probability,
        mean_length: messages.unwrap_or(1.0),
    };
    let settings = FaultSettings {
        seed: file.seed,
        latency: Duration::from_millis(file.latency_ms),
        jitter: Duration::from_millis(file.jitter_ms),
        loss: file.loss,
        freeze: spells(file.freeze, file.freeze_messages),
        stamp_offset_ns: file.stamp_offset_ms.saturating_mul(1_000_000),
        miss: spells(file.miss, file.miss_messages),
        unknown: file.unknown,
        confusions: file.confusion.iter().filter_map(|entry| confusion(checker, entry)).collect(),
        confidence_mean: file.confidence,
        confidence_spread: file.confidence_spread,
    };
    Faults::new(settings).map_err(|error| checker.refuse(given, error.to_string(), "")).ok()
}

fn confusion(checker: &mut Checker<'_>, file: &ConfusionFile) -> Option<Confusion> {
    let mut color = |given: &Spanned<String>| {
        given.get_ref().parse::<Color>().map_err(|error| checker.refuse(given, error.to_string(), "")).ok()
    };
    let (from, to) = (color(&file.from), color(&file.to));
    Some(Confusion { from: from?, to: to?, probability: file.probability })
}
