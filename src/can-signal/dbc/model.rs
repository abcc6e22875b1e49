//! Content of a DBC file as far as the gateway uses it, with findings.

use std::sync::Arc;

use super::codec::SignalCodec;
use crate::can::{CanId, FrameFormat};

/// Largest number of entries of a file: messages, signals, properties, names of values, and findings.
pub const MAX_ENTRIES: usize = 250_000;

/// The usable part of a DBC file, with a finding for everything else.
#[derive(Debug, Clone, Default)]
pub struct Database {
    /// Messages in file order, with unique identifiers and names.
    pub messages: Vec<Message>,
    /// Statements that were rejected or are irregular, in line order.
    pub findings: Vec<DbcFinding>,
    /// Names with several definitions; the first definition is in `messages`.
    pub contradictions: Vec<Contradiction>,
    /// True if the file has more entries than [`MAX_ENTRIES`]; then the database is empty.
    pub is_too_large: bool,
}

impl Database {
    /// Returns the message with this name, otherwise the message with this other name; `None` when there is
    /// neither.
    pub fn message(&self, name: &str) -> Option<&Message> {
        let named = self.messages.iter().find(|message| message.name == name);
        named.or_else(|| self.messages.iter().find(|message| message.is_called(name)))
    }

    /// Returns the contradiction that prevents binding a message by the name `given`.
    pub fn contradiction(&self, message: &Message, given: &str) -> Option<&Contradiction> {
        let names = [given, message.name.as_str()];
        self.contradictions.iter().find(|known| known.signal.is_none() && names.contains(&&*known.message))
    }

    /// Returns the contradiction that prevents binding a signal of a message by the name `given`.
    pub fn signal_contradiction(
        &self,
        message: &Message,
        signal: &Signal,
        given: &str,
    ) -> Option<&Contradiction> {
        let is_named = |name: &str| name == given || name == signal.name;
        let of_message = self.contradictions.iter().filter(|known| known.message == message.name);
        of_message.into_iter().find(|known| known.signal.as_deref().is_some_and(is_named))
    }

    /// Returns the number of signals of all messages.
    pub fn signal_count(&self) -> usize {
        self.messages.iter().map(|message| message.signals.len()).sum()
    }

    /// Returns the number of rejected statements.
    pub fn rejected(&self) -> usize {
        self.findings.iter().filter(|finding| finding.severity == DbcSeverity::Rejected).count()
    }
}

/// A name with two different definitions, by which nothing can be bound.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Contradiction {
    /// Name of the message.
    pub message: String,
    /// Name of the signal; `None` if the message itself has two definitions.
    pub signal: Option<String>,
    /// Lines of the first definition and of a different one.
    pub lines: [usize; 2],
}

/// A message of the file (`BO_`).
#[derive(Debug, Clone)]
pub struct Message {
    /// Name of the message, unique in the file: the long name (`SystemMessageLongSymbol`) if there is one.
    pub name: String,
    /// Other name of the message, if any: the name in `BO_`, or a long name that is not unique.
    pub other_name: Option<String>,
    /// Identifier of its frames, unique in the file.
    pub id: CanId,
    /// Length of its frames in bytes, 0 to 64.
    pub length: usize,
    /// Format of its frames according to `VFrameFormat`, otherwise according to the lengths of the file's
    /// messages; `None` = either format, for a short message in a file with long messages.
    pub format: Option<FrameFormat>,
    /// Period in ms, at least 1, from `GenMsgCycleTime` of the message or the file's default; `None` =
    /// unknown.
    pub cycle_ms: Option<u32>,
    /// Line of the `BO_` statement, from 1.
    pub line: usize,
    /// Signals in file order, with unique names.
    pub signals: Vec<Signal>,
}

impl Message {
    /// Returns true if `name` is one of the names of the message.
    pub fn is_called(&self, name: &str) -> bool {
        self.name == name || self.other_name.as_deref() == Some(name)
    }

    /// Returns the signal with this name, otherwise the signal with this other name; `None` when there is
    /// neither.
    pub fn signal(&self, name: &str) -> Option<&Signal> {
        let named = self.signals.iter().find(|signal| signal.name == name);
        named.or_else(|| self.signals.iter().find(|signal| signal.other_name.as_deref() == Some(name)))
    }
}

/// A signal of a message (`SG_`).
#[derive(Debug, Clone)]
pub struct Signal {
    /// Name of the signal, unique in its message: the long name (`SystemSignalLongSymbol`) if there is one.
    pub name: String,
    /// Other name of the signal, if any: the name in `SG_`, or a long name that is not unique.
    pub other_name: Option<String>,
    /// Line of the `SG_` statement, from 1.
    pub line: usize,
    /// Codec with the position of its bits and its multiplexors.
    pub codec: SignalCodec,
    /// Number format of the raw bits.
    pub number: Number,
    /// Physical value of one raw step.
    pub factor: f64,
    /// Physical value of raw 0.
    pub offset: f64,
    /// Physical unit, empty if the file gives none.
    pub unit: String,
    /// Names of raw values (`VAL_`) in file order.
    pub values: Arc<[(i128, String)]>,
}

/// Number format of the raw bits of a signal (`SIG_VALTYPE_`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    /// A signed or unsigned integer.
    Integer,
    /// IEEE 754 single precision (32 bits).
    Float32,
    /// IEEE 754 double precision (64 bits).
    Float64,
}

/// An irregularity in the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DbcFinding {
    /// First line of the statement, from 1.
    pub line: usize,
    /// Consequence of the finding for its statement.
    pub severity: DbcSeverity,
    /// Beginning of the statement on one line.
    pub excerpt: String,
    /// Reason for the finding.
    pub reason: String,
}

/// Consequence of a finding for its statement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum DbcSeverity {
    /// The statement is not used.
    Rejected,
    /// The statement is used, but a significant part of it could not be read.
    Partial,
    /// The statement is used, or not needed.
    Note,
}
