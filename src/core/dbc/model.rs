//! What a DBC file says that a gateway needs, and what was wrong with it.

use super::codec::SignalCodec;
use crate::core::can::frame::CanId;

/// A DBC file: its usable part, and a finding for everything else.
#[derive(Debug, Clone, Default)]
pub struct Database {
    /// The messages, in the order of the file; ids and names are unique.
    pub messages: Vec<Message>,
    /// What was left out or read with a grain of salt, by line.
    pub findings: Vec<Finding>,
}

impl Database {
    /// The message of that name.
    pub fn message(&self, name: &str) -> Option<&Message> {
        self.messages.iter().find(|message| message.name == name)
    }

    /// Signals of all messages.
    pub fn signal_count(&self) -> usize {
        self.messages.iter().map(|message| message.signals.len()).sum()
    }

    /// Statements that were left out.
    pub fn rejected(&self) -> usize {
        self.findings.iter().filter(|finding| finding.severity == Severity::Rejected).count()
    }
}

/// One message (`BO_`).
#[derive(Debug, Clone)]
pub struct Message {
    /// Name, unique in the file.
    pub name: String,
    /// Identifier, unique in the file.
    pub id: CanId,
    /// Length in bytes, 0 to 64.
    pub length: usize,
    /// `GenMsgCycleTime` in milliseconds, its own or the file's default; never 0.
    pub cycle_ms: Option<u32>,
    /// Line of the `BO_` statement, from 1.
    pub line: usize,
    /// The signals, in the order of the file; names are unique.
    pub signals: Vec<Signal>,
}

impl Message {
    /// The signal of that name.
    pub fn signal(&self, name: &str) -> Option<&Signal> {
        self.signals.iter().find(|signal| signal.name == name)
    }
}

/// One signal (`SG_`).
#[derive(Debug, Clone)]
pub struct Signal {
    /// Name, unique in its message.
    pub name: String,
    /// Line of the `SG_` statement, from 1.
    pub line: usize,
    /// Where its bits are and when they are there.
    pub codec: SignalCodec,
    /// What the raw bits are.
    pub number: Number,
    /// Physical units per raw step.
    pub factor: f64,
    /// Physical value of raw 0.
    pub offset: f64,
    /// Physical unit, often empty.
    pub unit: String,
    /// Names of raw values (`VAL_`), in the order of the file; often without the neutral value.
    pub values: Vec<(i128, String)>,
}

/// What a signal's raw bits are (`SIG_VALTYPE_`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    /// An integer.
    Integer,
    /// IEEE 754 single precision; 32 bits.
    Float32,
    /// IEEE 754 double precision; 64 bits.
    Float64,
}

/// Something in the file that is not as it should be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// First line of the statement, from 1.
    pub line: usize,
    /// Whether the statement was left out.
    pub severity: Severity,
    /// The statement, on one line and cut short.
    pub excerpt: String,
    /// What is wrong with it, and what was done about it where that is not plain.
    pub reason: String,
}

/// What a finding means for the statement it is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Left out.
    Rejected,
    /// Used, or not needed; worth knowing.
    Note,
}
