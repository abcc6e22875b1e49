//! Messages and signals that a flow receives, with the meanings of their raw values.
//!
//! Built once at start-up by `config`, which has checked it against the DBC. Everything is addressed by
//! index, so no name is looked up per frame.

use std::time::Duration;

use super::integrity::MessageIntegrity;
use super::meaning::ValueMap;
use crate::can::{BusIndex, CanId, FrameFormat, IdMatch};
use crate::dbc::codec::SignalCodec;

/// A bound message, by position in [`SignalTable::messages`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct MessageIndex(pub usize);

/// A bound signal, by position in [`SignalTable::signals`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct SignalIndex(pub usize);

/// Messages and signals that a flow receives.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SignalTable {
    /// Messages that the flow needs, each once.
    pub messages: Vec<BoundMessage>,
    /// Signals that the flow needs, each once.
    pub signals: Vec<BoundSignal>,
}

impl SignalTable {
    /// Returns the message whose frames have this identifier on a bus; `None` if it is not bound.
    pub fn message_of(&self, bus: BusIndex, id: CanId) -> Option<MessageIndex> {
        self.messages
            .iter()
            .position(|message| message.bus == bus && message.ids.contains(id))
            .map(MessageIndex)
    }
}

/// A message of the DBC on one bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BoundMessage {
    /// Name in the DBC.
    pub name: String,
    /// Bus that carries it; the same identifier on another bus is another message.
    pub bus: BusIndex,
    /// Identifiers of its frames.
    pub ids: IdMatch,
    /// Format of its frames; frames of the other format are rejected; `None` = either.
    pub format: Option<FrameFormat>,
    /// Transmission scheme, which limits the age of its values.
    pub timing: Timing,
    /// Integrity rules that a frame must satisfy before its signals are used; `None` = none.
    pub integrity: Option<MessageIntegrity>,
}

/// Transmission scheme of a message, which limits the age of its values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Timing {
    /// Sent periodically: silence longer than the timeout makes its values unknown.
    Cyclic {
        /// Longest silence during which the values stay valid.
        timeout: Duration,
    },
    /// Sent only on change: its values hold as long as the bus is alive.
    Event,
    /// Sent on change and repeated slowly: both limits apply.
    EventCyclic {
        /// Longest silence during which the values stay valid.
        timeout: Duration,
    },
}

impl Timing {
    /// Returns the longest silence during which the values stay valid; `None` = unlimited.
    pub fn timeout(self) -> Option<Duration> {
        if let Self::Cyclic { timeout } | Self::EventCyclic { timeout } = self { Some(timeout) } else { None }
    }

    /// Returns true if the message is sent on change; a silent bus may then hide a change.
    pub fn is_event(self) -> bool {
        match self {
            Self::Event | Self::EventCyclic { .. } => true,
            Self::Cyclic { .. } => false,
        }
    }
}

/// One signal of a bound message.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundSignal {
    /// Name in texts, `MESSAGE.SIGNAL`.
    pub name: String,
    /// Message that carries it.
    pub message: MessageIndex,
    /// Codec that reads its raw value.
    pub codec: SignalCodec,
}

/// A signal with the meanings of its raw values.
#[derive(Debug, Clone, PartialEq)]
pub struct Role<T> {
    /// The signal that is read.
    pub signal: SignalIndex,
    /// Meanings of its raw values.
    pub values: ValueMap<T>,
}
