//! What a flow receives, compiled: its messages, their signals, and what raw values mean.
//!
//! Built once at start by `config`, which has checked it against the DBC. Everything here is by
//! index: nothing is looked up by name per frame.

use std::time::Duration;

use super::integrity::MessageIntegrity;
use super::meaning::ValueMap;
use crate::core::can::frame::CanId;
use crate::core::can::link::BusIndex;
use crate::core::dbc::codec::SignalCodec;

/// A bound message, by position in [`SignalTable::messages`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct MessageIndex(pub usize);

/// A bound signal, by position in [`SignalTable::signals`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct SignalIndex(pub usize);

/// The messages and signals a flow receives.
#[derive(Debug, Clone, Default)]
pub struct SignalTable {
    /// The messages needed, each once.
    pub messages: Vec<BoundMessage>,
    /// The signals needed, each once.
    pub signals: Vec<BoundSignal>,
}

/// A message of the DBC on one bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BoundMessage {
    /// DBC name.
    pub name: String,
    /// The bus it comes on; the same id on another bus is another message.
    pub bus: BusIndex,
    /// Identifier.
    pub id: CanId,
    /// How long its values may be believed.
    pub timing: Timing,
    /// What its frames must prove before any of their signals is used.
    pub integrity: Option<MessageIntegrity>,
}

/// How a message is sent, and so how long its last values may be believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Timing {
    /// Sent again and again: silence longer than the limit makes its values unknown.
    Cyclic {
        /// Longest silence that is still believed.
        timeout: Duration,
    },
    /// Sent on change only: its values hold as long as the bus is alive.
    Event,
    /// Sent on change and slowly repeated: both must hold.
    EventCyclic {
        /// Longest silence that is still believed.
        timeout: Duration,
    },
}

impl Timing {
    /// Longest silence of the message that is still believed.
    pub fn timeout(self) -> Option<Duration> {
        match self {
            Self::Cyclic { timeout } | Self::EventCyclic { timeout } => Some(timeout),
            Self::Event => None,
        }
    }

    /// Whether it is sent on change: a change may be missed while the bus is silent.
    pub fn is_event(self) -> bool {
        match self {
            Self::Event | Self::EventCyclic { .. } => true,
            Self::Cyclic { .. } => false,
        }
    }
}

/// One signal of a bound message.
#[derive(Debug, Clone)]
pub struct BoundSignal {
    /// `MESSAGE.SIGNAL`, for people.
    pub name: String,
    /// The message that carries it.
    pub message: MessageIndex,
    /// How to read it.
    pub codec: SignalCodec,
}

/// A signal with the meaning of its raw values.
#[derive(Debug, Clone)]
pub struct Role<T> {
    /// The signal.
    pub signal: SignalIndex,
    /// Its values.
    pub values: ValueMap<T>,
}

/// One signal that reports a fault.
#[derive(Debug, Clone)]
pub struct FaultSignal {
    /// `true` = broken.
    pub role: Role<bool>,
    /// What an operator reads, e.g. `left front lamp`.
    pub text: String,
}
