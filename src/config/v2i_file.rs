//! What a vehicle profile says of traffic-light states received over CAN: the shape of `[[v2i]]`.

use std::collections::BTreeMap;
use std::fmt;

use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Unexpected, Visitor};
use toml::Spanned;

use super::vehicle_file::RawValues;

/// `[[v2i]]`: a signal for one group, or a message that tells of one group after another.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct V2iFile {
    /// The signal with the state.
    pub signal: Spanned<String>,
    /// Its values by what they mean.
    pub states: Spanned<StatesFile>,
    /// Its values for "not available".
    pub not_available: Option<RawValues>,
    /// Its values for "fault".
    pub fault: Option<RawValues>,
    /// How sure the unit is.
    pub confidence: Option<Spanned<ConfidenceFile>>,
    /// Signals that say whether the states can be used.
    #[serde(default)]
    pub status: Vec<StatusFile>,
    /// Of one group or head: its relation or way id.
    pub id: Option<Spanned<i64>>,
    /// Of one group: the arrow of a protected movement.
    pub arrow: Option<Spanned<String>>,
    /// Of a cycling message: the signal with the intersection's number.
    pub intersection: Option<Spanned<String>>,
    /// Of a cycling message: the signal with the signal group's number.
    pub group: Option<Spanned<String>>,
    /// Of a cycling message: which of them are which ids.
    pub groups: Option<Spanned<Vec<Spanned<V2iGroupFile>>>>,
    /// Of a cycling message: longest believed time from one word of a group to the next, ms.
    pub group_timeout_ms: Option<Spanned<u64>>,
}

/// One entry of `groups = [{ … }]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct V2iGroupFile {
    /// Number of the intersection.
    pub intersection: Spanned<i64>,
    /// Number of the signal group there.
    pub group: Spanned<i64>,
    /// Relation or way id.
    pub id: Spanned<i64>,
    /// The arrow of a protected movement.
    pub arrow: Option<Spanned<String>>,
}

/// `confidence = { … }`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConfidenceFile {
    /// `MESSAGE.SIGNAL`
    pub signal: Spanned<String>,
    /// The raw value that means 1.
    pub full: Spanned<u32>,
    /// Values for "not available".
    pub not_available: Option<RawValues>,
}

/// `[[v2i.status]]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatusFile {
    /// `MESSAGE.SIGNAL`
    pub signal: Spanned<String>,
    /// Values that let the states be used.
    pub good: RawValues,
    /// Values that make all states unknown.
    pub bad: RawValues,
}

/// `states = …`
#[derive(Debug, Clone)]
pub enum StatesFile {
    /// The numbers of SAE J2735 and ETSI TS 103 301.
    MovementPhaseState,
    /// Values by state text.
    Texts(BTreeMap<Spanned<String>, RawValues>),
}

impl<'de> Deserialize<'de> for StatesFile {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(StatesVisitor)
    }
}

struct StatesVisitor;

impl<'de> Visitor<'de> for StatesVisitor {
    type Value = StatesFile;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("\"movement_phase_state\", or states with their raw values such as { \"red\" = [3] }")
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<StatesFile, E> {
        if text == "movement_phase_state" {
            Ok(StatesFile::MovementPhaseState)
        } else {
            Err(E::invalid_value(Unexpected::Str(text), &self))
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<StatesFile, A::Error> {
        Deserialize::deserialize(MapAccessDeserializer::new(map)).map(StatesFile::Texts)
    }
}
