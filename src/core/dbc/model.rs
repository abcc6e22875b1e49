//! Content of a DBC file as far as a gateway uses it, with findings.

use std::sync::Arc;

use super::codec::SignalCodec;
use crate::core::can::{CanId, FrameFormat};

/// Largest number of entries of a file: messages, signals, properties, names of values, and findings.
pub const MAX_ENTRIES: usize = 250_000;

/// The usable part of a DBC file, with a finding for everything else.
#[derive(Debug, Clone, Default)]
pub struct Database {
    /// Messages in the order of the file, with unique identifiers and names.
    pub messages: Vec<Message>,
    /// Statements that were rejected or are irregular, in the order of lines.
    pub findings: Vec<DbcFinding>,
    /// True if the file has more entries than [`MAX_ENTRIES`]; then the database is empty.
    pub is_too_large: bool,
}

impl Database {
    /// Returns the message with this name; `None` when there is none.
    pub fn message(&self, name: &str) -> Option<&Message> {
        self.messages.iter().find(|message| message.name == name)
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

/// A message of the file (`BO_`).
#[derive(Debug, Clone)]
pub struct Message {
    /// Name of the message, unique in the file.
    pub name: String,
    /// Identifier of its frames, unique in the file.
    pub id: CanId,
    /// Length of its frames in bytes, 0 to 64.
    pub length: usize,
    /// Format of its frames by `VFrameFormat`, else by the lengths of the file's messages; `None` = either, for a
    /// short message of a file with long ones.
    pub format: Option<FrameFormat>,
    /// `GenMsgCycleTime` in ms, of the message or the default of the file, at least 1; `None` = unknown.
    pub cycle_ms: Option<u32>,
    /// Line of the `BO_` statement, from 1.
    pub line: usize,
    /// Signals in the order of the file, with unique names.
    pub signals: Vec<Signal>,
}

impl Message {
    /// Returns the signal with this name; `None` when there is none.
    pub fn signal(&self, name: &str) -> Option<&Signal> {
        self.signals.iter().find(|signal| signal.name == name)
    }
}

/// A signal of a message (`SG_`).
#[derive(Debug, Clone)]
pub struct Signal {
    /// Name of the signal, unique in its message.
    pub name: String,
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
    /// Physical unit, empty when not given.
    pub unit: String,
    /// Names of raw values (`VAL_`) in the order of the file.
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
    /// The statement is used, but a part of it that matters is not read.
    Partial,
    /// The statement is used, or not needed.
    Note,
}
