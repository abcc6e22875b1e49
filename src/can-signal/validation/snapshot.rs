//! Current values of signals and states of messages, for people and programs that monitor the gateway.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::display::{ValueText, missing_reason_message};
use super::integrity::{IntegrityCounts, Reject};
use super::observation::{MissingReason, Observations};
use super::table::{MessageIndex, SignalIndex, SignalTable};
use crate::can::{Bus, CanId};
use gateway_base::time::{MonoTime, millis};

/// The last value of a signal, with what it is worth now.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct SignalSnapshot {
    /// `MESSAGE.SIGNAL` of the DBC.
    pub name: String,
    /// Bus that carries it, by its name in the vehicle profile.
    pub bus: String,
    /// Message that carries it, by its name in the DBC.
    pub message: String,
    /// Flow that uses it.
    pub used_by: UsedBy,
    /// Last raw value, valid or not; `None` while there is none.
    pub raw: Option<i128>,
    /// Meanings of the raw value for the gateway, e.g. `turn left`; several when it is used in several ways.
    pub meanings: Vec<String>,
    /// True if the profile gives the raw value a meaning in each use.
    pub is_defined: bool,
    /// Time since its frame was received, ms; `None` while there is no value.
    pub age_ms: Option<u64>,
    /// Longest valid age, ms; `None` for no limit.
    pub timeout_ms: Option<u64>,
    /// Why there is no valid value; `None` while the value is valid.
    pub missing: Option<MissingValue>,
}

/// The flow that uses a signal or a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // their names say it
pub enum UsedBy {
    VehicleLights,
    VehicleStatus,
    Command,
    V2i,
}

/// Why there is no valid value.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct MissingValue {
    /// The kind of reason, with its cause where there are several.
    pub reason: MissingReason,
    /// The reason in a sentence.
    pub text: String,
}

/// The present state of a bound message.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct MessageSnapshot {
    /// Name in the DBC.
    pub name: String,
    /// Bus that carries it, by its name in the vehicle profile.
    pub bus: String,
    /// Flow that uses it.
    pub used_by: UsedBy,
    /// Identifier of its frames; of a J1939 message, its identifier in the DBC.
    pub id: u32,
    /// True if the identifier has 29 bits.
    pub is_extended: bool,
    /// Frames since start, those that were rejected included.
    pub frames: u64,
    /// Frames too short for their signals, since start.
    pub too_short: u64,
    /// Frames of the other format, classical CAN or CAN FD, since start.
    pub wrong_format: u64,
    /// Result of the integrity check; `None` for a message without one.
    pub integrity: Option<IntegritySnapshot>,
}

/// The integrity check of a message.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct IntegritySnapshot {
    /// True if frames carry a checksum that is checked.
    pub has_checksum: bool,
    /// True if frames carry a counter that is checked.
    pub has_counter: bool,
    /// True if the last frame was trusted; `None` before the first.
    pub is_trusted: Option<bool>,
    /// Trusted frames since start.
    pub trusted: u64,
    /// Rejected frames since start.
    pub rejected: u64,
    /// Those with a wrong checksum.
    pub wrong_checksum: u64,
    /// Frames missing before trusted ones, by the counter.
    pub lost: u64,
    /// Reason for the last rejection since the link came up; `None` without one.
    pub last_reject: Option<Reject>,
}

/// Signal table of a flow, with the values received for it.
#[derive(Clone, Copy)]
pub struct Received<'a> {
    /// Name of the flow.
    pub used_by: UsedBy,
    /// Messages and signals received by the flow.
    pub table: &'a SignalTable,
    /// Last values of the signals in `table`.
    pub observations: &'a Observations,
    /// Buses that carry the messages.
    pub buses: &'a [Bus],
}

/// Signals and messages of a flow.
pub type ReceivedSnapshot = (Vec<SignalSnapshot>, Vec<MessageSnapshot>);

impl Received<'_> {
    /// Returns the raw value of each signal in the order of the table; `None` while it is not valid.
    pub fn raw_values(self, now: MonoTime) -> Vec<Option<i128>> {
        let Self { table, observations, buses, .. } = self;
        let value = |signal| observations.valid(table, SignalIndex(signal), buses, now).ok();
        (0..table.signals.len()).map(|signal| value(signal).map(|last| last.raw)).collect()
    }

    /// Returns all signals and messages in the order of the table; `texts` returns the meanings of a raw
    /// value, none for a plain number.
    pub fn snapshot(
        self,
        now: MonoTime,
        texts: impl Fn(SignalIndex, i128) -> Vec<ValueText>,
    ) -> ReceivedSnapshot {
        (self.signals(now, texts).collect(), self.messages().collect())
    }

    fn signals(
        self,
        now: MonoTime,
        texts: impl Fn(SignalIndex, i128) -> Vec<ValueText>,
    ) -> impl Iterator<Item = SignalSnapshot> {
        self.table.signals.iter().enumerate().map(move |(index, signal)| {
            let (index, message) = (SignalIndex(index), &self.table.messages[signal.message.0]);
            let last = self.observations.last(index);
            let texts = last.map_or_else(Vec::new, |last| texts(index, last.raw));
            let missing = self.observations.valid(self.table, index, self.buses, now).err();
            SignalSnapshot {
                name: signal.name.clone(),
                bus: self.bus_name(signal.message),
                message: message.name.clone(),
                used_by: self.used_by,
                raw: last.map(|last| last.raw),
                is_defined: last.is_some() && texts.iter().all(|text| text.defined),
                meanings: texts.into_iter().map(|text| text.text).collect(),
                age_ms: last.map(|last| millis(now.since(last.received.at))),
                timeout_ms: message.timing.timeout().map(millis),
                missing: missing.map(|reason| {
                    let text = missing_reason_message(self.table, self.buses, index, reason).text;
                    MissingValue { reason, text }
                }),
            }
        })
    }

    fn messages(self) -> impl Iterator<Item = MessageSnapshot> {
        self.table.messages.iter().enumerate().map(move |(index, message)| {
            let index = MessageIndex(index);
            let counts = self.observations.counts(index);
            let integrity = self.observations.integrity_counts(index).zip(message.integrity.as_ref());
            MessageSnapshot {
                name: message.name.clone(),
                bus: self.bus_name(index),
                used_by: self.used_by,
                id: message.ids.described().number(),
                is_extended: matches!(message.ids.described(), CanId::Extended(_)),
                frames: counts.frames,
                too_short: counts.too_short,
                wrong_format: counts.wrong_format,
                integrity: integrity.map(|(counts, rules)| IntegritySnapshot {
                    has_checksum: rules.protection.has_checksum(),
                    has_counter: rules.protection.counter_rule().is_some(),
                    is_trusted: self.observations.is_trusted(index),
                    trusted: counts.trusted,
                    rejected: IntegrityCounts::rejected(&counts),
                    wrong_checksum: counts.wrong_checksum,
                    lost: counts.lost,
                    last_reject: self.observations.last_reject(index),
                }),
            }
        })
    }

    fn bus_name(self, message: MessageIndex) -> String {
        let bus = self.buses.get(usize::from(self.table.messages[message.0].bus.0));
        bus.map_or_else(String::new, |bus| bus.settings().name.clone())
    }
}
